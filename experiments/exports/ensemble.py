"""Robots drawn from what an identification leaves open, and whether their free runs hold a log that was not fitted."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from idbench.experiments.exports.joint_files import NORMAL
from idbench.experiments.identification.consistent_estimate import drawn_about
from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.held_out import HeldOut, on_log
from idbench.experiments.note import Note
from idbench.identify import Array, Estimate, IdentificationError, MotionLog
from idbench.identify.arrays import TINY
from idbench.identify.telling import stage
from idbench.sim.engine.driven import shoot
from idbench.sim.errors import BenchError
from idbench.sim.robot.rewrite import rewritten
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import standard_parameters
from idbench.sim.robot.varied import model_fields

DRAWS, ROUGH = 200, 50
"""Robots that are drawn, and of those that only say how far apart all must be: their scatter is then known to a tenth."""

LENGTH = 0.5
"""Time of a free run [s]: errors of the start and of the torques grow with its square, and what is longer shows them alone."""

STRETCHES = 20  # Runs over a log at most: 40 in their place change the share that is held by 0.3 % (a simulated arm)

LEVEL = 0.95  # Share of instants that the band shall hold

SETTLED = 2  # Samples at the beginning of a run that do not count: there the position is that of the log
MOST = 4_000_000  # Values of torques that are drawn at once: 30 MB


@dataclass(frozen=True, eq=False)
class FreeRuns:
    """Free runs of the robots that were drawn, on a log."""

    title: str
    """Which log."""
    q: Array
    """Positions of the log [rad], shape (run, time, joint)."""
    low: Array
    """Of the band [rad], shape (run, time, joint)."""
    high: Array
    """Of the band [rad]."""
    diverged: float = 0.0
    """Share of the runs of single robots that diverged, and have no part in the band."""

    @property
    def held(self) -> Array:
        """Share of instants within the band, shape (joint,)."""
        inside = (self.low <= self.q) & (self.q <= self.high)
        return np.asarray(inside[:, SETTLED:].mean(axis=(0, 1)))

    @property
    def width(self) -> Array:
        """Mean width at the end of runs [rad], shape (joint,)."""
        return np.asarray((self.high - self.low)[:, -1].mean(axis=0))

    def words(self, joints: tuple[str, ...]) -> str:
        """Findings in words."""
        every, worst = float(self.held.mean()), int(self.held.argmin())
        said = (
            f"free runs of {LENGTH:g} s from {DRAWS} robots hold {100 * every:.1f} % of the instants of {self.title} "
            f"({joints[worst]} {100 * self.held[worst]:.0f} %)"
        )
        said += f"; {100 * self.diverged:.2g} % of the runs diverged" if self.diverged else ""
        return said if every >= LEVEL - 0.02 else f"{said}: less than {100 * LEVEL:.0f} %, the model lacks something there"


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Physically consistent robots with what an estimate leaves open: standard errors with the model's, delay's and noise's.

    Where the log shows nothing, bodies stay as in the robot's file. Free runs of the fitted logs say by how much all deviations
    are widened, so that `LEVEL` of their instants lie within the band: what standard errors do not know of.
    """

    fit: Fit
    """The identification."""
    model: str
    """Whose estimate it is."""
    seed: int = 0
    """Of the draws."""

    @property
    def estimate(self) -> Estimate:
        """The estimate."""
        return self.fit.estimates[self.model]

    @property
    def spread(self) -> float:
        """What deviations are multiplied by; 1 where standard errors suffice, or no run of a fitted log is possible."""
        return self.calibrated or 1.0

    @cached_property
    def calibrated(self) -> float | None:
        """What the runs of the fitted logs say of that; None if there are none."""
        rng, z = np.random.default_rng(self.seed), list[Array]()
        drawn = self._drawn(ROUGH, 1.0, rng)
        for k, log in enumerate(self.fit.logs.fitted):
            with stage(f"free runs of log {k + 1}"):
                try:
                    q, found = self._runs(HeldOut(self.fit, log, Note("")), drawn, 1.0, rng)
                except (BenchError, IdentificationError):
                    continue
            whole = np.isfinite(found).all(axis=(1, 2, 3))  # without runs in which a robot diverges
            middle, scatter = np.median(found[whole], axis=1), np.std(found[whole], axis=1)
            z.append((np.abs(q[whole] - middle) / np.maximum(scatter, 1e-12))[:, SETTLED:].ravel())
        every = np.concatenate([*z, np.empty(0)])
        return max(1.0, float(np.quantile(every, LEVEL)) / NORMAL) if len(every) else None

    @cached_property
    def standard(self) -> dict[str, Array]:
        """Standard parameters of the robots by name, shape (draw,)."""
        return self._drawn(DRAWS, self.spread, np.random.default_rng(self.seed + 1))

    @cached_property
    def disturbance(self) -> tuple[Array, Array]:
        """Rms of the torque that the model does not explain [N m], and the time over which it is alike [s], shape (joint,)."""
        sizes, times = list[Array](), list[Array]()
        for time, residual in self._residuals:
            step, centred = float(np.median(np.diff(time))), residual - residual.mean(axis=-1, keepdims=True)
            sizes.append(np.mean(residual**2, axis=-1))
            n = residual.shape[-1]
            correlation = np.fft.irfft(np.abs(np.fft.rfft(centred, 2 * n)) ** 2)[:, :n]
            below = correlation < correlation[:, :1] * np.exp(-1.0)
            times.append(step * np.where(below.any(axis=-1), below.argmax(axis=-1), n))
        return self.spread * np.sqrt(np.mean(sizes, axis=0)), np.mean(times, axis=0)

    @cached_property
    def bands(self) -> list[FreeRuns]:
        """The bands on the held-out logs; of a log that cannot be run there is none."""
        bands = list[FreeRuns]()
        for name, log in (self.fit.logs.held_out or {}).items():
            rng = np.random.default_rng(self.seed + 2)
            held = on_log(self.fit, name, log)
            with stage(f"free runs of {held.title}"):
                try:
                    q, found = self._runs(held, self.standard, self.spread, rng)
                except (BenchError, IdentificationError):
                    continue
            tails = [(1 - LEVEL) / 2, (1 + LEVEL) / 2]
            gone = ~np.asarray(np.isfinite(found).all(axis=(2, 3)), dtype=np.bool_)
            found[gone.all(axis=1)] = np.inf  # a run in which all diverge holds nothing
            low, high = np.nanquantile(found, tails, axis=1)
            bands.append(FreeRuns(held.title, q, low, high, float(gone.mean())))
        return bands

    def _drawn(self, draws: int, spread: float, rng: np.random.Generator) -> dict[str, Array]:
        """Return consistent robots about the estimate, `spread` times its standard errors away."""
        estimate, robot_model = self.estimate, self.fit.robot_model
        sigma = np.sqrt(np.maximum(np.diagonal(estimate.covariance), TINY))
        values, vectors = np.linalg.eigh(estimate.covariance / np.outer(sigma, sigma))
        root = sigma[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        deviations = spread * np.matmul(root, rng.standard_normal((draws, len(root)))[..., None])[..., 0]
        each = dict(zip(robot_model.grouping.standard.names, drawn_about(robot_model, estimate, deviations).T, strict=True))
        equal: Mapping[str, Any] = robot_model.equal(each)
        return {name: np.broadcast_to(np.asarray(x, dtype=np.float64), (draws,)) for name, x in equal.items()}

    @cached_property
    def _residuals(self) -> list[tuple[Array, Array]]:
        """What the estimate leaves of the torques: times of rows [s], and torques [N m], shape (joint, row), of each log."""
        found = []
        for part in self.estimate.problem.explicit.parts:
            rows = part.rows
            off, outside = rows.by_kind(rows.Y - np.sum(rows.W * self.estimate.X, axis=-1)), rows.maps[0].outside
            time = rows.by_kind(rows.time)[0]
            filled = np.zeros(off.shape)
            for j, (own, kept) in enumerate(zip(off, outside > 0, strict=True)):
                if kept.any():  # across reversals, which are left out, as beside them
                    filled[j] = np.interp(time, time[kept], own[kept] / outside[j, kept])
            found.append((time, filled))
        return found

    def _runs(
        self, held: HeldOut, standard: Mapping[str, Array], spread: float, rng: np.random.Generator
    ) -> tuple[Array, Array]:
        """Return positions of a log in stretches, (run, time, joint), and of free runs of robots, (run, draw, time, joint).

        They start where the log is, with its noise, and have the log's torques with what the model does not explain of others.
        """
        robot, log, qd = held.driven(self.model)
        samples = round(LENGTH * log.fs)
        if (count := log.samples // samples) < 1:
            raise IdentificationError(f"a log of {log.samples / log.fs:.3g} s has no run of {LENGTH:g} s")
        first = samples * np.unique(np.linspace(0, count - 1, min(count, STRETCHES)).astype(np.intp))
        draws, fields = len(next(iter(standard.values()))), fields_of(robot, standard)
        size, gain = spread * np.nan_to_num(self.estimate.noise_levels.position), self.fit.processing.signals(log).gain
        each = max(1, MOST // (draws * samples * log.n))
        found = list[Array]()
        for some in np.split(first, range(each, len(first), each)):
            begin = np.repeat(some, draws)
            noise = size * rng.standard_normal((2, len(begin), log.n))
            states = log.q[begin] + noise[0], qd[begin] + gain * noise[1]
            disturbance = spread * self._unexplained(log, (len(begin), samples, log.n), rng)
            varied = {name: np.tile(x, (len(some), *[1] * (x.ndim - 1))) for name, x in fields.items()}
            runs = shoot(robot, varied, states, log, begin, samples, disturbance)
            found.append(runs.reshape(len(some), draws, samples, log.n))
        return np.stack([log.q[k : k + samples] for k in first]), np.concatenate(found)

    def _unexplained(self, log: MotionLog, shape: tuple[int, ...], rng: np.random.Generator) -> Array:
        """Return torques [N m], shape (draw, time, joint): a stretch of residuals each, and the noise of samples."""
        found = rng.standard_normal(shape) * np.nan_to_num(self.estimate.noise_levels.torque)
        at = np.arange(shape[1]) / log.fs
        for k in range(shape[0]):
            time, residual = self._residuals[rng.integers(len(self._residuals))]
            begin = rng.uniform(time[0], max(time[0], time[-1] - LENGTH))
            found[k] += np.stack([np.interp(begin + at, time, x) for x in residual], axis=-1)
        return found


@lru_cache(maxsize=1)
def ensemble_of(fit: Fit, model: str) -> Ensemble:
    """Return the robots of a fit, the same for each file that has them."""
    return Ensemble(fit, model)


def robot_texts(ensemble: Ensemble, folder: Path) -> dict[Path, str]:
    """Return the files of the robots, by their paths in a folder."""
    robot_model, found = ensemble.fit.robot_model, dict[Path, str]()
    for k in range(DRAWS):
        values = {name: float(x[k]) for name, x in ensemble.standard.items()}
        found[folder / f"robot{k:03}.xml"] = rewritten(robot_model.name, values, folder.absolute(), robot_model.mounting)
    return found


def notes(ensemble: Ensemble) -> list[str]:
    """Remarks on the robots."""
    joints, spread = ensemble.fit.robot_model.robot.joints, ensemble.spread
    wider = f"deviations are {spread:.2f} times the standard errors, as free runs of the fitted logs show"
    wider = wider if ensemble.calibrated else "no free run of the fitted logs was possible: deviations are the standard errors"
    found = [band.words(joints) for band in ensemble.bands]
    return [wider, *(found or ["free runs were not judged: name a log with its motion and torques by --validate"])]


def fields_of(robot: Robot, standard: Mapping[str, Array]) -> dict[str, Array]:
    """Return MuJoCo's fields of robots with these standard parameters, of those that a robot has."""
    known = standard_parameters(robot)
    return model_fields(robot, {name: x for name, x in standard.items() if name in known})
