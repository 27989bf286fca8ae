"""The compiled loop against the same loop in NumPy, where it stops for Python, and how errors of MuJoCo end in it."""

import re
from ctypes import c_double, c_void_p
from dataclasses import replace
from importlib.resources import files

import mujoco
import numpy as np
import pytest
from numpy_engine import simulated

from idbench import models
from idbench.identify.compiled import function, library, pointer
from idbench.identify.errors import IdentificationError
from idbench.identify.servo.parameters import ServoLaw
from idbench.sim.controllers import PID, AbstractController, AbstractLaw, ComputedTorque
from idbench.sim.drives import AveragedDrive, SwitchedDrive
from idbench.sim.drives.drive import AbstractAmplifier, AbstractDrive
from idbench.sim.encoders import AbstractEncoder, AbstractReader, IncrementalEncoder
from idbench.sim.engine import loop
from idbench.sim.engine.simulation import simulate
from idbench.sim.engine.watch import Watch
from idbench.sim.frictions import Asymmetric, Dahl, Law, LoadDependent, LuGre, Stribeck, Warming
from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.part import Part
from idbench.sim.scenario.measurement import Ripple, TorqueMeasurement
from idbench.sim.scenario.scenario import Physics, Timing
from idbench.sim.scenario.scenario_file import load, names
from idbench.sim.settings import settings
from idbench.sim.trajectories import Quintic

STRUCTURES = {"Series": loop.LoopRipple, "Body": loop.LoopBody, "Loop": loop.Loop}

BUSY = IncrementalEncoder(lines=2000, noise=1e-4, missed_counts=1.0, interpolation_error=0.01)
MOVE = Quintic(((0.0, 0.0), (0.6, -0.5), (0.0, 0.2)), (0.4, 0.4), 0.1)
CASES = {
    "jitter": {"timing": Timing(delay=0.0034, jitter=0.001), "encoder": BUSY},
    "refresh": {"timing": Timing(delay=0.0134, jitter=0.001, refresh=0.0075), "encoder": BUSY},
    "current": {"torque": TorqueMeasurement(source="current", cutoff=200.0), "drive": AveragedDrive()},
    "PID": {"controller": PID(), "encoder": BUSY},
    "computed torque": {"controller": ComputedTorque(model_error=0.1), "timing": Timing(delay=0.0034)},
    "ripple": {"drive": AveragedDrive(), "ripple": Ripple(1.0, (1.0, 0.3), 0.02), "physics": Physics(step=2.5e-4)},
    "saturation": {"drive": AveragedDrive(bus_voltage=60.0, current_limit=(6.0, 3.0))},
    "switched": {"drive": SwitchedDrive(), "ripple": Ripple(cogging=1.0, commutation=0.02)},
    "bipolar": {"drive": SwitchedDrive(modulation="bipolar"), "timing": Timing(delay=0.0031)},
    "sign": {"drive": SwitchedDrive(modulation="sign_magnitude", bus_voltage=60.0), "friction": Stribeck()},
    "asymmetric": {"friction": Asymmetric(offset=0.1, difference=(0.01, 0.02))},
    "load": {"friction": LoadDependent(), "drive": AveragedDrive()},
    "warming": {"friction": Warming(time=2.0)},
    "lugre": {"friction": LuGre()},
    "dahl": {"friction": Dahl()},
}
"""What no shipped scenario has, or not alone."""

SERVOS = {
    "rotor": {"sensed": "rotor", "backlash": (0.0175,)},
    "link": {"backlash": (0.0175,)},
    "profile": {"acceleration": 30.0, "lead": 0.01, "dead_band": 0.01},
    "shorted": {"off": ((2.0, 2.6),), "winding": "shorted", "current_limit": 1.5},
}


def assert_same(scenario, seed=3, length=np.inf):
    """libm and NumPy differ by a bit in exp, tanh and sin; a motion multiplies that by no more than 1e4 here, encoders none.

    A count more or less would be 8e-5 rad or more.
    """
    run, other = simulate(scenario, (seed,)), simulated(scenario, seed, length)
    found = {"measured": run.log.q, "command": run.command, "q": run.q, "qd": run.qd, "tau": run.tau}
    if scenario.torque.source == "current" and not scenario.torque.noise[0]:
        found["current"] = run.log.tau
    for name, values in found.items():
        expected = other[name]
        atol = 1e-9 * max(np.abs(expected).max(), 1.0)
        np.testing.assert_allclose(values[0, : len(expected)], expected, rtol=0, atol=atol, err_msg=name)


