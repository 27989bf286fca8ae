"""What is wrong with a fit, in words, and the option or the line of a file that mends it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from idbench.experiments.identification.friction_laws import said
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.identification.wordings import WORDINGS, Wording
from idbench.experiments.text import error_percentage
from idbench.identify import Array, MotionLog
from idbench.identify.judge.suspect import Suspect
from idbench.identify.tables import concise


def causes_of(
    suspects: Sequence[Suspect], robot_model: RobotModel, log: MotionLog, gains: Sequence[float] = (), stated: str = ""
) -> tuple["Cause", ...]:
    """Mistakes as causes of a robot and its first log."""
    return tuple(Cause(each, robot_model, log, gains, tuple(suspects), stated) for each in suspects)


def remedy_of(causes: Sequence["Cause"]) -> str:
    """The options that mend causes together; empty if none does."""
    return " ".join(dict.fromkeys(cause.remedy for cause in causes if cause.remedy))


def suspect_summary(suspect: Suspect, joints: Sequence[str], unit: str, remedy: str) -> dict[str, Any]:
    """Summary of a mistake by names of joints, with what mends it."""

    def named(j: int | None) -> str | None:
        return None if j is None else joints[j]

    single = len(suspect.size) == 1
    return {
        "cause": suspect.cause,
        "joint": named(suspect.joint),
        "of": suspect.of,
        "size": suspect.size[0] if single else list(suspect.size),
        "sigma": suspect.sigma[0] if single else list(suspect.sigma),
        "unit": unit,
        "p": suspect.p,
        "alternatives": [{"cause": cause, "joint": named(j)} for cause, j in suspect.alternatives],
        "remedy": remedy,
        "held_out": list(suspect.held_out),
        "instant": suspect.instant,
        "log": None if suspect.log is None else suspect.log + 1,
    }


LARGE, ABOUT = 6.0, 0.05
"""Factor from which on a torque is said to be so many times too large, and the decades by which one of 1000 may be off."""

BEYOND, MOST_BAND = 1.25, 0.4
"""Band of rows over the frequency of a ripple that they are to have, as their filter has a transition; and over fs, at most."""

LENGTHS = frozenset({"tilt", "axis", "eccentric", "cogging", "commutation", "base_motion"})
"""Causes of two sizes across each other, whose length is reported."""


@dataclass(frozen=True, eq=False)
class Cause:
    """A mistake that residuals show, of a robot and its log."""

    suspect: Suspect
    """The mistake."""
    robot_model: RobotModel
    """The robot."""
    log: MotionLog
    """The first log."""
    gains: Sequence[float] = ()
    """Gains with which it was read, of all joints or of each, where some were given."""
    every: tuple[Suspect, ...] = ()
    """All mistakes that were found: one option mends all torques, another the friction of all joints."""
    stated: str = ""
    """The option by which something wrong was stated."""

    @property
    def joint(self) -> str | None:
        """Name of the joint; None if it is the whole robot's."""
        return None if self.suspect.joint is None else self.robot_model.robot.joints[self.suspect.joint]

    @property
    def words(self) -> str:
        """What is wrong, how sure, and what else it may be."""
        suspect, wording = self.suspect, self._wording
        t = "" if np.isinf(suspect.t) else f" ({suspect.t:.0f} sigma)"
        others = ", ".join(dict.fromkeys(map(self._named, suspect.alternatives)))
        before = f"{self.joint}: " if self.joint else "all torques: " if wording.what.startswith("torque") else ""
        return f"{before}{self.short}{t}{f'; or {others}, which this log cannot distinguish' if others else ''}"

    @property
    def short(self) -> str:
        """What is wrong, alone."""
        return self._wording.what.format(**self._values)

    @property
    def remedy(self) -> str:
        """The option that mends it, beside others of its kind; empty if none does."""
        values = self._values
        if self._wording.law and not values["laws"]:
            return ""
        if self.suspect.cause == "coupled_rotor" and self.robot_model.tree.couplings:
            return ""
        return self._wording.mend.format(**values)

    @property
    def mends(self) -> str:
        """What mends it, an option or else."""
        return self.remedy or self._wording.by.format(**self._values) or "take another law of friction"

    @property
    def advice(self) -> str:
        """What is wrong, what mends it, and what that gains on stretches of the log that were not fitted."""
        before, after = (error_percentage(x) for x in self.suspect.held_out)
        fall = f"; once mended, the error on held-out stretches falls from {before} to {after}"
        return f"{self.words}{fall if any(self.suspect.held_out) else ''}; {'try ' if self.remedy else ''}{self.mends}"

    def summary(self) -> dict[str, Any]:
        """Its part of summary.json."""
        return suspect_summary(self.suspect, self.robot_model.robot.joints, self._unit, self.mends)

    @property
    def _wording(self) -> Wording:
        return WORDINGS[self.suspect.cause, self.suspect.of]

    @property
    def _unit(self) -> str:
        """The unit of its size, of a slide that of translation."""
        unit, j = self.suspect.unit, self.suspect.joint
        if j is None or self.robot_model.tree.joints[j].kind != "slide":
            return unit
        return unit.replace("N m", "N").replace("kg m^2", "kg").replace("rad", "m")

    def _laws(self) -> str:
        """Words of friction with the laws that causes are of, each at its joint or at all; empty where nothing is new."""
        joints, laws = self.robot_model.robot.joints, self.robot_model.laws
        if laws.smooth:
            return ""
        more = [list[str]() for _ in joints]
        for each in self.every or (self.suspect,):
            if law := WORDINGS[each.cause, each.of].law.format(setting=each.setting):
                for k, found in enumerate(more):
                    if each.joint in (None, k) and law not in (*laws.names[k], *found):
                        found.append(law)
        if not any(more):
            return ""
        if len(set(laws.names)) > 1:
            return " ".join(laws.chosen(more, [()] * len(joints)).texts(joints))
        own = "+".join(laws.names[0]).replace("viscous+coulomb", "standard")
        texts = ["+".join([*([own] if own else []), *found]) for found in more]
        if len(set(texts)) == 1:
            return texts[0]
        return " ".join([own or "none", *(f"{said(j, joints)}={text}" for j, text in enumerate(texts) if more[j])])

    def _cutoff(self) -> str:
        """The option by which rows have the ripples that are above their band; empty where samples hardly have them."""
        every = [each for each in self.every or (self.suspect,) if WORDINGS[each.cause, each.of].law]
        band = BEYOND * max((each.band for each in every), default=0.0)
        return f" --cutoff {np.ceil(band):.0f}" if 0 < band < MOST_BAND * self.log.fs else ""

    def _gains(self) -> str:
        """The option that mends all torques, in as many ways as the log cannot tell apart."""
        n = len(self.robot_model.robot.joints)
        given = np.asarray(self.gains if len(self.gains) else 1.0) * np.asarray(self.log.torque.gain)
        ways = list(dict.fromkeys(each.gains for each in self.every if each.gains)) or [((1.0,) * n,)]
        mended = np.prod([way[0] for way in ways], axis=0)
        each = [mended] if len(ways) > 1 else [np.array(way) for way in ways[0]]
        for small in (s for s in self.every if s.cause == "gain" and not s.gains and s.joint is not None):
            each = [x * np.where(np.arange(n) == small.joint, 1 / (1 + small.size[0]), 1.0) for x in each]
        return " or ".join(f"--gain {' '.join(f'{x:.4g}' for x in given * gains)}" for gains in each)

    def _of_gain(self, size: str) -> str:
        """A wrong gain in words: in per cent, or as a factor where that is large."""
        factor = 1 + self.suspect.size[0]
        if factor < 0:
            return f"the torque has the other sign and is {-factor:.4g} times too large"
        if 1 / LARGE < factor < LARGE:
            return f"torque constant {size} too {'large' if factor > 1 else 'small'}"
        unit = next((f", as in {x}" for x, k in (("mN m", 3), ("kN m", -3)) if abs(np.log10(factor) - k) < ABOUT), "")
        return f"torque {factor:.4g} times too large{unit}"

    @property
    def _values(self) -> dict[str, Any]:
        s, joints = self.suspect, self.robot_model.robot.joints
        size, sigma = s.size[0], s.sigma[0]
        if s.cause in LENGTHS:
            size, sigma = (float(np.linalg.norm(x[:2])) for x in (s.size, s.sigma))
        unit = f" {self._unit}"
        for of, scale, shown in (("1", 100, "%"), ("s", 1000, "ms")):
            if s.unit == of:
                size, sigma = scale * size, scale * sigma
                unit = f" {shown}"
        if any(word in self._wording.what for word in ("{of_gain}", "{large}", "{late}", "{behind}", "{faster}")):
            size = abs(size)
        j = s.joint or 0
        last, other = min(j + 1, len(joints) - 1), int(s.size[0]) - 1 if s.cause == "exchanged" else j
        order = list(joints)
        order[j], order[other] = order[other], order[j]
        shown = f"{concise(size, sigma)}{unit}" if sigma else f"{size:.3g}{unit}"
        return {
            "size": shown,
            "of_gain": self._of_gain(shown) if s.cause == "gain" else "",
            "stated": self.stated,
            "instant": "" if s.instant is None else f"{s.instant:.1f} s{'' if s.log is None else f' of log {s.log + 1}'}",
            "large": "large" if s.size[0] > 0 else "small",
            "late": "earlier" if s.size[0] > 0 else "later",
            "behind": "late" if s.size[0] > 0 else "early",
            "faster": "faster" if s.size[0] > 0 else "slower",
            "axis": "xyz"[int(s.setting)] if s.cause == "length" else "",
            "laws": self._laws(),
            "cutoff": self._cutoff(),
            "gains": self._gains(),
            "delay": "joints" if s.joint is not None else "estimate",
            "coupling": f"motor{last + 1}={joints[j]}+{joints[last]}",
            "gravity": " ".join(f"{x:.3g}" for x in self._gravity()),
            "other": joints[other],
            "joints": " ".join(order),
            "setting": s.setting,
        }

    def _gravity(self) -> Array:
        """Gravity as it would be without the mistake [m/s^2]."""
        g = self.robot_model.tree.gravity
        if self.suspect.cause == "gravity":
            return np.round(self.suspect.size, 2) + 0.0
        if self.suspect.cause == "tilt" and np.any(g):
            axes = np.linalg.svd(g[None])[2][1:]
            turned = g + sum(size * np.cross(a, g) for size, a in zip(self.suspect.size, axes, strict=False))
            return np.asarray(turned * np.linalg.norm(g) / np.linalg.norm(turned))
        return g

    def _named(self, other: tuple[str, int | None]) -> str:
        cause, j = other
        if cause == "stated":
            return f"{self.stated} contradicts the log"
        return cause.replace("_", " ") if j is None else f"{cause.replace('_', ' ')} of {self.robot_model.robot.joints[j]}"


def words_of_diagnosis(causes: Sequence[Cause] | None) -> str:
    """Result of the tests, in a line."""
    if causes is None:
        return "mistakes: not tested, the rows are too few or are not kept"
    return f"mistakes: {'; '.join(cause.words for cause in causes) or 'none of those that were tested shows'}"
