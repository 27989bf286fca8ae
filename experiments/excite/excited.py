"""A designed motion: its predicted standard errors, beside random motions and earlier logs."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.excite.design import SIGMA, Design
from idbench.experiments.excite.excitation import REST
from idbench.experiments.excite.limit_use import FS, LimitUse
from idbench.experiments.identification.robot_model import absolute
from idbench.experiments.results.writing import finite
from idbench.identify import Array
from idbench.identify.data.kinematics import Limits
from idbench.identify.design.criteria import sigmas_of
from idbench.identify.design.plan import POWER
from idbench.identify.design.search import DesignSearch
from idbench.sim.engine.simulation import Progress
from idbench.sim.limits.motion_limits import floor_of
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import to_dict
from idbench.sim.trajectories.trajectory import Reference

STARTS, BASINS = 5, 12  # Least starts of the search, and starts times joints: few joints take little time


class Stage(NamedTuple):
    """Steps under the same conditions: limits that are hard from the first lead to poor motions, or nowhere."""

    power: float
    """Of the norm that scales motions into their limits."""
    hard: float
    """What exceeding limits costs."""
    keep: int | None
    """How many of the best are followed; None for all."""
    steps: int
    """From each."""


STAGES = Stage(24.0, 0.1, None, 50), Stage(24.0, 0.3, 3, 80), Stage(POWER, 10.0, 1, 80)
"""The first asks for the determinant, the others for what is minimised."""

HARDER = 100.0, 1000.0, 10000.0, 100000.0
"""What exceeding limits costs while some are still broken; they also become narrower, by as much as is exceeded: between the
states that the search looks at torques may be larger, where a joint reverses."""

FARTHEST = 1.5
"""Most by which limits become narrower at once: a motion that leads far beyond them says little of how near it may go."""

CLOSER = 1.005  # Factor by which limits become narrower than what they are exceeded by


def searched(design: Design, random: Sequence[Array], progress: Callable[[float], None] | None = None) -> DesignSearch:
    """Return the search of the best motion, begun with the best of random ones and those of the kind's own."""
    rng, starts = np.random.default_rng([design.seed, 2]), max(STARTS, BASINS // design.robot_model.robot.n)
    own = design.excitation.starts(rng, design.plan, design.duration, design.frequency, starts - bool(random))
    cheapest = sorted(random, key=lambda c: design.plan.value(c)[0])[:1]
    total = sum((stage.keep or starts) * stage.steps for stage in STAGES)
    search, plan = DesignSearch([*own, *cheapest], total, progress), design.plan
    for stage in STAGES:
        search.run(replace(plan, power=stage.power, hard=stage.hard), stage.keep or starts, stage.steps)
        if design.criterion == SIGMA:  # the first stage asked for the determinant
            plan = replace(design.plan, criterion=design.sigma_criterion)
    for harder in HARDER:
        if not any((use := design.look(search.best)).broken()):
            return search
        plan = replace(plan, limits=_closer(plan.limits, use), hard=harder)
        search.run(plan, 1, stage.steps)
        search.found = [plan.coefficients(c) for c in search.found]  # which the design's own limits hardly scale
    if search.interrupted and cheapest and any(design.look(search.best).broken()):
        search.found = cheapest
    return search


def _closer(limits: Limits, use: LimitUse) -> Limits:
    """Return limits that are narrower by as much as a motion exceeds them."""
    over = {name: min(FARTHEST, CLOSER * float(share.max())) for name, share in use.largest.items() if share.max() > 1}
    torque = max(over.get("torque", 1.0), over.get("worst-case torque", 1.0))
    rates = {name: getattr(limits, name) / over.get(name, 1.0) for name in ("velocity", "acceleration", "jerk")}
    return replace(limits, **rates, torque=limits.torque / torque, rms_torque=limits.rms_torque / over.get("rms torque", 1.0))


BINDING = 0.9  # Share of a limit from which on it counts as active
STRETCHES = 20  # Parts of a motion whose share in the information about each parameter is shown


@dataclass(frozen=True, eq=False)
class Excited:
    """The outcome of a design."""

    design: Design
    """What was asked."""
    c: Array
    """Coefficients of the motion, shape (m, joint)."""
    random: list[Array]
    """Those of random motions that keep the limits."""
    drawn: int
    """How many were drawn for them."""
    interrupted: bool = False
    """Whether the search was ended before its time."""

    @classmethod
    def of(cls, design: Design, progress: Progress | None = None) -> "Excited":
        """Search a motion; raise ExperimentError if none is found that keeps all limits, with what it breaks."""
        design.require_home()
        random, drawn = design.random_motions()
        search = searched(design, random, progress)
        if search.interrupted:
            sys.stderr.write("\nidbench: stopping: the best motion so far is judged and written; Ctrl-C again drops it\n")
        found = cls(design, search.best, random, drawn, search.interrupted)
        ways = zip(("on the way from home", "on the way back"), map(design.use_of, found.ways), strict=True)
        if broken := [*found.use.broken(), *(f"{name}, {what}" for name, use in ways for what in use.broken())]:
            more = f", and {len(broken) - 1} more" if len(broken) > 1 else ""
            raise ExperimentError(
                f"no motion was found that keeps all limits: {broken[0]}{more}; widen that limit, narrow the [position] of "
                "joints, or try another --duration, --frequency, --seed or home"
            )
        if not np.isfinite(found.sigma).all():
            lost = [name for name, s in zip(design.robot_model.basis.names, found.sigma, strict=True) if not np.isfinite(s)]
            way_out = f"give a longer --duration, wider limits, or leave them out: --without {' '.join(lost)}"
            raise ExperimentError(f"the motion does not excite {', '.join(lost)}: {way_out}")
        return found

    @cached_property
    def use(self) -> LimitUse:
        """How far the motion uses its limits."""
        return self.design.look(self.c)

    @cached_property
    def pace(self) -> float:
        """How fast the way from home is."""
        return self.design.pace(self.c)

    @cached_property
    def ways(self) -> tuple[Reference, Reference]:
        """The ways from home to its start, and back, at 1 kHz."""
        return self.design.ways(self.c, FS, self.pace)

    @cached_property
    def information(self) -> Array:
        """Information of the motion, and of random ones, shape (1 + motion, p, p)."""
        return self.design.information([self.c, *self.random])

    @cached_property
    def sigmas(self) -> Array:
        """Standard deviations that estimates will have, from the motion and from random ones, shape (1 + motion, p)."""
        return sigmas_of(self.information)

    @cached_property
    def earlier(self) -> Array | None:
        """Standard deviations from the earlier logs, shape (p,), infinite where they have no information; None without logs."""
        return sigmas_of(self.design.known) if self.design.logs else None

    @property
    def sigma(self) -> Array:
        """Standard deviations from the motion, shape (p,)."""
        return np.asarray(self.sigmas[0])

    @cached_property
    def typical(self) -> Array:
        """Geometric means of the standard deviations, over that of the motion, shape (1 + motion,)."""
        each = np.log(self.sigmas).mean(axis=1)
        return np.asarray(np.exp(each - each[0]))

    @property
    def median(self) -> Array:
        """Standard deviations from the median random motion, parameter by parameter, shape (p,); NaN without any."""
        return np.median(self.sigmas[1:], axis=0) if self.random else np.full(len(self.sigma), np.nan)

    @property
    def best(self) -> Array:
        """Standard deviations from the best random motion, shape (p,); NaN without any."""
        return self.sigmas[1 + int(self.typical[1:].argmin())] if self.random else np.full(len(self.sigma), np.nan)

    @property
    def ratios(self) -> tuple[float, float]:
        """Typical sigma relative to the median random motion, and to the best one; NaN without any."""
        others = self.typical[1:]
        return (1 / float(np.median(others)), 1 / float(others.min())) if len(others) else (np.nan, np.nan)

    @cached_property
    def condition(self) -> float:
        """Cond(W), of the rows of joints that move."""
        plan = self.design.plan
        W = plan.information.weighted(plan.motion(self.c))
        return float(np.linalg.cond(W.reshape(-1, W.shape[-1])))

    @cached_property
    def shares(self) -> Array:
        """Share of each stretch of the motion in the information about each parameter, shape (stretch, p)."""
        plan = self.design.plan
        motion = plan.motion(self.c)
        W = plan.information.weighted(motion)
        V = np.linalg.inv(plan.matrix(motion))
        told = np.sum((plan.repeat * plan.information.whitened(W) @ V) * (W @ V), axis=1) / np.diag(V)
        return np.stack([part.sum(axis=0) for part in np.array_split(told, STRETCHES)])

    @property
    def binding(self) -> list[str]:
        """Active limits, in words."""
        joints, found = self.use.joints, []
        for name, largest in self.use.largest.items():
            if near := [joint for joint, share in zip(joints, largest, strict=True) if share > BINDING]:
                found.append(f"{name} of {'all joints' if len(near) == len(joints) else ', '.join(near)}")
        return found

    @cached_property
    def scenario(self) -> Scenario:
        """What simulates it."""
        d, file = self.design, Path(self.design.robot)
        asked = f"{d.kind}, {d.duration:g} s, {d.frequency:g} Hz, {d.criterion}, seed {d.seed}"
        name, origin = f"{file.stem}-excited", f"idbench excite {file.name}, {asked}"
        robot, trajectory = absolute(d.robot), d.trajectory(self.c)
        return replace(d.scenario, name=name, origin=origin, robot=robot, trajectory=trajectory, start=())

    def planned(self, fs: float) -> tuple[Array, Reference]:
        """Return the part of each sample (0 there, 1 motion, 2 back), and the whole way of the arm, from home to home."""
        main = self.design.trajectory(self.c).motion(self.design.robot_model.robot).sample(fs)
        there, back = self.design.ways(self.c, fs, self.pace)
        whole = [np.concatenate([getattr(x, name) for x in (there, main, back)]) for name in ("q", "qd", "qdd")]
        return np.repeat([0.0, 1.0, 2.0], [len(there.q), len(main.q), len(back.q)]), Reference(fs, *whole)

    def summary(self) -> dict[str, Any]:
        """Return summary.json."""
        d, names = self.design, self.design.robot_model.basis.names
        median, best = self.ratios
        table = {"sigma": self.sigma, "random_median": self.median, "random_best": self.best}
        table |= {} if self.earlier is None else {"earlier": self.earlier}
        return {
            "experiment": "excite",
            "robot": absolute(d.robot),
            **{name: getattr(d, name) for name in ("kind", "criterion", "duration", "frequency", "repeat")},
            "rest": REST,
            "seed": d.seed,
            "earlier_logs": len(d.logs),
            "interrupted": self.interrupted,
            "parameters": list(names),
            "prior": d.X.tolist(),
            **{key: [finite(x) for x in values] for key, values in table.items()},
            "over_random_median": finite(median),
            "over_random_best": finite(best),
            "random_motions": len(self.random),
            "random_drawn": self.drawn,
            "condition_number": finite(self.condition),
            "floor": self.floor,
            "noise": {"torque": d.levels.torque.tolist(), "position": d.levels.position.tolist()},
            "limits_used": {name: share.tolist() for name, share in self.use.largest.items()},
            "binding": self.binding,
            "unchecked": self.unchecked,
            "scenario": to_dict(self.scenario),
        }

    @property
    def floor(self) -> float | None:
        """Height of the floor [m], where one is kept clear of."""
        d = self.design
        return floor_of(d.robot_model.robot, d.asked) if d.clearance.checks else None

    @property
    def unchecked(self) -> str:
        """What could not be checked, in words; empty if there is nothing."""
        clearance = self.design.clearance
        pairs = "; ".join(" and ".join(pair) for pair in clearance.left_out)
        if not clearance.checks and pairs:
            why = "all shapes are too near whatever the posture, and were left out"
            return f"{why}: nothing was checked for collisions: {pairs}"
        if not clearance.checks:
            return "nothing is known of the robot's shapes: whether it hits itself or the floor was not checked"
        found = [f"left out, since they are too near whatever the posture: {pairs}"] if pairs else []
        if bare := ", ".join(clearance.bare):
            found.append(f"not checked, since they have no shape that MuJoCo can measure: {bare}")
        return "; ".join(found)
