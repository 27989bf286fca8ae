"""Sets of simulated logs, whose truth is known, for `public_sets.py` and the other tools.

    uv run python tests/benchmarks/peers/simulated.py sets --seeds 20
    uv run python tests/benchmarks/public_sets.py sets/* --out runs/simulated

Of each of three arms, with each imperfection and each seed: a log to fit, and one motion of the same arm without noise, held
out, so that errors are those of the parameters alone. Other tools do not get the delay that idbench estimates: to find it is
part of an identification.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from idbench.identify import Array, MotionLog
from idbench.identify.files.log_file import write_log
from idbench.sim.encoders import ExactEncoder, IncrementalEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.frictions import LoadDependent
from idbench.sim.scenario.scenario import Scenario, Timing
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

ARMS = {"scara": "ideal", "puma560": "arm", "panda": "arm"}
"""Arms, and the scenario that each is simulated in."""

FS, MOVES, NOISE, LINES, LOADED, DELAY = 250.0, 12, 0.01, 4096, 0.1, 0.005
"""Sampling frequency [Hz], moves of a log, torque noise over rms torque, lines of encoders, friction over load, delay [s]."""

MOVED = {"scara": {"trajectory": RandomMoves(durations=(0.8, 1.4), rest=0.2)}}
"""Motions of arms whose scenario has others."""

DEFINITION = """title = "{title}"
fit = ["fit.parquet"]
held_out = ["true.parquet"]
identify = {{robot = "{arm}", model = "explicit", torque_delay = "estimate"{more}}}
delay_told = false
"""


@dataclass(frozen=True)
class Imperfection:
    """What is wrong with a log.

    Parameters
    ----------
    changes : tuple of callable
        Each returns a scenario with something imperfect, by the rms torques.
    delay : float
        Of the logged torques [s].
    more : str
        Further keys of idbench.
    """

    changes: tuple[Callable[[Scenario, Array], Scenario], ...] = ()
    delay: float = 0.0
    more: str = ""


def noisy(plain: Scenario, torques: Array) -> Scenario:
    return replace(plain, torque=replace(plain.torque, noise=tuple((NOISE * torques).tolist())))


def rounded(plain: Scenario, torques: Array) -> Scenario:
    del torques
    return replace(plain, encoder=IncrementalEncoder(lines=LINES))


def loaded(plain: Scenario, torques: Array) -> Scenario:
    del torques
    return replace(plain, friction=LoadDependent(share=LOADED))


IMPERFECTIONS = {
    "torque noise": Imperfection((noisy,)),
    "encoder": Imperfection((rounded,)),
    "delay": Imperfection(delay=DELAY),
    "friction by load": Imperfection((loaded,)),
    "all four": Imperfection((noisy, rounded, loaded), DELAY),
    "all four, law chosen": Imperfection((noisy, rounded, loaded), DELAY, ', friction = ["auto"]'),
}
"""By the names of tables."""


def moving(scenario: Scenario, seed: int) -> Scenario:
    """Return a scenario with other random moves."""
    return replace(scenario, trajectory=replace(scenario.trajectory, moves=MOVES, seed=seed), seed=seed)


def late(log: MotionLog, delay: float) -> MotionLog:
    """Return a log whose torques arrive later, and that does not say so."""
    return replace(log, tau=CubicSpline(log.t, log.tau)(np.maximum(log.t - delay, log.t[0])))


def write(folder: Path, fitted: MotionLog, true: MotionLog, **words: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    write_log(fitted, folder / "fit.parquet")
    write_log(true, folder / "true.parquet")
    (folder / "benchmark.toml").write_text(DEFINITION.format(**words))


def write_arm(folder: Path, arm: str, scenario: str, seeds: int) -> None:
    exact = {"encoder": ExactEncoder(), "timing": Timing(), "fs": FS, **MOVED.get(arm, {})}
    plain = moving(replace(load(scenario), robot=arm, **exact), 1000)
    torques = np.sqrt((simulate(plain).alone().tau ** 2).mean(axis=0))
    for name, imperfection in IMPERFECTIONS.items():
        changed, law = plain, loaded(plain, torques) if loaded in imperfection.changes else plain
        for change in imperfection.changes:
            changed = change(changed, torques)
        true = late(simulate(moving(law, 1000)).alone(), imperfection.delay)
        for seed in range(seeds):
            place = folder / f"{arm}-{name.replace(',', '').replace(' ', '-')}-{seed}"
            log = late(simulate(moving(changed, seed)).alone(), imperfection.delay)
            write(place, log, true, title=f"{arm}; {name}; {seed}", arm=arm, more=imperfection.more)
        print(f"{arm}: {name}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=20)
    asked = parser.parse_args()
    for arm, scenario in ARMS.items():
        write_arm(asked.folder, arm, scenario, asked.seeds)


if __name__ == "__main__":
    main()
