"""Identified servos as a robot's MJCF file, and what plain MuJoCo makes of it."""

from pathlib import Path

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.servo.identification import Servos
from idbench.identify.servo import ServoFit
from idbench.sim.robot.servos import Commands, ServoValues, replay, with_servos


def values_of(servos: Servos, fit: ServoFit, joint: str) -> ServoValues:
    """Return a servo as MuJoCo has it, with the firmware gain of the file."""
    p, servo = fit.p, servos.known.servo(joint, "")
    known = servo.gain * servo.kp, servo.supply, servo.duty_limit
    rate, play = p.get("rate", np.inf), p.get("backlash", 0.0)
    return ServoValues(p["a"], p["b"], *known, p["Ia"], p["Fv"], p["Fs"], rate, p["delay"], play)


def mjcf_of(servos: Servos, fits: dict[str, ServoFit], folder: Path, position: bool = False) -> str:
    """Return the robot's MJCF with the servos that were found."""
    place = {servos.place(joint): values_of(servos, fit, joint) for joint, fit in fits.items()}
    return with_servos(servos.robot, place, folder, servos.mounting, position)


def in_mujoco(servos: Servos, text: str, folder: Path, fits: dict[str, ServoFit], path: Path) -> dict[str, float]:
    """Return the mean absolute error [rad] of each joint, a log's commands given to the written file in plain MuJoCo."""
    columns, known = servos.logs[path], servos.known
    places = [servos.place(joint) for joint in fits]
    offset = np.zeros(servos.links.n)
    offset[places] = [fit.p["offset"] for fit in fits.values()]
    if any(known.servo(joint, path.name).kp != known.servo(joint, "").kp for joint in fits):
        raise ExperimentError(f"{path.name} has another kp than the file that was written")
    if servos.links_of(path) is not servos.links:
        raise ExperimentError(f"{path.name} is of another robot than the file that was written")
    on = None if columns.on is None else columns.on[:, places] > 0.5
    sent = Commands(columns.t, (columns.command + offset)[:, places], places, on)
    q = replay(servos.robot, text, folder, sent, columns.q[0] + offset)
    error = np.abs(q - columns.q - offset).mean(axis=0)
    return {joint: float(error[j]) for joint, j in zip(fits, places, strict=True)}
