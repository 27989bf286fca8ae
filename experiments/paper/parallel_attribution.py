"""The attribution of Table 2, computed by a second process while this one simulates the twin.

As a program, ``python -m experiments.paper.parallel_attribution`` reads a scenario as JSON and prints the errors of each
imperfection as a line of JSON.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from threading import Thread

import numpy as np

from idbench.experiments.paper.attribution import Errors, errors_of, imperfections
from idbench.sim.engine.simulation import Progress
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import from_dict, to_dict


class ParallelAttribution:
    """Errors of imperfections: a process begins with the first; this one takes the last when it has time.

    What the process does not give, since it cannot run or was killed, this one computes. No bit depends on who did.

    Parameters
    ----------
    table2 : Scenario
        The robot and its motion.
    """

    def __init__(self, table2: Scenario) -> None:
        self._imperfections = {one.name: one for one in imperfections(table2)}
        self._found: dict[str, Errors] = {}
        self._process = _begun()
        self._reader = Thread(target=self._exchange, args=(json.dumps(to_dict(table2)),), daemon=True)
        self._reader.start()

    def errors(self, progress: Progress | None = None) -> dict[str, Errors]:
        """Return, for every imperfection, the signed error [%] of every parameter in each model."""
        try:
            while missing := [name for name in self._imperfections if name not in self._found]:
                if progress:
                    progress(1 - len(missing) / len(self._imperfections))
                if len(missing) == 1 and self._reader.is_alive():  # what the process is busy with
                    self._reader.join()
                elif missing[-1] not in self._found:
                    self._found[missing[-1]] = errors_of(self._imperfections[missing[-1]])
        finally:
            self.stop()
        return {name: self._found[name] for name in self._imperfections}

    def stop(self) -> None:
        """End the process; it may have ended."""
        if self._process:
            self._process.kill()
            self._process.wait()
        self._reader.join()

    def _exchange(self, scenario: str) -> None:
        """Write the scenario to the process, and keep what it answers until it has all, or ends."""
        if not self._process or not self._process.stdin or not self._process.stdout:
            return
        with suppress(OSError, ValueError), self._process.stdout as answers:  # it has ended, or was ended within a line
            with self._process.stdin as asked:
                asked.write(scenario)
            for line in answers:
                name, errors = json.loads(line)
                self._found.setdefault(name, {form: np.array(error) for form, error in errors.items()})
                if self._imperfections.keys() <= self._found.keys():
                    return


def _begun() -> subprocess.Popen[str] | None:
    """Return a process that runs this file as a program, None if there can be none."""
    pipe, words = subprocess.PIPE, ["-P", "-m", __spec__.name]  # -P: not what lies in the working directory
    with suppress(OSError):
        # A session of its own: Ctrl-C, which a terminal sends to all of its processes, is for this one, which ends the other.
        return subprocess.Popen(
            [sys.executable, *words], stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True, start_new_session=True
        )
    return None


def lines(scenario: str) -> Iterator[str]:
    """Yield the errors of each imperfection, as JSON, of a scenario in JSON."""
    for one in imperfections(from_dict(json.loads(scenario))):
        yield json.dumps([one.name, {form: error.tolist() for form, error in errors_of(one).items()}])


if __name__ == "__main__":
    for each in lines(sys.stdin.read()):
        sys.stdout.write(each + "\n")
        sys.stdout.flush()
