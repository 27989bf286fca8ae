"""An example to work on: the file of an arm, and two logs that it recorded."""

import tempfile
from dataclasses import replace
from pathlib import Path

from idbench.identify import write_log
from idbench.sim import Robot, load_scenario, run
from idbench.sim.trajectories import RandomMoves

ROBOT = "puma560"
FS = 250.0  # [Hz], of a common robot controller
DELAY = 0.002
"""Robot, sampling frequency [Hz], and delay of the torques [s], which no file of the example states."""

NOISE = (0.3, 0.6, 0.2, 0.02, 0.02, 0.02)
"""Of the torques, rms [N m]."""

LOGS = {"log.csv": 1, "second.csv": 2}
"""Files, and the seeds of their motions."""


def example_files() -> dict[str, str]:
    """Return the files of an example, by their names: an arm in MJCF, and logs of two motions in closed loop."""
    contents = {"arm.xml": Robot.path(ROBOT).read_text(encoding="utf-8")}
    plain = load_scenario("arm")
    scenario = replace(plain, robot=ROBOT, fs=FS, torque=replace(plain.torque, noise=NOISE))
    for name, seed in LOGS.items():
        moves = RandomMoves(moves=24, durations=(0.8, 1.6), velocity=(2.0,), rest=0.8, seed=seed)
        timing = replace(scenario.timing, delay=DELAY)
        log = run(replace(scenario, trajectory=moves, timing=timing, seed=seed)).alone()
        with tempfile.TemporaryDirectory(prefix="idbench-") as folder:
            path = Path(folder) / name
            write_log(log, path)
            contents[name] = path.read_text(encoding="utf-8")
    return contents
