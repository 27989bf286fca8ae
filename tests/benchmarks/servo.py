"""A servo on a bench: errors of held-out runs, by laws of friction.

    uv run python tests/benchmarks/servo.py shared.npz [LAW[+lead] ...]

The file has data (run, sample, column), columns (t, goal, q, ..., torque_enable), mass [kg], length [m], kp and trajectory, as
the logs of GitHub kscalelabs/sysid can be put together. Each run is judged by a fit without its mass, and a second time by one
without its gain: mean absolute error of the position, simulated from the commands alone. Laws are compared by Wilcoxon's
signed-rank test over settings (mass, length, gain, trajectory), p values times the number of tests.
"""

import sys
from multiprocessing import Pool
from time import perf_counter

import numpy as np
from scipy.stats import wilcoxon

from identify.servo import JointLoad, Servo, ServoRun, identify_servo

SERVO = Servo(0.166, supply=12.0, duty_limit=0.97)
LAWS = ("coulomb", "stribeck", "load", "load-stribeck", "directional", "quadratic", "gear", "load+lead")


def read(path):
    """Return the runs, and what distinguishes them."""
    file = np.load(path)
    place = {str(name): i for i, name in enumerate(file["columns"])}
    t, q, goal, on = (file["data"][:, :, place[name]].astype(float) for name in ("t", "q", "goal", "torque_enable"))
    loads = [JointLoad.pendulum(m, x) for m, x in zip(file["mass"], file["length"], strict=True)]
    runs = [ServoRun(*each, on > 0.5) for *each, on in zip(t, q, goal, loads, file["kp"].astype(float), on, strict=True)]
    return runs, {name: file[name] for name in ("mass", "length", "kp", "trajectory")}


def fold(task):
    """Return the errors of the held-out runs of a fold, and the seconds of its fit."""
    path, law, key, value = task
    runs, about = read(path)
    out = about[key] == value
    start = perf_counter()
    name, _, more = law.partition("+")
    fit = identify_servo(SERVO, [run for run, o in zip(runs, out, strict=True) if not o], name, [more] if more else [])
    return fit.errors([run for run, o in zip(runs, out, strict=True) if o]), perf_counter() - start


def main(path, *laws):
    """Print a line a law."""
    laws = laws or LAWS
    _, about = read(path)
    folds = [(key, value) for key in ("mass", "kp") for value in np.unique(about[key])]
    settings = np.unique(np.stack([np.unique(x, return_inverse=True)[1] for x in about.values()]), axis=1, return_inverse=True)[
        1
    ]
    held = {}
    with Pool(2) as pool:
        for law in laws:
            found = pool.map(fold, [(path, law, *each) for each in folds], chunksize=1)
            errors = {key: np.zeros(len(settings)) for key in ("mass", "kp")}
            for (key, value), (e, _) in zip(folds, found, strict=True):
                errors[key][about[key] == value] = e
            held[law] = e = (errors["mass"] + errors["kp"]) / 2
            kinds = {str(k): float(e[about["trajectory"] == k].mean()) for k in np.unique(about["trajectory"])}
            seconds = np.mean([s for _, s in found])
            words = "  ".join(f"{k} {x:.4f}" for k, x in kinds.items())
            print(
                f"{law:16s} {e.mean():.4f} rad (masses {errors['mass'].mean():.4f}, gains {errors['kp'].mean():.4f})",
                flush=True,
            )
            print(f"{'':16s} {words}  {seconds:.0f} s a fit", flush=True)
    first = laws[0]
    grouped = {law: np.bincount(settings, e) / np.bincount(settings) for law, e in held.items()}
    for law in laws[1:]:
        p = wilcoxon(grouped[law], grouped[first]).pvalue * (len(laws) - 1)
        print(f"{law} against {first}: {np.mean(grouped[law] - grouped[first]):+.5f} rad, p = {min(1.0, p):.2g}")


if __name__ == "__main__":
    main(*sys.argv[1:])