@pytest.mark.parametrize("case", CASES)
def test_the_loop_is_that_of_numpy(short, case):
    assert_same(replace(short, **{"trajectory": MOVE} | CASES[case]))


@pytest.mark.parametrize("case", SERVOS)
def test_servos_are_those_of_numpy(case):
    base = load("servo")
    assert_same(replace(base, drive=replace(base.drive, **SERVOS[case]), trajectory=replace(base.trajectory, steps=3)))


@pytest.mark.thorough
@pytest.mark.parametrize("name", names())
def test_every_scenario_is_that_of_numpy(name):
    assert_same(replace(load(name), start=(), fault=(), severity=1.0), length=2.0)


class OwnLaw(AbstractLaw):
    def __init__(self, made):
        self.made = made

    def command(self, k, q):
        return self.made.command(k, q)


class OwnReader(AbstractReader):
    def __init__(self, made):
        self.made = made

    def read(self, k, q):
        return self.made.read(k, q)


class OwnContact(AbstractContact):
    def __init__(self, made):
        self.made = made

    def driven(self, tau):
        self.made.driven(tau)

    def torque(self, qd):
        return self.made.torque(qd)


class OwnAmplifier(AbstractAmplifier):
    def __init__(self, made):
        self.made = made

    def sees(self, q):
        self.made.sees(q)

    def step(self, demand, speed, steps):
        tau = self.made.step(demand, speed, steps)
        self.trace = self.made.trace
        return tau

    def electric(self, trace, dt):
        return self.made.electric(trace, dt)


@settings
class OwnController(AbstractController):
    """The product's, in Python."""

    def start(self, task):
        return OwnLaw(ComputedTorque().start(task))


@settings
class OwnEncoder(AbstractEncoder):
    """The product's, in Python."""

    def start(self, n, samples, fs, rngs):
        return OwnReader(BUSY.start(n, samples, fs, rngs))


@settings
class OwnDrive(AbstractDrive):
    """The product's, in Python."""

    def start(self, robot, nsim, h):
        return OwnAmplifier(SwitchedDrive().start(robot, nsim, h))

    def lag(self, robot):
        return SwitchedDrive().lag(robot)

    def step_length(self, fs, longest):
        return SwitchedDrive().step_length(fs, longest)


@settings
class OwnFriction(AbstractFrictionLaw):
    """The product's, in Python."""

    def start(self, plant, Fs, h):
        return OwnContact(Stribeck().start(plant, Fs, h))


NATIVE = {"controller": ComputedTorque(), "encoder": BUSY, "drive": SwitchedDrive(), "friction": Stribeck()}
OWN = {"controller": OwnController(), "encoder": OwnEncoder(), "drive": OwnDrive(), "friction": OwnFriction()}


@pytest.mark.parametrize("parts", [*([name] for name in OWN), list(OWN)], ids=[*OWN, "all"])
@pytest.mark.parametrize("threads", [1, 2])
def test_parts_in_python_give_the_same_bits(short, parts, threads):
    """The loop stops for them, in all simulations at the same place; a view has the same signals."""
    base = replace(short, trajectory=MOVE, ripple=Ripple(1.0, (1.0,), 0.02), timing=Timing(delay=0.0034), **NATIVE)
    heard, other = [], []
    watches = [Watch(receive, 0.13, (0.3, 0.5)) for receive in (heard.append, other.append)]
    native = simulate(base, (3, 4, 5), watch=watches[0])
    own = simulate(replace(base, **{x: OWN[x] for x in parts}), (3, 4, 5), threads=threads, watch=watches[1])
    for name in ("q", "qd", "tau", "command"):
        np.testing.assert_array_equal(getattr(own, name), getattr(native, name))
    np.testing.assert_array_equal(own.log.q, native.log.q)
    for a, b in zip(heard, other, strict=True):
        np.testing.assert_array_equal(b.measured, a.measured)
        np.testing.assert_array_equal(b.electric, a.electric)
        assert (a.inner is None) == (b.inner is None)
        if a.inner is not None:
            np.testing.assert_array_equal(b.inner.tau, a.inner.tau)


