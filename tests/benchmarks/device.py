"""A servo identified from public logs, as `idbench device` prints it: one fit of all runs, and errors of held-out folds.

    uv run python tests/benchmarks/device.py shared.npz FOLDER OUT.json

The file and FOLDER are those of servo.py, whose folds of the law are made if they are not there.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from servo import SERVO, fold, read

from idbench.identify.servo import ServoFit, identify_servo
from idbench.identify.servo.parameters import SERVO_PARAMETERS

SOURCE = "GitHub kscalelabs/sysid: 600 runs of 6 s of one unit, three masses, two lengths, five gains, five trajectories"


def described(
    name: str, source: str, known: Mapping[str, Any], units: Sequence[ServoFit], held_out_error: float
) -> dict[str, Any]:
    """Content of a device's file.

    Parameters
    ----------
    name, source : str
        Its name, and where its logs are from.
    known : mapping of str to Any
        What servo.toml states of it.
    units : sequence of ServoFit
        The fit of each unit that was logged, with the same parameters.
    held_out_error : float
        Mean error of positions of runs that fits did not see [rad].
    """
    first = units[0]
    values = np.array([[fit.p[letter] for letter in first.p] for fit in units])
    sigma = first.standard_errors
    spread = np.std(values, axis=0, ddof=1) if len(units) > 1 else np.full(len(first.p), np.nan)
    return {
        "name": name,
        "source": source,
        "known": dict(known),
        "friction": first.friction,
        "units": len(units),
        "held_out_error": held_out_error,
        "parameters": {
            letter: {
                "value": float(np.mean(x)),
                "sigma": sigma.get(letter),
                "spread": None if np.isnan(s) else float(s),
                "unit": SERVO_PARAMETERS[letter].unit,
            }
            for letter, x, s in zip(first.p, values.T, spread, strict=True)
            if letter != "offset"  # of the bench, not of the servo
        },
        "free": list(first.free),
        "covariance": np.asarray(first.covariance).tolist(),
    }


def main():
    """Write a device."""
    path, folder, out = sys.argv[1:]
    runs, about = read(path)
    folds = [(key, value) for key in ("mass", "kp") for value in np.unique(about[key])]
    errors = []
    for key, value in folds:
        q, _ = fold((path, folder, "load", key, value))
        held = [run for run, of in zip(runs, about[key], strict=True) if of == value]
        errors += [float(np.abs(run.q - x)[run.read_well].mean()) for run, x in zip(held, q, strict=True)]
    known = {"model": "STS3215", "supply": SERVO.supply}
    made = described("STS3215", SOURCE, known, [identify_servo(runs, "load")], float(np.mean(errors)))
    Path(out).write_text(json.dumps(made, indent=1) + "\n")


if __name__ == "__main__":
    main()
