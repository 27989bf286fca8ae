"""Which step of the chain gives the paper's implicit column: 2.7 times the explicit model's errors, all eight larger?

    uv run python tests/benchmarks/implicit_steps.py [MOTIONS [FILE]]

Rows of random motions of the paper's class, noise-free, are made by NumPy and SciPy from the columns of the models, with one
step changed at a time. Printed, and kept in FILE such as docs/results/implicit-steps.json: the median ratio over the explicit
model's errors (geometric mean over the parameters), its 5 and 95 % over the motions, in how many the ratio is the paper's or
more, in how many all eight errors are larger, and the errors themselves over the paper's.
"""

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import cheby1, filtfilt

from idbench.experiments.paper.table1 import PAPER, over_explicit
from idbench.identify import MODELS, Array, MotionLog, NoPrefilter, scara
from idbench.identify.rows.chain import Chain, paper_masked_chain
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scara import scara_truth
from idbench.sim.trajectories import RandomPace

FS, EVERY, REST = 100.0, 10, 300  # Hz; samples of a row; samples at rest at either end
BASIS = scara()
ALL = slice(None)

Differentiate = Callable[[Array], Array]


def central(x: Array) -> Array:
    """Two-point difference, as the paper's."""
    return np.gradient(x, 1 / FS, axis=-1)


def forward(x: Array) -> Array:
    """Difference to the next sample."""
    return np.diff(x, axis=-1, append=x[..., -1:]) * FS


def decimated(x: Array) -> Array:
    """Matlab's decimate: Chebyshev filter of order 8, forward and backward."""
    b, a = cheby1(8, 0.05, 0.8 / EVERY)
    return filtfilt(b, a, x, axis=-1)[..., ::EVERY]


class Columns:
    """Columns c and e of a model, its measurement and the weights of its samples, shape (row, p, time) and (row, time)."""

    def __init__(self, model: str, log: MotionLog, chain: Chain) -> None:
        signals = chain.signals(log)
        equations = MODELS.create(model).equations(BASIS, signals)
        n, samples = equations.kinds, log.samples
        self.c, self.e = np.zeros((2, n, len(BASIS.names), samples))
        for dense, columns in zip((self.c, self.e), equations.columns_of(signals.state), strict=True):
            for (row, place), column in columns.items():
                if place >= 0:
                    dense[row, place] = column
        self.y, self.masked, self.moving = equations.y, equations.weight, (signals.weight > 0.5).all(axis=0)

    def weight(self, mask: bool) -> Array:
        """Weights of the samples with the mask, or 1."""
        return self.masked if mask else np.ones_like(self.masked)


def errors(W: Array, Y: Array, rows: slice | Array = ALL) -> Array:
    """Relative errors of ordinary least squares [%], shape (p,)."""
    A, y = W[..., rows].transpose(2, 0, 1).reshape(-1, W.shape[1]), Y[..., rows].T.ravel()
    shown = np.abs(A).sum(axis=1) > 0
    truth = np.array(list(scara_truth(Robot.load("scara")).values()))
    return 100 * np.abs(np.linalg.lstsq(A[shown], y[shown], rcond=None)[0] / truth - 1)


def variants(log: MotionLog, inner: Array) -> Iterator[tuple[str, Array, Array]]:
    """Yield a change of one step, and the errors of the explicit and of the implicit model with it."""
    chain = paper_masked_chain()
    explicit, implicit = (Columns(model, log, chain) for model in ("explicit", "implicit"))
    bare = [Columns(model, log, replace(chain, prefilter=NoPrefilter())) for model in ("explicit", "implicit")]
    rows = inner[::EVERY]

    def usual(of: Columns, mask: bool, s: Differentiate = central, where: Array | slice = rows) -> Array:
        weight = of.weight(mask)
        return errors(decimated((of.c + s(of.e)) * weight[:, None]), decimated(of.y * weight), where)

    def late(mask: bool) -> Array:
        weight = implicit.weight(mask)
        c, e = (decimated(x * weight[:, None]) for x in (implicit.c, implicit.e))
        return errors(c + central(e) / EVERY, decimated(implicit.y * weight), rows)

    def one_side(mask: bool) -> Array:
        weight = implicit.weight(mask)
        W = (implicit.c + central(implicit.e)) * weight[:, None]
        return errors(W[..., ::EVERY], decimated(implicit.y * weight), rows)

    def cut(of: Columns, before: bool) -> Array:
        kept = of.moving & inner
        W = of.c[..., kept] + central(of.e[..., kept]) if before else (of.c + central(of.e))[..., kept]
        return errors(decimated(W), decimated(of.y[..., kept]))

    for mask, words in ((False, "paper"), (True, "paper_masked")):
        base = usual(explicit, mask)
        yield f"none, chain {words}", base, usual(implicit, mask)
        yield f"momentum differentiated to the next sample, {words}", base, usual(implicit, mask, forward)
        yield f"momentum differentiated after the decimation, {words}", base, late(mask)
        yield f"W not filtered, {words}", base, one_side(mask)
        yield f"rows at rest kept, {words}", base, usual(implicit, mask, where=ALL)
        yield f"no prefilter, {words}", usual(bare[0], mask), usual(bare[1], mask)
    masked = usual(explicit, True)
    weighted = implicit.masked[:, None]
    W = decimated(implicit.c * weighted) + decimated(central(implicit.e * weighted))
    yield "mask before the momentum is differentiated", masked, errors(W, decimated(implicit.y * implicit.masked), rows)
    yield "samples near reversals cut out, then differentiated", cut(explicit, True), cut(implicit, True)
    yield "samples near reversals cut out afterwards", cut(explicit, False), cut(implicit, False)
    yield "reversals masked in the explicit model alone", masked, usual(implicit, False)


def main(motions: int, file: Path | None) -> None:
    """Print a row for each change, and keep them."""
    robot, found = Robot.load("scara"), dict[str, list[tuple[Array, Array]]]()
    for seed in range(motions):
        log = ideal_log(robot, RandomPace(seed=seed).sample(robot, FS))
        inner = np.zeros(log.samples, dtype=bool)
        inner[REST:-REST] = True
        for name, explicit, implicit in variants(log, inner):
            found.setdefault(name, []).append((explicit, implicit))
    paper = over_explicit({model: column.error for model, column in PAPER.items()})["implicit"]
    kept = [_row(name, *map(np.array, zip(*each, strict=True)), paper) for name, each in found.items()]
    for row in kept:
        print(f"{row['step']:60} " + "  ".join(f"{key} {x:.2g}" for key, x in row.items() if key != "step"))
    if file:
        file.write_text("[\n" + ",\n".join(json.dumps(row) for row in kept) + "\n]\n")


def _row(name: str, explicit: Array, implicit: Array, paper: float) -> dict[str, str | float]:
    ratio = np.exp(np.mean(np.log(implicit / explicit), axis=1))
    low, middle, high = np.quantile(ratio, (0.05, 0.5, 0.95))
    off = np.exp(np.mean(np.log(np.median(implicit, axis=0) / np.array(PAPER["implicit"].error))))
    shares = {"reached": np.mean(ratio >= paper), "all_larger": np.mean((implicit > explicit).all(axis=1))}
    numbers = {"ratio": middle, "low": low, "high": high, **shares, "over_paper": off}
    return {"step": name, **{key: float(f"{x:.3g}") for key, x in numbers.items()}}


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100, Path(sys.argv[2]) if len(sys.argv) > 2 else None)