def test_a_law_of_identification_resists_as_its_twin_in_c(short):
    """Stribeck's law, by its formula in NumPy that sets MuJoCo's friction in Python, and as C."""
    base = replace(short, trajectory=MOVE)
    twin = Law("stribeck", size=(0.25, 0.05), settings={"vs": 0.1})
    native, own = simulate(replace(base, friction=Stribeck(static=1.5))), simulate(replace(base, friction=twin))
    np.testing.assert_allclose(own.command, native.command, atol=1e-9 * 60)


def test_an_error_of_mujoco_ends_its_simulation_alone(short, monkeypatch, capfd):
    """The second of three has no memory for its constraints: MuJoCo raises, which would end the process."""
    alone = simulate(short, (7,))
    spec = mujoco.MjSpec.from_file(str(models.path("scara")))
    spec.memory = 1024
    small, made, calls = spec.compile(), mujoco.MjData, []

    def data(model):
        calls.append(model)
        return made(small if len(calls) == 2 else model)

    monkeypatch.setattr(mujoco, "MjData", data)
    run = simulate(short, (3, 5, 7), throw=False)
    assert run.failures.keys() == {1}
    assert run.failures[1].startswith("MuJoCo cannot go on: ")
    assert run.failures[1].endswith("(seed 5)")
    assert capfd.readouterr() == ("", "")
    np.testing.assert_array_equal(run.log.tau[2], alone.log.tau[0])


def test_without_compiled_code_the_way_out_is_told(monkeypatch, tmp_path):
    import idbench

    monkeypatch.setattr(idbench, "__file__", str(tmp_path / "__init__.py"))
    library.cache_clear()
    try:
        with pytest.raises(IdentificationError, match=r"no compiled code for this platform .* install it from its sources"):
            library()
    finally:
        monkeypatch.undo()
        library.cache_clear()


def fields(text, name):
    """Names in a structure of C, in their order."""
    body = re.search(r"typedef struct \{([^{}]*)\} " + name + ";", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL))[1]
    body = re.sub(r"void \(\*(\w+)\)\([^)]*\)", r"void \1", body)
    each = (re.sub(r"^\s*(const )?\w+ ", "", line) for line in body.split(";"))
    return [name.strip(" *\n") for line in each for name in line.split(",") if name.strip()]


@pytest.mark.parametrize(
    ("path", "name", "expected"),
    [
        ("identify/servo/servo.c", "Law", ServoLaw._fields),
        ("sim/part.h", "Part", [name for name, _ in Part._fields_]),
        *[("sim/engine/loop.c", name, [x for x, _ in kind._fields_]) for name, kind in STRUCTURES.items()],
    ],
    ids=["Law", "Part", *STRUCTURES],
)
def test_structures_are_in_the_order_of_c(root, path, name, expected):
    assert [x.partition("[")[0] for x in fields((root / path).read_text(), name)] == list(expected)


def test_places_are_in_the_order_of_c(root):
    """Of every list of names in loop.c of which Python has one."""
    text = re.sub(r"/\*.*?\*/", "", (root / "sim/engine/loop.c").read_text(), flags=re.DOTALL)
    lists = [[x.strip() for x in names.split(",")] for names in re.findall(r"enum \{([^}=]*)\}", text)]
    assert [f"OUT_{x.upper()}" for x in loop.CHANNELS] in lists
    places = {name: k for names in lists for k, name in enumerate(names) if hasattr(loop, name)}
    assert len(places) == 34
    assert {name: getattr(loop, name) for name in places} == places


def test_the_written_friction_of_a_servo_is_that_of_c(rng):
    """Python that goes to users, every term."""
    p = ServoLaw(*rng.uniform(0.1, 1.0, len(ServoLaw._fields)))
    text = files("idbench.experiments.exports").joinpath("servo.py.txt").read_text(encoding="utf-8")
    written = {}
    exec(text.replace("$servos", repr({"hip": {k: float(x) for k, x in p._asdict().items()}})), written)
    servo = written["Servo"]("hip", 1e-3)
    in_c = function("servo_friction", c_void_p, *[c_double] * 4, result=c_double)
    for speed, motor, external, sent in rng.uniform(-2, 2, (20, 4)).tolist():
        expected = in_c(pointer(np.array(p)), speed, motor, external, sent)
        assert servo.friction(speed, motor, external, sent) == pytest.approx(expected, rel=1e-12)
