"""Parameters of BAM (arXiv 2410.08650), which MuJoCo Warp, mjlab and Isaac Lab load: written, and read as a device."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.identify.errors import require_not_negative, require_positive
from idbench.identify.servo import SERVO_FRICTIONS, Servo, ServoFit
from idbench.identify.servo.law import PUBLISHED
from idbench.identify.servo.parameters import LATEST, SERVO_PARAMETERS, ServoLaw

BAM = {
    "armature": "Ia", "friction_base": "Fs", "friction_viscous": "Fv", "friction_stribeck": "Fst", "dtheta_stribeck": "vs",
    "load_friction_base": "Fl", "load_friction_stribeck": "Fls", "load_friction_motor": "Flm", "load_friction_external": "Fle",
    "command_delay": "delay", "max_velocity": "rate",
}  # fmt: skip
"""Its names -> letters; kt = b / a and R = b / a^2 are behind the gear there, too."""

LAWS = {"m1": "coulomb", "m2": "stribeck", "m3": "load", "m4": "load-stribeck", "m5": "directional", "m6": "directional"}

NONE = {"load_friction_motor_stribeck": 0.0, "load_friction_external_stribeck": 0.0, "alpha": 1.0}
"""What its laws have beyond ours, and the values at which they are ours."""

MOTOR = "kt", "R", "armature"
RIG = "q_offset", *MOTOR, "error_gain_ratio"  # Read otherwise, or of the bench that it was measured on


def bam_of(fit: ServoFit, model: str) -> tuple[str, list[str]]:
    """Servo as JSON of BAM, and the letters that it leaves out; ExperimentError if BAM has no such servo."""
    p, laws = ServoLaw(**fit.p)._asdict(), {law: name for name, law in reversed(LAWS.items())}
    if fit.friction not in laws or fit.servo.kind != Servo.kind or not model or min(p["a"], p["b"]) <= 0:
        raise ExperimentError(
            f"BAM has DC motors, of a model that servo.toml names, with friction {', '.join(laws)}; this is a loop of "
            f"{fit.servo.kind}, model {model or 'not stated'}, with friction {fit.friction}, b = {p['b']:.3g}"
        )
    found = {name: float(p[letter]) for name, letter in BAM.items() if np.isfinite(p[letter])}
    motor = {"kt": p["b"] / p["a"], "R": p["b"] / p["a"] ** 2, "error_gain_ratio": 1 + p["gain_error"]}
    named = {"model": laws[fit.friction], "actuator": model.lower().replace("-", "")}
    lost = [x for x in fit.p if x not in ("a", "b", "gain_error", "offset", *BAM.values()) and fit.p[x]]
    return json.dumps(named | motor | found | NONE, indent=1, allow_nan=False) + "\n", lost


def device_of_bam(path: Path) -> dict[str, Any]:
    """Device of a published file; ExperimentError if it is none, or of a motor without kt and R."""
    try:
        given = json.loads(path.read_text(encoding="utf-8"))
        if given.get("model") not in LAWS or [name for name in MOTOR if name not in given]:
            raise ValueError(f"model must be one of {', '.join(LAWS)}, of a motor with {', '.join(MOTOR)}")
        numbers = {name: float(x) for name, x in given.items() if isinstance(x, int | float) or name in (*BAM, *NONE, *RIG)}
        require_positive(**{name: numbers.get(name, 1.0) for name in (*MOTOR, "max_velocity", "error_gain_ratio")})
        require_not_negative(**{name: x for name, x in numbers.items() if name != "q_offset"})
        if (delay := numbers.get("command_delay", 0.0)) > LATEST:
            raise ValueError(f"command_delay = {delay:g} s is longer than {LATEST:g} s")
    except (OSError, ValueError, TypeError, AttributeError, OverflowError) as error:
        raise ExperimentError(f"{path} is no parameter file of BAM: {error}") from error
    a, law = numbers["kt"] / numbers["R"], LAWS[given["model"]]
    own = {"Ia", "Fs", "Fv", "delay", "rate", *SERVO_FRICTIONS[law]}
    values = {"a": a, "b": numbers["kt"] * a, "Fs": 0.0, "Fv": 0.0, "delay": 0.0}
    values |= {letter: numbers[name] for name, letter in BAM.items() if name in numbers and letter in own}
    units = {x: parameter.unit for x, parameter in SERVO_PARAMETERS.items() if x in values}
    published = {name.lower().replace("-", ""): name for name in PUBLISHED}.get(given.get("actuator"))
    gain = numbers.get("error_gain_ratio", 1.0) * (PUBLISHED[published].gain if published else 1.0)
    return {
        "name": path.stem,
        "source": f"{path}, BAM {given['model']} of {given.get('actuator')}",
        "known": {"model": published, "gain": gain} if published else {},
        "friction": law,
        "parameters": {x: {"value": values[x], "sigma": None, "spread": None, "unit": unit} for x, unit in units.items()},
        "beyond": {name: x for name, x in numbers.items() if name not in (*BAM, *RIG) and x and x != NONE.get(name)},
    }


def require_drive(device: Mapping[str, Any]) -> None:
    """Raise ExperimentError if a file of a device lacks what its torques follow from."""
    known, source = device["known"], device["source"]
    if "model" not in known:
        raise ExperimentError(f"{source}: the gain of this actuator is not known; those of {', '.join(PUBLISHED)} are")
    if "supply" not in known:
        raise ExperimentError(f"{source}: BAM does not write the supply: add --supply 7.4, in V, as it was measured with")
