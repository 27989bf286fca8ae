"""Parameters of BAM (arXiv 2410.08650), which MuJoCo Warp, mjlab and Isaac Lab load: written, and read as a device."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.identify.errors import require_positive
from idbench.identify.servo import Servo, ServoFit
from idbench.identify.servo.law import PUBLISHED
from idbench.identify.servo.parameters import SERVO_PARAMETERS, ServoLaw

BAM = {
    "armature": "Ia", "friction_base": "Fs", "friction_viscous": "Fv", "friction_stribeck": "Fst", "dtheta_stribeck": "vs",
    "load_friction_base": "Fl", "load_friction_stribeck": "Fls", "load_friction_motor": "Flm", "load_friction_external": "Fle",
    "command_delay": "delay", "max_velocity": "rate",
}  # fmt: skip
"""Its names -> letters; kt = b / a and R = b / a^2 are behind the gear there, too."""

LAWS = {"m1": "coulomb", "m2": "stribeck", "m3": "load", "m4": "load-stribeck", "m5": "directional", "m6": "directional"}

NONE = {"load_friction_motor_stribeck": 0.0, "load_friction_external_stribeck": 0.0, "alpha": 1.0}
"""What its laws have beyond ours, and the values at which they are ours."""

RIG = "q_offset", "model", "actuator", "kt", "R", "error_gain_ratio"  # Read otherwise, or of the bench that it was measured on


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
    """Device of a published file; ExperimentError if it is none."""
    try:
        given = json.loads(path.read_text(encoding="utf-8"))
        motor = {name: float(given[name]) for name in ("kt", "R", "armature")}
        require_positive(**motor)
        values = {letter: float(given[name]) for name, letter in BAM.items() if given.get(name) is not None}
        law, published = (
            LAWS[given["model"]],
            {name.lower().replace("-", ""): name for name in PUBLISHED}.get(given["actuator"]),
        )
        ratio = float(given.get("error_gain_ratio", 1.0))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        wrong = f"it has no {error}" if isinstance(error, KeyError) else error
        raise ExperimentError(f"{path} is no parameter file of BAM (model, actuator, kt, R, armature ...): {wrong}") from error
    a = motor["kt"] / motor["R"]
    values = {"a": a, "b": motor["kt"] * a} | values | ({"gain_error": ratio - 1} if ratio != 1 else {})
    if impossible := [x for x, value in values.items() if not SERVO_PARAMETERS[x].low <= value < np.inf]:
        raise ExperimentError(f"{path}: {impossible[0]} = {values[impossible[0]]:g} is impossible")
    beyond = {name: x for name, x in given.items() if name not in (*BAM, *RIG) and x and x != NONE.get(name)}
    of = {
        x: {"value": values[x], "sigma": None, "spread": None, "unit": y.unit}
        for x, y in SERVO_PARAMETERS.items()
        if x in values
    }
    known = {"model": published} if published else {}
    about = f"{path}, BAM {given['model']} of {given['actuator']}"
    return {"name": path.stem, "source": about, "known": known, "friction": law, "parameters": of, "beyond": beyond}


def require_drive(device: Mapping[str, Any]) -> None:
    """Raise ExperimentError if a file of a device lacks what its torques follow from."""
    if missing := [key for key in ("model", "supply") if key not in device["known"]]:
        ways = {
            "model": f"the gain of this actuator is not known; those of {', '.join(PUBLISHED)} are",
            "supply": "BAM does not write the supply: add --supply 7.4, in V, as it was measured with",
        }
        raise ExperimentError(f"{device['source']}: {ways[missing[0]]}")
