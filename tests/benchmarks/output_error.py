"""The same log by MuJoCo's own identification (`mujoco.sysid`, output error) and by ours.

    uv run --group benchmark python tests/benchmarks/output_error.py

A closed loop at 100 Hz with 16-bit encoders, 46 s. `mujoco.sysid` starts 30 % off, simulates windows of 2 s, and gets torques
as they were held, with two settings: first states from differenced counts, and from positions below 10 Hz with a link of
4 kg that stays physical far from the truth (the mass shows in no torque). Windows of 3 to 5 s end in other minima.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np
import scipy.signal
from mujoco import sysid

from idbench import models
from idbench.identify import (
    Array,
    ExplicitModel,
    GeneralizedLeastSquares,
    MaximumLikelihood,
    MotionLog,
    WeightedLeastSquares,
    identify,
    scara,
)
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.scara import scara_truth
from idbench.sim.scenario.scenario_file import load

STEP, GUESS = 0.002, 0.7


class Setting(NamedTuple):
    """How `mujoco.sysid` is used."""

    window: float
    """Length of a window [s]."""
    mass: float
    """Of link 2 [kg]."""
    cutoff: float | None
    """Of the filter of the first states [Hz]."""


SETTINGS = {"mujoco.sysid": Setting(2.0, 2.0, None), "mujoco.sysid, filtered": Setting(2.0, 4.0, 10.0)}
NAMES = ("ZZR1", "Fv1", "Fs1", "ZZ2", "LMX2", "LMY2", "Fv2", "Fs2")


def body(name: str, ZZ: float, mass: float, offset: tuple[float, float]) -> Callable[[mujoco.MjSpec], None]:
    """Return a change of a link: its inertia about the joint's axis and its centre of mass."""

    def change(spec: mujoco.MjSpec) -> None:
        link, about = spec.body(name), ZZ - mass * (offset[0] ** 2 + offset[1] ** 2)
        link.mass, link.ipos = mass, [*offset, 0.0]
        link.inertia, link.fullinertia, link.iquat = [0.7 * about, 0.7 * about, about], [np.nan] * 6, [1, 0, 0, 0]

    return change


def apply(spec: mujoco.MjSpec, X: dict[str, float], mass: float) -> None:
    """Write eight parameters into a SCARA: L = 0.5 m, link 1 with its centre of mass on its axis."""
    body("link1", X["ZZR1"] - 0.25 * mass, 1.0, (0.0, 0.0))(spec)
    body("link2", X["ZZ2"], mass, (2 * X["LMX2"] / mass, 2 * X["LMY2"] / mass))(spec)
    for j in (1, 2):
        joint = spec.joint(f"joint{j}")
        joint.armature, joint.frictionloss = 0.0, X[f"Fs{j}"]
        joint.damping = [X[f"Fv{j}"], 0.0, 0.0]
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE  # a wrong guess runs into the stops, where nothing can be learnt


def start() -> mujoco.MjSpec:
    """Return the SCARA with plain motors."""
    spec = mujoco.MjSpec.from_file(str(models.path("scara")))
    spec.option.timestep, spec.option.integrator = STEP, mujoco.mjtIntegrator.mjINT_RK4
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for j in (1, 2):
        spec.add_actuator(name=f"motor{j}", target=f"joint{j}", trntype=mujoco.mjtTrn.mjTRN_JOINT).set_to_motor()
    return spec


def output_error(log: MotionLog, truth: dict[str, float], setting: Setting) -> Array:
    """Return what mujoco.sysid makes of the log."""
    spec, now = start(), {}
    parameters = sysid.ParameterDict()
    for name in NAMES:
        value = GUESS * truth[name]

        def change(changed: mujoco.MjSpec, parameter: sysid.Parameter, name: str = name) -> None:
            now[name] = float(parameter.value[0])
            if len(now) == len(NAMES):
                apply(changed, now, setting.mass)

        parameters.add(sysid.Parameter(name, value, 0.1 * truth[name], 3 * truth[name], modifier=change))
    now.update({name: GUESS * truth[name] for name in NAMES})
    apply(spec, now, setting.mass)
    model, held, count = spec.compile(), round(1 / log.fs / STEP), round(setting.window * log.fs)
    q = log.q if setting.cutoff is None else filtered(log.q, setting.cutoff, log.fs)
    velocity, windows = np.gradient(q, 1 / log.fs, axis=0), []
    for k, first in enumerate(range(0, log.samples - count, count)):
        fine = np.repeat(log.tau[first : first + count], held, axis=0)
        windows.append(
            sysid.ModelSequences(
                "scara",
                spec,
                f"window{k}",
                sysid.create_initial_state(model, q[first], velocity[first]),
                sysid.TimeSeries.from_control_names(np.arange(len(fine)) * STEP, fine, model),
                sysid.TimeSeries.from_names(np.arange(count) / log.fs, log.q[first : first + count], model),
            )
        )
    found, _ = sysid.optimize(parameters, sysid.build_residual_fn(models_sequences=windows), verbose=False)
    return np.array([float(found[name].value[0]) for name in NAMES])


def main() -> None:
    """Print errors [%] and times side by side."""
    run = simulate(replace(load("ideal"), encoder=IncrementalEncoder(lines=2**14)))
    log, truth = run.alone(), scara_truth(run.robots[0])
    true = np.array(list(truth.values()))
    estimators = {"WLS": WeightedLeastSquares(), "GLS": GeneralizedLeastSquares(), "ML": MaximumLikelihood()}
    ways = {f"explicit, {name}": timed(lambda e=each: identify(log, scara(), ExplicitModel(), estimator=e).X)
            for name, each in estimators.items()}  # fmt: skip
    for name, setting in SETTINGS.items():
        ways[name] = timed(lambda s=setting: output_error(log, truth, s))
    print(f"{'error [%]':22} {'  '.join(f'{name:>8}' for name in truth)}")
    for name, (X, seconds) in ways.items():
        print(f"{name:22} {'  '.join(f'{error:+8.4f}' for error in 100 * (X - true) / true)}  {seconds:8.3f} s")


def filtered(q: Array, cutoff: float, fs: float) -> Array:
    """Return positions, shape (time, joint), below a frequency [Hz], without delay."""
    b, a = scipy.signal.butter(4, cutoff, fs=fs)
    return np.asarray(scipy.signal.filtfilt(b, a, q, axis=0))


def timed(solve: Callable[[], Array]) -> tuple[Array, float]:
    """Return a solution, and how long it took [s]."""
    begin = time.perf_counter()
    return solve(), time.perf_counter() - begin


if __name__ == "__main__":
    main()
