"""What a recording costs: 40 s at 100 Hz with everything, 1 s inside the loop at 10 kHz, and being watched.

    uv run python tests/benchmarks/recording.py

Watched runs send to a rerun server on this machine; each is timed between two that nobody watches, and the ratio of the medians
is printed, of the simulation and of the whole: simulate, identify, record, write.
"""

import statistics
import subprocess
import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import rerun as rr
from timing import seconds as timed

from idbench.experiments.identification.request import Request
from idbench.experiments.identification.scenario_run import ScenarioRun
from idbench.experiments.recording.audience import LOOPBACK, Audience, answers, viewer_binary
from idbench.experiments.recording.identification_recording import RunRecording
from idbench.experiments.recording.motion_layer import Base
from idbench.experiments.results.attempts import write_streams
from idbench.experiments.results.folder import ResultsFolder
from idbench.identify import MotionLog
from idbench.sim.engine.simulation import simulate
from idbench.sim.engine.watch import Inner, Watch, WatchedStretch
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import from_dict, load

TIMES = 7
"""Repetitions."""


def forty_seconds(folder: Path) -> None:
    """Record 40 s of a closed loop with an averaged drive, simulated and identified beforehand."""
    whole, heard = ScenarioRun(load("gain"), Request()), list[WatchedStretch]()
    run = simulate(whole.scenario, watch=Watch(heard.append))
    part = cut(run.alone(), 4000)
    seconds = []
    for _ in range(TIMES):
        ran = replace(whole)
        vars(ran)["run"] = replace(run, log=MotionLog(100.0, part.q[None], part.tau[None], part.torque))
        _ = [estimate.calibrated_sigma for estimate in ran.fit.estimates.values()]
        recording = RunRecording(whole.scenario)
        seconds.append(timed(partial(record, recording, ran, heard[0], folder)))
    size = sum(path.stat().st_size for path in folder.glob("*.rrd"))
    print(f"40 s at 100 Hz, everything: {statistics.median(seconds):.3f} s, {size / 1e6:.2f} MB")


def cut(log: MotionLog, samples: int) -> MotionLog:
    """Return the first samples of a log."""
    return MotionLog(log.fs, log.q[:samples], log.tau[:samples], log.torque)


def record(recording: RunRecording, ran: ScenarioRun, heard: WatchedStretch, folder: Path) -> None:
    """Send the first 4000 samples of a run, and its identification, and write them."""
    names = ("measured", "q", "qd", "tau", "command", "logged")
    parts = {name: getattr(heard, name)[:4000] for name in names}
    reference = replace(heard.reference, **{x: getattr(heard.reference, x)[:4000] for x in ("q", "qd", "qdd")})
    electric = heard.electric and type(heard.electric)(*(x[:4000] for x in heard.electric))
    recording.base.stretch(replace(heard, reference=reference, electric=electric, **parts))
    write_streams(recording.finish(ran), results(folder))


def results(folder: Path) -> ResultsFolder:
    """Return where recordings go."""
    return ResultsFolder(folder, "run", command="benchmark")


def inside(folder: Path) -> None:
    """Record 1 s inside the loop of a chopper at 10 kHz."""
    motion = {"kind": "random", "moves": 1, "rest": 0.2}
    chopper = {"kind": "switched", "pwm": 10000.0, "bandwidth": 1000.0}
    described, heard = from_dict({"name": "inside", "trajectory": motion, "drive": chopper}), list[WatchedStretch]()
    simulate(described, watch=Watch(heard.append, window=(0.2, 1.2)))
    seconds = []
    for _ in range(TIMES):
        base = RunRecording(described).base
        seconds.append(timed(partial(send_inner, base, heard[0].inner, folder / "inner.rrd")))
    steps, size = len(heard[0].inner.t), (folder / "inner.rrd").stat().st_size
    print(f"1 s inside the loop, {steps} steps: {statistics.median(seconds):.3f} s, {size / 1e6:.2f} MB")


def send_inner(base: Base, inner: Inner, path: Path) -> None:
    """Send signals inside the loop and write them."""
    base.inside(inner)
    base.inner.write(path)


def watched(name: str, times: int) -> None:
    """Compare runs that are watched with runs that nobody watches, alternating."""
    described, seconds = load(name), {"simulated": ([], []), "all": ([], [])}
    words, url = [viewer_binary(), "--serve-web", "--bind", LOOPBACK, "--port", "9322"], f"rerun+http://{LOOPBACK}:9322/proxy"
    with subprocess.Popen(words) as server, tempfile.TemporaryDirectory() as folder:
        while not answers(url):
            time.sleep(0.05)
        for _ in range(times):
            for k, audience in enumerate((None, Audience(url))):
                simulated, everything = once(described, audience, Path(folder))
                seconds["simulated"][k].append(simulated)
                seconds["all"][k].append(everything)
        server.terminate()
    for what, (alone, seen) in seconds.items():
        ratio = statistics.median(seen) / statistics.median(alone)
        print(f"{name}, {what}: {statistics.median(alone):.2f} s alone, watched {ratio:.3f} times that")


def once(described: Scenario, audience: Audience | None, folder: Path) -> tuple[float, float]:
    """Return how long a run takes [s]: until it is simulated, and until it is written."""
    start = time.perf_counter()
    recording = RunRecording(described, audience)
    ran = ScenarioRun(described, Request(), watch=recording.watch)
    _ = ran.run
    simulated = time.perf_counter() - start
    write_streams(recording.finish(ran), results(folder))
    return simulated, time.perf_counter() - start


def main() -> None:
    """Print all."""
    rr.set_strict_mode(True)
    with tempfile.TemporaryDirectory() as folder:
        forty_seconds(Path(folder))
        inside(Path(folder))
    watched("saturation", TIMES)


if __name__ == "__main__":
    main()
