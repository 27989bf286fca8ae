"""What runs of a servo can show, and what they cannot."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from idbench.identify.errors import ExcitationError, IdentificationError
from idbench.identify.servo.run import ServoRun

TILTS = 0.01  # Share of gravity that turns with the joint, of its typical torque, from which on an offset of the position shows
TYPICAL = 0.1  # Share of what a loop commands that a joint needs which carries nothing
NOTHING = 1e-6  # Share of what a loop commands that no known load makes: rounding of the robot's file
SCALES = ("a", "b", "Ia", "Fs", "Fv")  # Parameters of which one that is known sets the scale of torques
DEGREES = 20.0  # Times the range of the positions from which on commands are in another unit


@dataclass(frozen=True)
class Excitation:
    """Sizes of the motion of some runs."""

    range: float
    """Of positions [rad]."""
    speed: float
    """Largest, but for 1 % of the samples [rad/s]."""
    torque: float
    """Root mean square of the torque of the load [N m]."""
    T: float
    """Sampling time [s]."""
    step: float
    """Of the encoder [rad]."""
    off: bool
    """Whether torque is off in some motion: friction then shows apart from back-EMF."""
    tilts: bool
    """Whether gravity depends on the position: only then does an offset show."""
    loaded: bool
    """Whether anything known sets the scale of torques."""

    @classmethod
    def of(cls, runs: Sequence[ServoRun], held: Mapping[str, float]) -> Self:
        """Excitation of runs, given known parameters; raise IdentificationError if they show nothing."""
        if not runs:
            raise IdentificationError("there is no run of the servo")
        ranges = [float(np.ptp(run.clean)) for run in runs]
        if max(ranges) < 20 * max(run.step for run in runs):
            raise ExcitationError(
                f"{runs[0].name}: the joint does not move (by {np.rad2deg(max(ranges)):.2g} deg): log motions of a good part "
                "of its range, with steps and reversals"
            )
        name = runs[0].name
        if not any(run.enabled.any() for run in runs):
            raise ExcitationError(f"{name}: torque is off all the time: friction and armature may swing, a and b need torque")
        if wrong := [run for run in runs if np.ptp(run.command) > DEGREES * max(ranges)]:
            spans = f"the command spans {np.ptp(wrong[0].command):.4g}, the position {np.ptp(wrong[0].clean):.4g} rad"
            raise IdentificationError(
                f"{wrong[0].name}: {spans}: is the command in degrees or counts? State its unit: --units command=deg"
            )
        duties = (run.servo.slope * np.abs(run.command - run.clean)[run.enabled] >= run.servo.limit for run in runs)
        if all(duty.size and np.mean(duty) > 0.98 for duty in duties):
            raise ExcitationError(
                f"{runs[0].name}: the duty is at its limit almost all the time, where the command has no effect: command "
                "slower motions, or smaller steps"
            )
        speeds = np.concatenate([np.abs(np.gradient(run.clean, run.t)) for run in runs])
        # A load that moves with the joint sets the scale of torque; where there is none, what its inertia would need.
        loads = [float(np.sqrt(np.mean(run.load.torque(run.t, run.clean) ** 2))) for run in runs]
        inertia = max(float(np.mean(run.load.inertia)) for run in runs)
        T = float(np.median([run.T for run in runs]))
        speed = float(np.quantile(speeds, 0.99))
        torque = max(float(np.sqrt(np.mean(np.square(loads)))), (inertia + held.get("Ia", 0.0)) * speed / (50 * T))
        # Root mean square of what the loop commands for the error of the position.
        commanded = [run.servo.slope * float(np.sqrt(np.mean((run.command - run.clean) ** 2))) for run in runs]
        driven = max(run.servo.supply * min(run.servo.limit, x) for run, x in zip(runs, commanded, strict=True))
        torque = max(torque, TYPICAL * held.get("a", 0.0) * driven, held.get("b", 0.0) * speed, held.get("Fs", 0.0))
        loaded = torque > 0 and (torque > NOTHING * driven or any(name in held for name in SCALES))
        if not loaded:  # ratios show, of torques that are then those of a = 1
            torque = TYPICAL * driven
        off = any((~run.enabled).any() and np.ptp(run.clean[~run.enabled]) > 20 * run.step for run in runs)
        swing = max(float(np.hypot(run.load.sine, run.load.cosine).max()) for run in runs)
        return cls(max(ranges), speed, torque, T, max(run.still for run in runs), off, swing > TILTS * torque, loaded)

    @property
    def scales(self) -> dict[str, float]:
        """Typical sizes, by what `ServoParameter.of` names."""
        rates = {"speed": self.speed, "torque per speed": self.torque / self.speed}
        return {"torque": self.torque, "angle": self.step, "time": self.T, "1": 1.0, **rates}
