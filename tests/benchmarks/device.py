"""A servo identified from public logs, as `idbench device` prints it: one fit of all runs, and errors of held-out folds.

    uv run python tests/benchmarks/device.py shared.npz FOLDER OUT.json

The file and FOLDER are those of servo.py, whose folds of the law are made if they are not there.
"""

import json
import sys
from pathlib import Path

import numpy as np
from servo import SERVO, fold, read

from idbench.experiments.servo.device import described
from idbench.identify.servo import identify_servo

SOURCE = "GitHub kscalelabs/sysid: 600 runs of 6 s of one unit, three masses, two lengths, five gains, five trajectories"


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
