"""The identification of a servo: rows, then the closed loop, law by law and finer from stage to stage."""

from collections.abc import Sequence

from idbench.identify.servo.fit import ServoFit
from idbench.identify.servo.friction import simpler
from idbench.identify.servo.parameters import parameters_of
from idbench.identify.servo.run import ServoRun
from idbench.identify.servo.servo import Servo
from idbench.identify.servo.stages import Stages


def identify_servo(
    servo: Servo,
    runs: Sequence[ServoRun],
    friction: str = "load",
    more: Sequence[str] = (),
    held: dict[str, float] | None = None,
) -> ServoFit:
    """Return the parameters of a servo, from commands and positions alone.

    Rows that are linear in all but delay and rate limit make the start (`ServoRows`); the closed loop, simulated from the
    commands, is then fitted to the positions (`Search`): with the simpler laws of friction first, each the start of the next.

    Parameters
    ----------
    servo : Servo
        What is known.
    runs : sequence of ServoRun
        What was logged, with known loads.
    friction : str
        A law of `SERVO_FRICTIONS`.
    more : sequence of str
        Further parameters to be found, of `FURTHER`.
    held : dict of str to float, optional
        Parameters that are known, by their letters.

    Raises
    ------
    IdentificationError
        If nothing moves, torque is never on, duty always at its limit, or commands cannot explain the motion.
    SettingError
        If a name is unknown.
    """
    parameters_of(friction, (*more, *(held or {})))
    stages = Stages.begun(servo, runs, more, held or {})
    p = stages.start
    for law in simpler(friction):
        p = stages.go(law, (), p)
    return stages.fit(friction, more, stages.go(friction, more, p))


def identify_again(fit: ServoFit, runs: Sequence[ServoRun]) -> ServoFit:
    """Return the fit of the same parameters, from where it is, to runs whose loads are known better.

    Raises
    ------
    IdentificationError
        As for `identify_servo`.
    """
    held = {name: x for name, x in fit.p.items() if name not in fit.free}
    return Stages(fit.servo, runs, held, fit.p).last(fit.friction, fit.free, fit.p)
