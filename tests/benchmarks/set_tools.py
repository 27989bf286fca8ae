"""Torques that other tools predict for held-out logs, judged as ours are."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from zipfile import BadZipFile

import numpy as np
from scipy.interpolate import CubicSpline

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.held_out import HeldOut
from idbench.experiments.note import Note
from idbench.experiments.results.writing import finite
from idbench.identify import Array, MotionLog, Problem, TorqueChannel, validate
from idbench.identify.arrays import combined
from idbench.identify.rows.rows import manageable
from idbench.sim.robot.tree import standard_parameters
from idbench.sim.robot.urdf import parsed
from idbench.sim.robot.written_xml import urdf_text


def what_tools_read(fit: Fit) -> dict[str, Any]:
    """What other tools need to know beside logs and URDF."""
    return {
        "robot": "robot.urdf",
        "joints": list(fit.robot_model.robot.joints),
        "gravity": [float(x) for x in fit.robot_model.tree.gravity],
        "fit": [f"fit{k + 1}.npz" for k in range(len(fit.logs.fitted))],
        "held_out": [f"held_out{k + 1}.npz" for k in range(len(fit.logs.held_out or {}))],
        "couplings": [list(map(float, coupling.weights)) for coupling in fit.robot_model.tree.couplings],
        "rotors": fit.robot_model.asked.armature != "none",
        "cutoff": getattr(fit.processing.operator, "cutoff", None),
    }


def write_for_tools(fit: Fit, delay_told: bool, folder: Path) -> None:
    """Write logs, with torques at the instants when they act if `delay_told`, and the robot."""
    told = fit.logs.fitted if delay_told else [_undelayed(log) for log in fit.logs.fitted]
    for k, log in enumerate(told):
        _write_arrays(folder / f"fit{k + 1}.npz", prepared(log))
    for k, log in enumerate((fit.logs.held_out or {}).values()):
        held_out = HeldOut(fit, manageable([log])[0], Note(""))
        _write_arrays(folder / f"held_out{k + 1}.npz", {**prepared(held_out.log), "idbench": own_torques(held_out)})
    robot_model = fit.robot_model
    text = urdf_text(
        robot_model.name, robot_model.robot, robot_model.tree, standard_parameters(robot_model.robot), robot_model.mounting
    )
    (folder / "robot.urdf").write_text(_without_shapes(text), encoding="utf-8")


def _write_arrays(path: Path, arrays: dict[str, Array]) -> None:
    with path.open("wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]


def _undelayed(log: MotionLog) -> MotionLog:
    """Return a log as if its torques had no delay."""
    return replace(log, torque=replace(log.torque, delay=0.0))


def _without_shapes(urdf: str) -> str:
    """Return a URDF without meshes: they are elsewhere, and some tools refuse a robot whose meshes are missing."""
    root, _ = parsed(urdf)
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def acting(torque: TorqueChannel, fs: float) -> float:
    """Return how much later than its sample a torque acts, on average [s]."""
    return torque.delay + (0.0 if torque.meaning == "instantaneous" else 0.5 / fs)


def prepared(log: MotionLog) -> dict[str, Array]:
    """Return a log for other tools: times [s], positions [rad], and the torques that act then [N m], gains included."""
    tau = log.tau * np.asarray(log.torque.gain)
    return {"t": log.t, "q": log.q, "tau": at_times(log.t, log.t + acting(log.torque, log.fs), tau)}


def own_torques(held_out: HeldOut) -> Array:
    """Return the torques that our own fit predicts at the samples of a log, shape (time, joint) [N m]."""
    fit, state = held_out.fit, held_out.problem.chain.signals(held_out.log).state
    X = fit.estimates[fit.leading].X
    return combined(fit.basis.explicit(state), X, np.zeros(state.q.shape)).T


def at_times(t: Array, times: Array, tau: Array) -> Array:
    """Return torques at other times; straight lines between samples would be low-passes, twice."""
    return np.asarray(CubicSpline(times, tau)(np.clip(t, times[0], times[-1])))


PREDICTED = "predicted-*.npz"  # Names of the files of other tools, in the folder of a set's results


@dataclass(frozen=True)
class Predicted:
    """What a tool has predicted."""

    torques: tuple[Array, ...]
    """Torques at the samples of each held-out log [N m], shape (time, joint)."""
    seconds: float
    """How long its fit took."""
    note: str
    """Its settings, and what else is to be known."""


def predictions(folder: Path) -> dict[str, Path]:
    """Return the files that tools have left in the folder of a set's results, by the names of the tools.

    A file `predicted-TOOL.npz` has `held_out1`, `held_out2`, ..., and `seconds` and `note` if it has them.
    """
    return {path.stem.partition("-")[2]: path for path in sorted(folder.glob(PREDICTED))}


def _read(path: Path, count: int) -> Predicted:
    """Return what a tool has predicted; raise ExperimentError if its file does not have it."""
    try:
        with np.load(path) as file:
            torques = tuple(np.asarray(file[f"held_out{k + 1}"], dtype=float) for k in range(count))
            seconds = float(file["seconds"]) if "seconds" in file else float("nan")
            return Predicted(torques, seconds, str(file["note"]) if "note" in file else "")
    except (OSError, KeyError, ValueError, TypeError, EOFError, BadZipFile) as error:
        names = " and ".join(dict.fromkeys(("held_out1", f"held_out{count}")))
        raise ExperimentError(f"{path.name} must have {names}, torques of each log: {error}") from error


def judged(held_out: Sequence[HeldOut], path: Path) -> dict[str, Any]:
    """Return what a summary says of a tool: the residual torque of each log, on the rows on which ours is judged.

    Raises
    ------
    ExperimentError
        If its file is none.
    """
    predicted = _read(path, len(held_out))
    return {
        "seconds": finite(predicted.seconds),
        "note": predicted.note,
        "logs": [_judged(one, tau) for one, tau in zip(held_out, predicted.torques, strict=True)],
    }


def _judged(held_out: HeldOut, tau: Array) -> dict[str, Any]:
    log = held_out.log
    if tau.shape != log.tau.shape:
        return {"failure": f"torques of the shape {tau.shape}, of a log of {log.tau.shape}"}
    if not np.isfinite(tau).all():
        return {"failure": f"{np.count_nonzero(~np.isfinite(tau))} torques are not finite"}
    as_logged = at_times(log.t + acting(log.torque, log.fs), log.t, tau)
    left = replace(log, tau=log.tau * np.asarray(log.torque.gain) - as_logged, torque=replace(log.torque, gain=1.0))
    plain = held_out.fit.robot_model.plain.basis
    problem = Problem((left,), plain, held_out.fit.problem.model, held_out.fit.processing)
    validation = validate(problem, np.zeros(len(plain.names)))
    own = next(iter(held_out.torques.values()))
    R2 = 1 - (1 - own.R2) * (validation.rms / own.rms) ** 2
    return {"torque_error_rms": [finite(x) for x in validation.rms], "R2": [finite(x) for x in R2]}
