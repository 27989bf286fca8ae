"""What is known of servos, as a file: servo.toml."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, final

import numpy as np

from idbench.identify.errors import IdentificationError, SettingError
from idbench.identify.plugins import did_you_mean
from idbench.identify.servo.servo import PUBLISHED, Servo

GAIN_UNITS = {"1/rad": 1.0, "1/deg": 180 / np.pi, "1/count": 0.0}
"""Units of a gain, duty per unit of kp and of error, and what makes 1/rad of it; counts depend on the encoder."""

KEYS = ("model", "gain_unit", *(field.name for field in fields(Servo)))
"""What a servo may state."""

ROBOT = "robot"
"""What a log may state beside: the robot, links and load, that it is of."""


@final
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
    folder: Path = Path()
    """Where the file is: robots of logs are named from there."""

    @classmethod
    def read(cls, path: Path) -> "ServoFile":
        r"""Return what a file states; raise SettingError that names what is unknown or wrong in it.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> path = Path(tempfile.mkdtemp()) / "servo.toml"
        >>> _ = path.write_text('model = "STS3215"\nsupply = 12.0\nkp = 16\n')
        >>> ServoFile.read(path).servo("elbow", "log.csv").duty_limit
        0.97
        """
        try:
            stated = tomllib.loads(path.read_text(encoding="utf-8"))
            joints, logs = stated.pop("joints", {}), stated.pop("logs", {})
            made = cls(stated, joints, logs, path.absolute().parent)
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
        if model is not None:
            if model not in PUBLISHED:
                raise SettingError(f"model = {model!r} is unknown{did_you_mean(str(model), PUBLISHED)}; {_published()}")
            stated = {**dict(zip(("gain", "duty_limit", "counts"), PUBLISHED[model], strict=True)), **stated}
        if "gain" not in stated:
            raise SettingError(f"gain is missing: the duty per unit of kp and rad, or a model that has it; {_published()}")
        if unit not in GAIN_UNITS:
            raise SettingError(f"gain_unit = {unit!r} is unknown; known: {', '.join(GAIN_UNITS)}")
        counts = stated.get("counts", Servo.counts)
        stated["gain"] *= GAIN_UNITS[unit] or counts / (2 * np.pi)
        return Servo(**stated)

    def robot(self, log: str) -> str | None:
        """Return the robot that a log is of, if that is stated: its name, or the path of its file."""
        name = self._of_log(log).get(ROBOT)
        return str(self.folder / name) if name and (self.folder / name).exists() else name

    def _of_log(self, log: str) -> dict[str, Any]:
        """Return what is stated of a log; later patterns go before earlier ones."""
        return {key: x for pattern, part in self.logs.items() if fnmatchcase(log, pattern) for key, x in part.items()}


def _require_names(logs: Mapping[str, Mapping[str, Any]]) -> None:
    for pattern, part in logs.items():
        if ROBOT in part and not isinstance(part[ROBOT], str):
            raise IdentificationError(f'[logs."{pattern}"]: robot = {part[ROBOT]!r} must be the name of a robot or of its file')


def _require_known(part: Mapping[str, Any]) -> None:
    for key, value in part.items():
        if key not in KEYS:
            raise IdentificationError(
                f"key {key!r} is unknown{did_you_mean(key, KEYS)}; known: {', '.join(KEYS)}, joints, logs"
            )
        if key not in ("model", "gain_unit") and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise IdentificationError(f"{key} = {value!r} must be a number")


def _published() -> str:
    return f"published: {', '.join(PUBLISHED)}"
