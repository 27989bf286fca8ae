"""A servo on a bench: errors of held-out runs, by laws of friction.

    uv run python tests/benchmarks/servo.py shared.npz FOLDER [LAW[+lead+...] ...]

The file has data (run, sample, column), columns (t, goal, q, ..., torque_enable), mass [kg], length [m], kp and trajectory, as
the logs of GitHub kscalelabs/sysid can be put together. Each run is judged by a fit without its mass, and a second time by one
without its gain: mean absolute error of the position, simulated from the commands alone, spikes of the bus included. Laws are
compared with the first by Wilcoxon's signed-rank test over settings (mass, length, gain, trajectory), p values times the number
of tests (Bonferroni). FOLDER keeps the errors of each fold: what is there is not computed again.

What remains of the best law is then split: without spikes; without ages of the reported position, which is renewed every 8 ms
(4 samples of 10 ms are 5 such periods, so that ages repeat), estimated from each run itself; and by what is happening.
"""

import sys
from dataclasses import replace
from itertools import product
from multiprocessing import Pool
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.stats import wilcoxon

from idbench.identify.servo import JointLoad, Servo, ServoRun, identify_servo

SERVO = Servo(0.166, supply=12.0, limit=0.97, counts=4096)
LAWS = ("load", "coulomb", "stribeck", "load-stribeck", "directional", "quadratic", "gear", "gear+lead", "gear+backlash")
AGES = 4
"""Samples after which the age of the reported position repeats."""


def read(path):
    """Return the runs, and what distinguishes them."""
    file = np.load(path)
    place = {str(name): i for i, name in enumerate(file["columns"])}
    t, q, goal, on = (file["data"][:, :, place[name]].astype(float) for name in ("t", "q", "goal", "torque_enable"))
    none, both = np.array(0.0), zip(file["mass"], file["length"], strict=True)
    loads = [JointLoad(np.array(m * x**2), np.array(9.81 * m * x), none, none) for m, x in both]
    servos = [replace(SERVO, kp=float(kp)) for kp in file["kp"]]
    runs = [ServoRun(*each, on > 0.5) for *each, on in zip(t, q, goal, loads, servos, on, strict=True)]
    return runs, {name: file[name] for name in ("mass", "length", "kp", "trajectory")}


def fold(task):
    """Return the simulated positions of the held-out runs of a fold, shape (run, sample), and the seconds of its fit."""
    path, folder, law, key, value = task
    kept = Path(folder) / f"{law}-{key}-{value:g}.npz"
    if not kept.exists():
        runs, about = read(path)
        out = about[key] == value
        start = perf_counter()
        name, *more = law.split("+")
        fit = identify_servo([run for run, o in zip(runs, out, strict=True) if not o], name, more)
        if not fit.scaled:
            print(f"{law} without {key} {value:g}: torques are known up to a factor", flush=True)
        seconds = perf_counter() - start
        np.savez(kept, q=fit.simulate([run for run, o in zip(runs, out, strict=True) if o]), seconds=seconds)
    with np.load(kept) as file:
        return file["q"], float(file["seconds"])


def errors(path, folder, law, pool, about):
    """Return residuals, each run held out with its mass and with its gain, shape (2, run, sample), and seconds of the fits."""
    runs, _ = read(path)
    q, seconds = np.zeros((2, len(runs), len(runs[0].t))), []
    folds = [(key, value) for key in ("mass", "kp") for value in np.unique(about[key])]
    for (key, value), (simulated, s) in zip(folds, pool.map(fold, [(path, folder, law, *f) for f in folds], 1), strict=True):
        q[("mass", "kp").index(key), about[key] == value] = simulated
        seconds.append(s)
    return np.stack([run.q for run in runs]) - q, seconds


def split(path, r):
    """Print what remains."""
    runs, _ = read(path)
    well = np.stack([run.read_well for run in runs])
    on = np.stack([run.enabled for run in runs])
    speed = np.gradient(np.stack([run.clean for run in runs]), 0.01, axis=1)
    r, well, on, speed = np.concatenate(np.where(well, r, 0.0)), *(np.concatenate([x, x]) for x in (well, on, speed))
    spoilt = sum((~run.read_well).any() for run in runs)
    print(
        f"without spikes ({sum((~run.read_well).sum() for run in runs)} samples of {spoilt} runs): {np.abs(r)[well].mean():.4f}"
    )
    aged = r.copy()
    for i, k in product(range(len(r)), range(AGES)):
        own, smooth = slice(k, None, AGES), r[i] - np.convolve(r[i], np.ones(2 * AGES) / (2 * AGES), "same")
        aged[i, own] -= speed[i, own] * (smooth[own] @ speed[i, own]) / (speed[i, own] @ speed[i, own] + 1e-9)
    print(f"without ages of the reported position: {np.abs(aged)[well].mean():.4f} rad")
    error, kp = (
        np.concatenate([x, x]) for x in (np.stack([run.command - run.clean for run in runs]), [run.servo.kp for run in runs])
    )
    full, rest = (SERVO.gain * kp[:, None] * np.abs(error) > SERVO.limit) & on, np.abs(speed) < 0.05
    kinds = {"off, at rest": ~on & rest, "off, falling": ~on & ~rest, "duty at its limit": full, "at rest": on & rest & ~full}
    kinds["moving"] = on & ~rest & ~full
    for name, when in kinds.items():
        some = when & well
        print(f"  {name:18s} {some.mean():5.1%} of the samples, {np.abs(r)[some].mean():.4f} rad, "
              f"{np.abs(r)[some].sum() / np.abs(r)[well].sum():5.1%} of the error")  # fmt: skip


def main(path, folder, *laws):
    """Print a line a law."""
    laws = laws or LAWS
    Path(folder).mkdir(parents=True, exist_ok=True)
    _, about = read(path)
    named = [np.unique(x, return_inverse=True)[1] for x in about.values()]
    settings = np.unique(np.stack(named), axis=1, return_inverse=True)[1]
    held = {}
    with Pool(2) as pool:
        for law in laws:
            r, seconds = errors(path, folder, law, pool, about)
            e = np.abs(r).mean(axis=2)
            held[law] = e.mean(axis=0), r
            kinds = {str(k): float(e[:, about["trajectory"] == k].mean()) for k in np.unique(about["trajectory"])}
            words = "  ".join(f"{k} {x:.4f}" for k, x in kinds.items())
            masses, gains = e.mean(axis=1)
            print(f"{law:16s} {e.mean():.4f} rad (masses {masses:.4f}, gains {gains:.4f})")
            print(f"{'':16s} {words}  {np.mean(seconds):.0f} s a fit", flush=True)
    first = laws[0]
    grouped = {law: np.bincount(settings, e) / np.bincount(settings) for law, (e, _) in held.items()}
    for law in laws[1:]:
        p = wilcoxon(grouped[law], grouped[first]).pvalue * (len(laws) - 1)
        print(f"{law} against {first}: {np.mean(grouped[law] - grouped[first]):+.5f} rad, p = {min(1.0, p):.2g}")
    best = min(held, key=lambda law: held[law][0].mean())
    print(f"what remains of {best}:")
    split(path, held[best][1])


if __name__ == "__main__":
    main(*sys.argv[1:])
