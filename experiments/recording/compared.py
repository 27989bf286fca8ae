"""Several runs, read to be compared: what differs in what was simulated, in when it moves, and in what was found."""

import json
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from idbench.experiments.errors import ExperimentError, ResultsError
from idbench.experiments.recording.stream import part
from idbench.experiments.text import with_unit
from idbench.identify import Array, LogError, MotionLog
from idbench.identify.arrays import TINY
from idbench.identify.files.log_file import read_log
from idbench.identify.tables import concise

SAME_MOTION = 0.8  # Correlation of velocities from which on two logs are of the same motion
BETTER = 0.02  # By how much a shift must correlate better than none
CLEAR = 3.0  # Difference of two estimates, in its sigma, from which on it is marked
LEFT_OUT = ("name", "origin")  # Settings of a scenario that change nothing


@dataclass(frozen=True, eq=False)
class Compared:
    """A run in a comparison."""

    folder: Path
    """Its results."""
    name: str
    """What it is called."""

    @cached_property
    def summary(self) -> Mapping[str, Any]:
        """Its summary.json; raise ResultsError if there is none."""
        try:
            found: dict[str, Any] = json.loads((self.folder / "summary.json").read_text())
            _ = found["parameters"], found["models"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            raise ResultsError(f"{self.folder} holds no run or identification to compare ({error!r:.80})") from error
        return found

    @cached_property
    def log(self) -> MotionLog:
        """Its log; raise ResultsError if it cannot be read."""
        try:
            return read_log(self.folder / "log.parquet")
        except (LogError, OSError) as error:
            raise ResultsError(f"cannot compare {self.folder}: {error}") from error

    @property
    def settings(self) -> dict[str, Any]:
        """What was simulated and how it was identified, flat: trajectory.rest and the like."""
        scenario = {k: v for k, v in self.summary.get("scenario", {}).items() if k not in LEFT_OUT}
        identification = {key: self.summary.get(key) for key in ("robot", "chain", "estimator", "torque")}
        return dict(_flat({**scenario, "identification": identification}))


def named_runs(folders: Sequence[Path]) -> list[Compared]:
    """Return runs by names as short as tell them apart.

    Raises
    ------
    ExperimentError
        If one is given twice, or their robots have different joints.
    """
    whole = [folder.resolve() for folder in folders]
    if len(set(whole)) < len(whole):
        raise ExperimentError(f"{' '.join(map(str, folders))}: a folder is given twice")
    short = [path.name for path in whole]
    alike = len({part(name) for name in short}) < len(short)
    names = [f"{k}-{name}" for k, name in enumerate(short, 1)] if alike else short
    runs = [Compared(folder, name) for folder, name in zip(folders, names, strict=True)]
    _ = [run.summary for run in runs]
    first, *others = runs
    for run in others:
        if run.log.n != first.log.n:
            raise ExperimentError(f"{run.folder} has {run.log.n} joints, {first.folder} {first.log.n}: they cannot be compared")
    return runs


def shift_of(first: MotionLog, other: MotionLog) -> float | None:
    """Time shift that puts `other` over `first` [s]; None if they do not move alike."""
    fs = min(first.fs, other.fs)
    v = [np.gradient(np.stack([np.interp(np.arange(0, log.t[-1], 1 / fs), log.t, q) for q in log.q.T]), axis=1) * fs
         for log in (first, other)]  # fmt: skip
    correlation = np.sum([scipy.signal.correlate(a, b) for a, b in zip(*v, strict=True)], axis=0)
    correlation /= max(float(np.sqrt(np.prod([np.sum(x**2) for x in v]))), TINY)
    lags = scipy.signal.correlation_lags(v[0].shape[1], v[1].shape[1])
    best, still = int(np.argmax(correlation)), int(np.flatnonzero(lags == 0)[0])
    if correlation[best] < SAME_MOTION:
        return None
    return float(lags[best] / fs) if correlation[best] > correlation[still] + BETTER else 0.0


def differences(runs: Sequence[Compared]) -> str:
    """Settings that differ, as a markdown table."""
    every = [run.settings for run in runs]
    keys = dict.fromkeys(key for settings in every for key in settings)
    if not (differing := [key for key in keys if len({json.dumps(s.get(key), sort_keys=True) for s in every}) > 1]):
        return "**Nothing differs** in what was simulated and how it was identified."
    rows = [f"| {key} | {' | '.join(_shown(s.get(key)) for s in every)} |" for key in differing]
    head = [f"| setting | {' | '.join(run.name for run in runs)} |", "|---|" + "---|" * len(runs)]
    return "\n".join(["**What differs**\n", *head, *rows])


def estimates(runs: Sequence[Compared]) -> str:
    """Return the estimates of the first model that all have, and how far the last is from the first, as a markdown table."""
    models = [model for model in runs[0].summary["models"] if all(model in run.summary["models"] for run in runs)]
    names = [name for name in runs[0].summary["parameters"] if all(name in run.summary["parameters"] for run in runs)]
    if not models or not names:
        return "No model gave an estimate in all of them."
    found = [_of(run, models[0]) for run in runs]
    truth = dict(zip(runs[0].summary["parameters"], runs[0].summary.get("truth") or (), strict=False))
    units = dict(zip(runs[0].summary["parameters"], runs[0].summary.get("units", ()), strict=False))
    head = [
        f"**Estimates**, {models[0]} model; the difference of the last from the first, in its sigma\n",
        f"| | true | {' | '.join(run.name for run in runs)} | difference |",
        "|---|---:|" + "---:|" * (len(runs) + 1),
    ]
    rows = []
    for name in names:
        X, sigma = zip(*(of[name] for of in found), strict=True)
        off = (X[-1] - X[0]) / max(float(np.hypot(sigma[0], sigma[-1])), TINY)
        marked = f"**{off:+.1f}**" if abs(off) > CLEAR else f"{off:+.1f}"
        true = f"{truth[name]:g}" if name in truth else ""
        label = with_unit(name, units.get(name, ""))
        rows.append(f"| {label} | {true} | {' | '.join(map(concise, X, sigma))} | {marked} |")
    return "\n".join([*head, *rows])


def difference(first: MotionLog, other: MotionLog, shift: float) -> tuple[Array, dict[str, Array]]:
    """Return times of the first log at which both are there [s], and q and torque of the other less those of the first."""
    t = first.t[(first.t >= other.t[0] + shift) & (first.t <= other.t[-1] + shift)]

    def apart(a: Array, b: Array) -> Array:
        pairs = zip(a.T, b.T, strict=True)
        return np.stack([np.interp(t - shift, other.t, y) - np.interp(t, first.t, x) for x, y in pairs], axis=1)

    return t, {"q": apart(first.q, other.q), "tau": apart(first.tau, other.tau)}


def _of(run: Compared, model: str) -> dict[str, tuple[float, float]]:
    found = run.summary["models"][model]
    return dict(zip(run.summary["parameters"], zip(found["estimate"], found["sigma"], strict=True), strict=True))


def _flat(settings: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def _shown(value: Any) -> str:
    if value is None or isinstance(value, float):
        return "" if value is None else f"{value:g}"
    return textwrap.shorten(str(value), 26, placeholder=" ...")
