"""The DC motors of a robot, read from the `dcmotor` elements of its compiled model."""

from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np
import numpy.typing as npt

from idbench.sim.errors import RobotError

Array = npt.NDArray[np.float64]

_SLOTS = {
    "R": ("gain", 0),
    "K": ("gain", 1),
    "V": ("gain", 7),
    "cogging": ("bias", 0),
    "order": ("bias", 1),
    "phase": ("bias", 2),
}
"""Where MuJoCo 4 compiles the attributes of a `dcmotor` to; L/R is the first of its dynamic parameters."""


@dataclass(frozen=True, eq=False)
class Motors:
    """One direct-drive DC motor a joint."""

    R: Array
    """Resistance between the terminals [ohm], shape (joint,)."""
    L: Array
    """Inductance between the terminals [H], shape (joint,)."""
    K: Array
    """Torque constant [N m/A], equal to the back-EMF constant [V s/rad], shape (joint,)."""
    V: Array
    """Bus voltage of the amplifier [V]; infinite where the model gives none, shape (joint,)."""
    I: Array  # noqa: E741  # the letter of a current
    """Largest current [A]; infinite where the model gives none, shape (joint,)."""
    cogging: Array
    """Amplitude of the cogging torque cogging * sin(order * q + phase) [N m], shape (joint,)."""
    order: Array
    """Its cycles per turn, shape (joint,)."""
    phase: Array
    """Its phase [rad], shape (joint,)."""

    @classmethod
    def of(cls, model: mujoco.MjModel) -> Self:
        """Read the motors of a compiled model.

        Raises
        ------
        RobotError
            If a joint has no `dcmotor` of its own with resistance, motor constant and inductance, or it has a gear.
        """
        rows = [cls._row(model, j) for j in range(model.njnt)]
        return cls(**{name: np.array([row[name] for row in rows]) for name in rows[0]})

    @staticmethod
    def _row(model: mujoco.MjModel, joint: int) -> dict[str, float]:
        name = model.joint(joint).name
        kind, trn = int(mujoco.mjtGain.mjGAIN_DCMOTOR), int(mujoco.mjtTrn.mjTRN_JOINT)
        mine = [a for a in range(model.nu) if model.actuator_trntype[a] == trn and model.actuator_trnid[a, 0] == joint]
        if len(mine) != 1 or model.actuator_gaintype[mine[0]] != kind:
            raise RobotError(f"joint {name} has no dcmotor of its own in the MJCF: give it one, or use the drive 'ideal'")
        a = mine[0]
        banks = {"gain": model.actuator_gainprm[a], "bias": model.actuator_biasprm[a]}
        row = {letter: float(banks[bank][slot]) for letter, (bank, slot) in _SLOTS.items()}
        row["L"] = row["R"] * float(model.actuator_dynprm[a, 0])
        if model.actuator_gear[a, 0] != 1 or min(row["R"], row["K"], row["L"]) <= 0:
            raise RobotError(f"the dcmotor of joint {name} needs gear 1 and a resistance, motorconst and inductance above 0")
        row["V"] = row["V"] or np.inf
        row["I"] = model.actuator_forcerange[a].max() / row["K"] if model.actuator_forcelimited[a] else np.inf
        return row
