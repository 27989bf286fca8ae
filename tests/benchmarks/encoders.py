"""Typical errors and z of the SCARA over encoders, by chain `idbench`, and by it without prefilter and with wide masks.

    uv run python tests/benchmarks/encoders.py

Twelve logs of 20 s at 100 Hz each, of fifth-order moves and of Fourier series; explicit model, GLS. Typical error: median over
the parameters of the rms error [%]. z: rms error in standard errors.
"""

from dataclasses import replace

import numpy as np

from idbench.identify import ESTIMATORS, MODELS, Chain, MotionLog, NoPrefilter, ReversalMask, idbench_chain, identify, scara
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import Fourier, RandomMoves

LOGS = 12
TRUTH = np.array([3.5, 0.05, 0.5, 0.06, 0.12, 0.005, 0.01, 0.1])
CELLS = ((16, 0.0), (14, 0.0), (12, 0.0), (14, 0.02))


def series(seed: int) -> Fourier:
    """Return a random series of five harmonics that repeats once."""
    rng, k = np.random.default_rng(seed), np.arange(1, 6)[:, None]
    a, b = (tuple(map(tuple, (rng.normal(size=(5, 2)) * 0.5 / k).tolist())) for _ in range(2))
    return Fourier(period=10.0, sines=a, cosines=b, repeat=2, fade=1.0, rest=0.7)


def log_of(motion: str, seed: int, bits: int, noise: float) -> MotionLog:
    """Return a log with an encoder of so many bits, and torque noise of a share of each joint's rms torque."""
    moves = RandomMoves(moves=14, seed=seed, durations=(1.1, 1.55), rest=0.7)
    trajectory = moves if motion == "moves" else series(seed)
    encoder = IncrementalEncoder(lines=2 ** (bits - 2))
    log = simulate(replace(load("ideal"), trajectory=trajectory, encoder=encoder)).alone()
    level = noise * np.sqrt(np.mean(log.tau**2, axis=0))
    return replace(log, tau=log.tau + level * np.random.default_rng([seed, 7]).standard_normal(log.tau.shape))


def figures(chain: Chain, logs: list[MotionLog]) -> str:
    """Return the typical error [%] and z."""
    found = [identify(log, scara(), MODELS.create("explicit"), chain, ESTIMATORS.create("GLS")) for log in logs]
    off = np.array([one.X for one in found]) - TRUTH
    z = off / np.array([one.standard_errors for one in found])
    return f"{100 * np.median(np.sqrt(np.mean((off / TRUTH) ** 2, axis=0))):.4f} (z {np.sqrt(np.mean(z**2)):.2f})"


def main() -> None:
    """Print a line for each encoder and motion."""
    wide = replace(idbench_chain(), prefilter=NoPrefilter(), mask=ReversalMask(width=0.03, taper=0.1))
    for bits, noise in CELLS:
        for motion in ("moves", "series"):
            logs = [log_of(motion, seed, bits, noise) for seed in range(LOGS)]
            each = "   ".join(
                f"{name}: {figures(chain, logs)}"
                for name, chain in {"idbench": idbench_chain(), "wide, unfiltered": wide}.items()
            )
            print(f"{bits} bits, torque noise {100 * noise:g} %, {motion}   {each}", flush=True)


if __name__ == "__main__":
    main()
