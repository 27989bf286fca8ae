"""How far each way of identifying a payload is off, on simulated runs whose truth is known.

    uv run python tests/benchmarks/payload_ways.py [SCENARIO] [RUNS]

SCENARIO has a table [payload]. Errors are rms over the runs; the ways are those of `idbench payload --way`.
"""

import sys
from pathlib import Path

import numpy as np

from idbench.identify import IdentificationError
from idbench.identify.loads.loaded_robot import LETTERS
from idbench.identify.loads.payload import WAYS
from idbench.sim.scenario.scenario_file import load

sys.path.append(str(Path(__file__).parent.parent / "sim"))
from pairs import Pairs

if __name__ == "__main__":
    pairs = Pairs(load(sys.argv[1] if len(sys.argv) > 1 else "payload"), int(sys.argv[2]) if len(sys.argv) > 2 else 20)
    for way, of in WAYS.items():
        errors, z, names = [], [], ()
        for run in range(pairs.runs):
            robot = pairs.robot(run, {})
            try:
                found = of(robot)
            except IdentificationError as failed:
                print(f"{way}: run {run} has no estimate: {failed}")
                continue
            truth = np.array(list(robot.payload.values())) @ np.array([pairs.truth[x] for x in LETTERS])
            names = found.names
            errors.append(found.X - truth)
            z.append((found.X - truth) / found.sigma)
        if names:
            rms, share = np.sqrt(np.mean(np.square(errors), axis=0)), np.mean(np.abs(z) < 2)
            each = ", ".join(f"{name} {x:.2g}" for name, x in zip(names, rms, strict=True))
            print(f"{way}: rms errors {each}; {share:.0%} within two sigma")
