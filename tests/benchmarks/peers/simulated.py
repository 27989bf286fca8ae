"""Sets of simulated logs, whose truth is known, for `idbench benchmark` and the other tools.

    uv run python tests/benchmarks/peers/simulated.py sets --seeds 20
    uv run idbench benchmark sets/* --out runs/simulated

Of each of three arms, with each of three imperfections and each seed: a log to fit, and one motion of the same arm without
noise, held out, so that errors are those of the parameters alone. Torques are logged without delay.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from identify.files.log_file import write_log
from sim.encoders.incremental_encoder import IncrementalEncoder
from sim.engine.simulation import simulate
from sim.frictions import LoadDependent
from sim.scenario.scenario_file import load
from sim.trajectories import RandomMoves

ARMS = {"scara": "ideal", "puma560": "arm", "panda": "arm"}
"""Arms, and the scenario that each is simulated in."""

FS, MOVES, NOISE, LINES, LOADED = 500.0, 20, 0.01, 4096, 0.1
"""Sampling frequency [Hz], moves of a log, torque noise over rms torque, lines of encoders, friction over load."""

MOVED = {"scara": {"trajectory": RandomMoves(durations=(0.8, 1.4), rest=0.2)}}
"""Motions of arms whose scenario has others."""

DEFINITION = """title = "{title}"
fit = ["fit.parquet"]
held_out = ["true.parquet"]
options = "--robot {arm} --model explicit"
"""


def moving(scenario, seed: int):
    """Return a scenario with other random moves."""
    return replace(scenario, trajectory=replace(scenario.trajectory, moves=MOVES, seed=seed), seed=seed)


def imperfect(plain, torques):
    """Return scenarios with one imperfection each, by its name."""
    return {
        "torque noise": replace(plain, torque=replace(plain.torque, noise=tuple((NOISE * torques).tolist()))),
        "encoder": replace(plain, encoder=IncrementalEncoder(lines=LINES)),
        "friction by load": replace(plain, friction=LoadDependent(share=LOADED)),
    }


def write(folder: Path, title: str, arm: str, fitted, true) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    write_log(fitted, folder / "fit.parquet")
    write_log(true, folder / "true.parquet")
    (folder / "benchmark.toml").write_text(DEFINITION.format(title=title, arm=arm))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=20)
    asked = parser.parse_args()
    for arm, scenario in ARMS.items():
        plain = moving(replace(load(scenario), robot=arm, fs=FS, **MOVED.get(arm, {})), 1000)
        true = simulate(plain).alone()
        torques = np.sqrt((true.tau**2).mean(axis=0))
        for name, changed in imperfect(plain, torques).items():
            held_out = true if name != "friction by load" else simulate(moving(changed, 1000)).alone()
            for seed in range(asked.seeds):
                log = simulate(moving(changed, seed)).alone()
                place = asked.folder / f"{arm}-{name.replace(' ', '-')}-{seed}"
                write(place, f"{arm}, {name}, {seed}", arm, log, held_out)
        print(arm, flush=True)


if __name__ == "__main__":
    main()
