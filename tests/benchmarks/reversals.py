"""Maximum likelihood with friction through reversals, beside the fit that leaves them out and the bound that knows them.

    uv run python tests/benchmarks/reversals.py [RUNS [FILE]]

Logs of 26 s at 100 Hz come from a simulator whose friction is exact (tests/identify/exact_scara.py); FILE, such as
docs/results/reversals.json, keeps what is printed: typical errors [%], coverage of two sigma [%], seconds a log.
"""

import importlib.util
import json
import sys
import time
from pathlib import Path

import numpy as np

from idbench.identify import (
    MODELS,
    GeneralizedLeastSquares,
    MaximumLikelihood,
    MotionLog,
    NoiseLevels,
    Problem,
    TorqueChannel,
    cramer_rao,
    idbench_chain,
    scara,
)

FS, FLOOR = 100.0, np.array([1e-4, 1e-5])
CASES = [
    (motion, bits, torque) for motion in ("series", "moves") for bits, torque in ((16, 0.0), (14, 0.0), (12, 0.0), (16, 0.01))
]
"""Motion, bits of the encoders, noise of the torques [N m]."""

ESTIMATORS = {
    "GLS": GeneralizedLeastSquares(),
    "ML": MaximumLikelihood(),
    "ML-reversals": MaximumLikelihood(reversals=True),
}

_spec = importlib.util.spec_from_file_location("exact_scara", Path(__file__).parent.parent / "identify" / "exact_scara.py")
assert _spec is not None
assert _spec.loader is not None
exact = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(exact)


def percent(relative: np.ndarray) -> float:
    """Return the geometric mean over parameters of the rms over runs [%]."""
    return float(100 * np.exp(np.mean(np.log(np.sqrt(np.mean(relative**2, axis=0))))))


def compared(motion: str, bits: int, torque: float, logs: np.ndarray) -> dict[str, object]:
    """Return the bounds and what both estimators reach."""
    (q, v, tau), rng, sigma = logs, np.random.default_rng(bits), 2 * np.pi / 2**bits / np.sqrt(12)
    noisy = MotionLog(
        FS, q + sigma * rng.standard_normal(q.shape), tau + torque * rng.standard_normal(q.shape), TorqueChannel("held")
    )
    problem, found = Problem((noisy,), scara(), MODELS.create("explicit"), idbench_chain()), {"motion": motion, "bits": bits}
    found |= {"torque_noise": torque, "runs": len(q)}
    levels = NoiseLevels(np.maximum(torque, FLOOR), np.full(2, sigma))
    for name, used in (("bound", False), ("bound through reversals", True)):
        C = cramer_rao(scara(), exact.X, q, v, FS, levels, reversals=used)
        found[name] = percent(np.sqrt(np.diagonal(C, axis1=-2, axis2=-1)) / exact.X)
    for name, estimator in ESTIMATORS.items():
        start = time.perf_counter()
        fit = estimator.fit(problem, throw=False)
        took, known = time.perf_counter() - start, np.isfinite(fit.X).all(axis=-1)
        z = (fit.X - exact.X)[known] / fit.own_sigma[known]
        found[name] = {
            "typical": percent((fit.X[known] - exact.X) / exact.X),
            "coverage": float(100 * np.mean(np.abs(z) < 2)),
            "refused": int(np.count_nonzero(~known)),
            "seconds": took / len(q),
        }
    return found


def main() -> None:
    """Print a line a case, and keep all of them."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 64
    logs = {motion: exact.simulated(getattr(exact, motion)(runs)) for motion in ("series", "moves")}
    every = []
    for motion, bits, torque in CASES:
        every.append(compared(motion, bits, torque, logs[motion]))
        print(json.dumps(every[-1]), flush=True)
    if len(sys.argv) > 2:
        Path(sys.argv[2]).write_text("[\n" + ",\n".join(map(json.dumps, every)) + "\n]\n")


if __name__ == "__main__":
    main()
