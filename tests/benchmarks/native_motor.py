"""How exact is MuJoCo's own stepping of a `dcmotor`? Mean torque over PWM periods, against the exact winding.

    uv run python tests/benchmarks/native_motor.py

A locked rotor whose bare winding (`input="voltage"`) is switched between the bus voltage and zero, stepped from edge to edge
and with uniform steps; and a turning rotor that a constant voltage accelerates. The exact values are closed forms, or a dense
integration.
"""

import mujoco
import numpy as np
from scipy.integrate import solve_ivp

R, L, K, V, T = 3.0, 0.012, 5.0, 160.0, 2e-4
MODEL = """
<mujoco><option timestep="{h}" integrator="{integrator}"/>
  <worldbody>
    <body><inertial pos="0 0 0" mass="1" diaginertia="{J} {J} {J}"/><joint name="hinge" axis="0 0 1"/></body>
  </worldbody>
  <actuator><dcmotor name="motor" joint="hinge" resistance="3" motorconst="5" inductance="0.012"/></actuator>
</mujoco>"""


def loaded(h: float, integrator: str, J: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a rotor of inertia J [kg m^2] with its motor."""
    model = mujoco.MjModel.from_xml_string(MODEL.format(h=h, integrator=integrator, J=J))
    return model, mujoco.MjData(model)


def pulsed(duty: float, integrator: str) -> float:
    """Return the error of the mean torque over periods that repeat themselves, a step from edge to edge [%]."""
    model, data = loaded(1e-4, integrator, 1e9)
    impulse = 0.0
    for period in range(600):
        for dt, voltage in ((duty * T, V), ((1 - duty) * T, 0.0)):
            model.opt.timestep, data.ctrl[0] = dt, voltage
            mujoco.mj_step(model, data)
            if period >= 500:
                impulse += data.actuator_force[0] * dt
    return 100 * (impulse / (100 * T) / (K * duty * V / R) - 1)


def turning(h: float, integrator: str) -> float:
    """Return the largest error of the current while 20 V accelerate a rotor of 0.05 kg m^2, in % of its peak."""
    model, data = loaded(h, integrator, 0.05)
    data.ctrl[0] = 20.0
    t = np.arange(1, round(0.1 / h) + 1) * h
    found = []
    for _ in t:
        mujoco.mj_step(model, data)
        found.append(data.act[0])
    exact = solve_ivp(
        lambda _, y: [(20 - R * y[0] - K * y[1]) / L, K * y[0] / 0.05], (0, 0.1), [0, 0], t_eval=t, rtol=1e-10, atol=1e-12
    ).y[0]
    if not np.isfinite(found).all():
        return float("inf")
    return 100 * float(np.abs(found - exact).max() / np.abs(exact).max())


def main() -> None:
    """Print both tables."""
    print("mean torque of a locked rotor, a step from PWM edge to PWM edge, error [%]")
    for integrator in ("implicitfast", "Euler"):
        errors = (f"duty {duty:.2f}: {pulsed(duty, integrator):+.2f}" for duty in (0.1, 0.25, 0.5, 0.75, 0.9))
        print(f"  {integrator:13} {'  '.join(errors)}")
    print("current of a turning rotor, largest error in % of its peak")
    for integrator in ("implicitfast", "Euler", "RK4"):
        errors = (f"h = {1e3 * h:g} ms: {turning(h, integrator):.3g}" for h in (1e-3, 5e-4, 1e-4))
        print(f"  {integrator:13} {'  '.join(errors)}")


if __name__ == "__main__":
    main()
