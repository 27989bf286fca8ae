"""What is known of the servos of a robot, on disk: servo.toml."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from idbench.identify.errors import IdentificationError, SettingError
from idbench.identify.plugins import did_you_mean
from idbench.identify.servo.law import KINDS, PUBLISHED, Servo, TimeSteps

GAIN_UNITS = {"1/rad": 1.0, "1/deg": 180 / np.pi, "1/count": 0.0}
"""Units of a gain, duty per unit of kp and of error, and what makes 1/rad of it; counts depend on the encoder."""

LIMITS = tuple(kind.limit for kind in KINDS.values())  # What the limit of a loop is called, by its kind

KEYS = ("model", "gain_unit", *(field.name for field in fields(Servo) if field.name not in ("limit", "steps")), *LIMITS)
"""What a servo may state."""

WORDS = ("model", "gain_unit", "kind")  # Of these, what is no number
MODELS = f"published: {', '.join(PUBLISHED)}"  # What may be stated as a model, in words
COUNTS = 4096  # Counts of a servo's encoder that are assumed where neither they nor a model are stated, as of most

MAX_OVER_SUPPLY = 1.5
"""Times the largest supply of a datasheet from which on another unit is suspected: people do run servos a little above it."""

ROBOT = "robot"  # What a log may state beside: the robot, links and load, that it is of


@dataclass(frozen=True)
class ServoFile:
    """What is known of the servos of a robot."""

    stated: Mapping[str, Any]
    """What holds for all joints."""
    joints: Mapping[str, Mapping[str, Any]]
    """What holds for one joint alone, by its name."""
    logs: Mapping[str, Mapping[str, Any]]
    """What holds for some logs alone, by the name of the file or a pattern (* for any letters): kp, or the robot that carried
    another load."""
    steps: Mapping[str, TimeSteps] = field(default_factory=dict)
    """What the integrator of a simulation makes of joints, by their names."""
    folder: Path = Path()
    """Where the file is: robots of logs are named from there."""

    @classmethod
    def read(cls, path: Path) -> "ServoFile":
        """Content of a file; raise SettingError that names what is unknown or wrong in it."""
        try:
            stated = tomllib.loads(path.read_text(encoding="utf-8"))
            joints, logs = stated.pop("joints", {}), stated.pop("logs", {})
            made = cls(stated, joints, logs, folder=path.absolute().parent)
            for part in (stated, *joints.values(), *({k: x for k, x in each.items() if k != ROBOT} for each in logs.values())):
                _require_known(part)
            _require_names(logs)
            made.servo("", "")
        except OSError as error:
            raise SettingError(f"cannot read {path}: {error.strerror or error}") from error
        except (ValueError, TypeError, AttributeError, RecursionError) as error:  # ours are ValueErrors, too
            raise SettingError(f"{path}: {error}") from error
        return made

    def servo(self, joint: str, log: str) -> Servo:
        """Return the servo of a joint in a log."""
        stated = {**self.stated, **self.joints.get(joint, {}), **self._of_log(log)}
        stated.pop(ROBOT, None)
        model, unit = stated.pop("model", None), stated.pop("gain_unit", "1/rad")
        kind = stated.get("kind", Servo.kind)
        if model is not None:
            stated = _of_model(model, stated)
        if kind == Servo.kind:
            if "gain" not in stated:
                raise SettingError(f"gain is missing: the duty per unit of kp and rad, or a model that has it; {MODELS}")
            stated = {"counts": COUNTS, **stated}
        elif "kp" not in stated and "kd" not in stated:
            raise SettingError(f"kp is missing: the gain of a loop of kind {kind!r}, by its unit of command per rad")
        if unit not in GAIN_UNITS:
            raise SettingError(f"gain_unit = {unit!r} is unknown; known: {', '.join(GAIN_UNITS)}")
        if kind in KINDS and (wrong := [name for name in LIMITS if name in stated and name != KINDS[kind].limit]):
            raise SettingError(f"{wrong[0]}: the limit of a loop of kind {kind!r} is {KINDS[kind].limit}")
        limit = next((stated.pop(name) for name in LIMITS if name in stated), np.inf)
        counts = stated.get("counts", Servo.counts)
        stated["gain"] = stated.get("gain", 1.0) * (GAIN_UNITS[unit] or counts / (2 * np.pi))
        return Servo(**stated, limit=limit, steps=self.steps.get(joint, TimeSteps()))

    def require(self, joints: Sequence[str], logs: Sequence[str]) -> None:
        """Raise SettingError if something is stated of a joint or a log that is not there."""
        if wrong := [name for name in self.joints if name not in joints]:
            what = f"the robot has no such joint{did_you_mean(wrong[0], joints)}"
            raise SettingError(f"[joints.{wrong[0]}]: {what}; it has {', '.join(joints)}")
        wrong = [pattern for pattern in self.logs if not any(fnmatchcase(log, pattern) for log in logs)]
        some = len(wrong) < len(self.logs)  # then a pattern without a log is of one that is not given here
        if wrong := [pattern for pattern in wrong if not (some and set(pattern) & set("*?["))]:
            raise SettingError(f'[logs."{wrong[0]}"]: no log has that name; logs are {", ".join(logs)}')

    def robot(self, log: str) -> str | None:
        """Return the robot that a log is of, if that is stated: its name, or the path of its file."""
        name = self._of_log(log).get(ROBOT)
        return str(self.folder / name) if name and (self.folder / name).exists() else name

    def _of_log(self, log: str) -> dict[str, Any]:
        """Statements about a log; later patterns override earlier ones."""
        return {key: x for pattern, part in self.logs.items() if fnmatchcase(log, pattern) for key, x in part.items()}


def _of_model(model: Any, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Statements, completed by the published data of a model."""
    if model not in PUBLISHED:
        raise SettingError(f"model = {model!r} is unknown{did_you_mean(str(model), PUBLISHED)}; {MODELS}")
    known = PUBLISHED[model]
    supply = stated.get("supply", 0.0)
    if supply > MAX_OVER_SUPPLY * known.supply:
        raise SettingError(f"supply = {supply:g} V is impossible: a {model} takes at most {known.supply:g} V")
    return {"gain": known.gain, "duty_limit": known.duty_limit, "counts": known.counts, **stated}


def _require_names(logs: Mapping[str, Mapping[str, Any]]) -> None:
    for pattern, part in logs.items():
        if ROBOT in part and not isinstance(part[ROBOT], str):
            raise IdentificationError(f'[logs."{pattern}"]: robot = {part[ROBOT]!r} must be the name of a robot or of its file')


def _require_known(part: Mapping[str, Any]) -> None:
    for key, value in part.items():
        if key not in KEYS:
            known = ", ".join((*KEYS, "joints", "logs"))
            raise IdentificationError(f"key {key!r} is unknown{did_you_mean(key, KEYS)}; known: {known}")
        if key not in WORDS and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise IdentificationError(f"{key} = {value!r} must be a number")
        if key == "counts" and int(value) != value:
            raise IdentificationError(f"counts = {value!r} must be a whole number: those of the encoder in a turn")
