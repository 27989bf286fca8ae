"""Numbers in the pages that follow from the code: each sentence beside what it is made of."""

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from idbench import models
from idbench.experiments.cli.app import COMMANDS
from idbench.experiments.cli.interruption import INTERRUPTED
from idbench.experiments.excite import limit_use
from idbench.experiments.exports import ensemble
from idbench.experiments.identification import poses
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.judgement.held_out import FAIR, GOOD
from idbench.experiments.judgement.remedies import SURE
from idbench.experiments.judgement.warnings import OPEN, WEAK, WELL_EXPLAINED
from idbench.experiments.loads import known_load
from idbench.experiments.paper import table2
from idbench.experiments.paper.motions import Table1Motions
from idbench.experiments.paper.table1 import PAPER
from idbench.experiments.recording import stream
from idbench.experiments.recording.audience import LOOPBACK
from idbench.experiments.reports import estimates
from idbench.experiments.servo.servo_files import device_of
from idbench.experiments.study import statistics
from idbench.experiments.study.study_file import load_study
from idbench.identify import CHAINS, ESTIMATORS
from idbench.identify.basis.friction import laws
from idbench.identify.data import clock
from idbench.identify.data.kinematics import INERTIAL
from idbench.identify.estimators import leave_out
from idbench.identify.estimators.likelihood import maximum_likelihood
from idbench.identify.judge import (
    delay,
    friction_choice,
    held_out,
    small_mistakes,
    torque_interval,
    used_rows,
    validation,
)
from idbench.identify.loads import drive_gains
from idbench.identify.models import THREE
from idbench.identify.noise import white_noise
from idbench.identify.rows import factors, rows
from idbench.identify.rows.chain import paper_chain
from idbench.identify.rows.operators import FirLowPass, ModulatingFunctions, Windows, low_pass
from idbench.identify.servo import fit as servo_fit
from idbench.identify.servo import mistakes
from idbench.identify.servo.law import PUBLISHED
from idbench.identify.signals import filters, masks, wild_samples
from idbench.identify.signals.prefilters import NoisePrefilter
from idbench.sim.drives import SwitchedDrive
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scara import scara_truth
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import from_dict, load

ROOT = Path(__file__).parent.parent

SMALL = (
    *("none", "one", "two", "three", "four", "five", "six", "seven", "eight"),
    *("nine", "ten", "eleven", "twelve", "thirteen", "fourteen", "fifteen", "sixteen"),
)
PARTS = {"half": 2, "quarter": 4, "fifth": 5, "tenth": 10, "twentieth": 20}
WORDS = {word: float(k) for k, word in enumerate(SMALL)} | {word: 1 / k for word, k in PARTS.items()}
WORDS |= {"twice": 2.0, "million": 1e6}

SCENARIO_ONLY = {"pendulum", "horn", "servo_arm"}
"""Robots that ship as benches of servos."""


def rounded(x: float) -> float:
    """Return a number to two digits, as results are printed."""
    return float(f"{x:.2g}")


def bits(encoder: Any) -> float:
    assert isinstance(encoder, IncrementalEncoder)
    return float(np.log2(encoder.lines[0] * encoder.quadrature))


def duration(scenario: str) -> float:
    """Return how long the motion of a scenario is [s], to 0.1 s."""
    found = load(scenario)
    return round(found.trajectory.plan(Robot.load(found.robot)).duration, 1)


def scenario_of(study: str) -> Scenario:
    return from_dict(load_study(study).scenario)


@cache
def kept(name: str) -> Any:
    """Return results that are kept for the pages."""
    return json.loads((ROOT / "docs" / "results" / f"{name}.json").read_text())


def typicals(study: str, model: str, estimator: str = "GLS", chain: str = "idbench", of: str = "rmse_percent") -> list[float]:
    """Return the typical error [%], or bound, at each value of the axes of a study."""
    cells = [c for c in kept(study) if (c["model"], c["estimator"], c["chain"]) == (model, estimator, chain)]
    return [float(np.exp(np.mean(np.log([x for x in cell[of] if x is not None])))) for cell in cells]


def typical(study: str, model: str, at: float, chain: str = "idbench") -> float:
    """Return the typical error [%] at the value of the only axis."""
    place = [cell["settings"] for cell in kept(study) if (cell["model"], cell["chain"]) == (model, chain)]
    return typicals(study, model, chain=chain)[[next(iter(settings.values())) for settings in place].index(at)]


def ratios(above: str, below: str) -> list[float]:
    """Return the errors of a model over those of another one, from noise to noise, chain and estimator."""
    return [row["ratio"] for row in kept_ratios()["ratios"] if row["models"] == [above, below]]


def kept_ratios() -> Any:
    return json.loads((ROOT / "experiments" / "paper" / "conclusion.json").read_text())


def power_of_encoders() -> list[float]:
    """Return errors of the power model over those of the explicit one, from encoder to encoder."""
    return [p / e for p, e in zip(typicals("encoder", "power"), typicals("encoder", "explicit"), strict=True)]


def over_bound(estimator: str) -> list[float]:
    """Return the errors of an estimator over the bound, from 10 to 16 bits."""
    bounds = typicals("bound-encoder", "explicit", estimator, of="bound_percent")
    return [x / b for x, b in zip(typicals("bound-encoder", "explicit", estimator), bounds, strict=True)]


def of_series() -> list[float]:
    """Return errors of GLS on Fourier series over the bound, without torque noise."""
    some = [row for row in kept("reversals") if row["motion"] == "series" and not row["torque_noise"]]
    return [row["GLS"]["typical"] / row["bound"] for row in some]


def of_zoo() -> float:
    """Return the share of the parameters of all robots of others that are within two sigma."""
    count = np.array([row["parameters"] for row in kept("zoo")])
    return float(count @ [row["inside"] for row in kept("zoo")] / count.sum())


def of_set(title: str) -> Any:
    return next(row for row in kept("benchmark") if row["title"] == title)


def contradictions() -> int:
    """Count the errors [%] of Table 1 that no estimate with the printed decimals, three each, can have."""
    truth, half = np.array(list(scara_truth(Robot.load("scara")).values())), 5e-4
    off = [100 * (np.abs(np.array(column.estimate) - truth) + np.array([[-half], [half]])) / truth for column in PAPER.values()]
    errors = [np.array(column.error) for column in PAPER.values()]
    return sum(int(np.sum((e + half < low) | (e - half > high))) for e, (low, high) in zip(errors, off, strict=True))


def zz2_below_zzr1() -> list[float]:
    """Return how many times smaller the paper's errors of ZZ2 are than those of ZZR1, model by model."""
    return [column.error[0] / column.error[3] for column in PAPER.values()]


CLAIMS: list[tuple[str, str, Callable[[], object]]] = [
    ("README.md", r"(\w+) models \(explicit dynamic", lambda: len(THREE)),
    ("README.md", r"implicit model's errors are ([\d.]+) to", lambda: rounded(min(ratios("implicit", "explicit")))),
    ("README.md", r"model's errors are [\d.]+ to ([\d.]+) times", lambda: rounded(max(ratios("implicit", "explicit")))),
    ("README.md", r"encoders x (\d+) motions", lambda: load_study("encoder").seeds),
    ("any-arm.md", r"(\w+) arms ship: `scara`", lambda: len(set(models.names()) - SCENARIO_ONLY)),
    ("any-arm.md", r"error² - \(([\d.]+) expected\)²", lambda: validation.MARGIN),
    ("any-arm.md", r"\| good \| up to (\d+) % of the torque", lambda: GOOD),
    ("any-arm.md", r"\| fair \| up to (\d+) % \|", lambda: FAIR),
    ("any-arm.md", r"noise and sigma exceed (\d+) %", lambda: FAIR),
    ("any-arm.md", r"stated one by more than (\w+) sigma", lambda: SURE),
    ("any-arm.md", r"one sigma above (\d+) % of a brisk motion's torque", lambda: 100 * OPEN),
    ("any-arm.md", r"samples times joints² exceed (\S+), rows are not kept", lambda: rows.LONG),
    ("any-arm.md", r"A link has (\w+) standard parameters", lambda: len(INERTIAL)),
    ("any-arm.md", r"the last (\w+) is predicted", lambda: validation.HELD_OUT),
    ("any-arm.md", r"in one of a (\w+) logs", lambda: 1 / small_mistakes.CERTAIN),
    ("estimators.md", r"(\w+) ship; ", lambda: len(ESTIMATORS.builtin)),
    ("estimators.md", r"ship; (\w+) are \[compared", lambda: len(load_study("estimators").estimators)),
    ("estimators.md", r"samples that deviate by (\w+) standard deviations", lambda: wild_samples.WILD),
    ("excitation.md", r"there and back, is checked at (\d+) kHz", lambda: limit_use.FS / 1e3),
    ("exports.md", r"a folder of (\d+) physically consistent", lambda: ensemble.DRAWS),
    ("exports.md", r"Free runs of (\w+) a second", lambda: ensemble.LENGTH),
    ("exports.md", r"\(`spread`\) to hold (\d+) % of the instants", lambda: 100 * ensemble.LEVEL),
    ("exports.md", r"than in (\d+) % of the fit", lambda: 100 * torque_interval.MOST),
    ("first-hour.md", r"(\w+) arms ship \(`scara`", lambda: len(set(models.names()) - SCENARIO_ONLY)),
    ("first-hour.md", r"and (\w+) robots driven by servos", lambda: len(set(models.names()) & SCENARIO_ONLY)),
    ("first-hour.md", r"two joints, for (\d+) s", lambda: duration("ideal")),
    ("first-hour.md", r"# (\d+)-bit encoders", lambda: bits(load("quantization").encoder)),
    ("friction.md", r"smooth function of each joint's velocity: (\d+) bumps", lambda: len(laws.CENTRES)),
    ("friction.md", r"it explains (\d+) % of the squared error there", lambda: 100 * friction_choice.WORTH),
    ("friction.md", r"(\w+) stretches of the log are left out in turn", lambda: held_out.FOLDS),
    ("friction.md", r"there, and ([\d.]+) times its standard deviation", lambda: friction_choice.SURE),
    ("friction.md", r"or (\d+) % even without its best stretch", lambda: 100 * friction_choice.SOLID),
    ("friction.md", r"its parameter is (\d+) sigma away", lambda: friction_choice.PLAIN),
    ("friction.md", r"where the fastest (\w+) of a joint's motion", lambda: 1 - held_out.FAST),
    ("friction.md", r"does not fall at (\w+) the log's highest speed", lambda: max(friction_choice.BEYOND)),
    ("recordings.md", r"(\d+) parameters of seven joints", lambda: len(RobotModel("panda").basis.names)),
    ("recordings.md", r"parameters of (\w+) joints", lambda: Robot.load("panda").n),
    ("recordings.md", r"A delay of (\d+) ms, identified", lambda: 1e3 * load("delay").timing.delay),
    ("identification.md", r"(\w+) chains ship", lambda: len(CHAINS.builtin)),
    ("identification.md", r"\*\*Its threshold\*\* is (\d+) % of each joint's rms speed", lambda: 100 * masks.SLOW),
    ("identification.md", r"or (\d+) times the noise of its velocity", lambda: masks.NOISY),
    ("identification.md", r"falls by (\d) % or", lambda: 100 * used_rows.SHARE),
    ("identification.md", r"noise of ([\d.]+) % of their rms", lambda: 100 * NoisePrefilter().least),
    ("identification.md", r"to a (\w+) of the rms speed, with edges", lambda: masks.SLOW * used_rows.REACHES[-1]),
    ("identification.md", r"Its edges are (\d+) ms long", lambda: 1000 * masks.ReversalMask().taper),
    ("identification.md", r"with edges of (\d+) ms", lambda: 1000 * masks.WIDE[1] * masks.ReversalMask().taper),
    ("noise.md", r"without a stretch of (\d) s", lambda: leave_out.STRETCH),
    ("noise.md", r"Logs below (\d+) s have", lambda: estimates.ENOUGH),
    ("noise.md", r"half width of a joint is ([\d.]+) times", lambda: torque_interval.OTHER_MOTION),
    ("noise.md", r"rows of moving joints up to (\d+) Hz", lambda: used_rows.BAND),
    ("identification.md", r"singular values below (\S+) of the largest", lambda: factors.NOT_SHOWN),
    ("identification.md", r"with \(1 - \(t/H\)²\)([⁰-⁹])", lambda: "⁰¹²³⁴⁵⁶⁷⁸⁹"[ModulatingFunctions().degree]),
    ("index.md", r"A delay of (\d+) ms in the log", lambda: 1e3 * load("delay").timing.delay),
    ("loads.md", r"contradict by more than (\w+) sigma", lambda: known_load.SURE),
    ("loads.md", r"\(sigma above a (\w+) of it\)", lambda: drive_gains.VAGUE),
    ("noise.md", r"Rows of which the mask leaves less than (\d+) % are dropped", lambda: 100 * low_pass.SEEN),
    ("noise.md", r"If a fit is (\d+) standard errors or more away from `GLS`", lambda: maximum_likelihood.FAR),
    ("noise.md", r"Noise levels come from (six)th differences", lambda: white_noise.ORDER),
    ("noise.md", r"would fall by less than a (\w+), it returns", lambda: 1 - maximum_likelihood.WORTH),
    ("questions.md", r"(\d+) parameters that a motion can identify", lambda: len(RobotModel("two_link").basis.names)),
    ("questions.md", r"identify` estimates these (\w+)\.", lambda: len(RobotModel("two_link").basis.names)),
    ("questions.md", r"Fl\s+([\d.]+)\(92\)", lambda: round(device_of("STS3215")["parameters"]["Fl"]["value"], 4)),
    ("recordings.md", r"the logged torque of joint 1 is (\d+) % too large", lambda: 100 * load("gain").torque.gain_error[0]),
    ("recordings.md", r"a wave with (\d+) periods per turn for joint 2", lambda: Robot.load("scara").motors.order[1]),
    ("recordings.md", r"are thinned to ([\d.]+) Hz", lambda: stream.SHOWN),
    ("SECURITY.md", r"\| (\d+) \| interrupted \|", lambda: INTERRUPTED),
    ("SECURITY.md", r"this machine alone \(([\d.]+)\)", lambda: LOOPBACK),
    ("servo.md", r"raise the objective by less than (\d+) times its mean", lambda: servo_fit.MIN_RISE),
    ("servo.md", r"through (\d+) % of its range", lambda: 100 * load("servo-arm").trajectory.reach),
    ("servo.md", r"than rounding, (\w+) mistakes are tried", lambda: len(mistakes.MISTAKES)),
    ("servo.md", r"left-out parts to at most (\d+) %", lambda: 100 * (1 - mistakes.GAINED)),
    ("servo.md", r"\*good\* up to a mean position error of (\d+) %", lambda: GOOD),
    ("servo.md", r"or gain = ([\d.]+), duty_limit", lambda: PUBLISHED["STS3215"].gain),
    ("servo.md", r"Published models: (.*?)\. ", lambda: ", ".join(PUBLISHED)),
    ("studies.md", r"Wilson's \d+ % interval; ([\d.]+) % is right", lambda: round(100 * statistics.RIGHT, 1)),
    ("studies.md", r"integral; default: (\w+, \w+, \w+)", lambda: ", ".join(THREE)),
    ("your-own-log.md", r"It looks from (-\d+) to", lambda: 1e3 * delay.RANGE[0]),
    ("your-own-log.md", r"It looks from -\d+ to (\d+) ms", lambda: 1e3 * delay.RANGE[1]),
    ("your-own-log.md", r"farther \(up to ([\d.]+) s", lambda: delay.FARTHEST),
    ("your-own-log.md", r"polynomials of degree (\d)", lambda: 2 * filters.REACH - 1),
    ("your-own-log.md", r"or a (\w+) of the log", lambda: delay.SHARE),
    ("virtual-robot.md", r"the (\d+) V bus", lambda: max(Robot.load("scara").motors.V)),
    ("virtual-robot.md", r"Dead time of (\d+) ns", lambda: 1e9 * SwitchedDrive().dead_time),
    ("identification.md", r"standard parameters\*\* \(link parameters\): (\w+) per link", lambda: len(INERTIAL)),
    ("your-own-log.md", r"default low-pass has a cut-off of (\d+) Hz", lambda: FirLowPass().cutoff),
    ("your-own-log.md", r"\| `\?` \| sigma above (\d+) % of the value", lambda: 100 * WEAK),
    ("your-own-log.md", r"explains less than (\d+) % of a torque", lambda: 100 * WELL_EXPLAINED),
    ("your-own-log.md", r"at gaps of more than ([\d.]+) s", lambda: clock.LONGEST),
    ("your-own-log.md", r"Poses at rest\*\* \(rows ([\d.]+) s apart", lambda: poses.SLOWEST),
    ("answers.md", r"SCARA, logged at (\d+) Hz", lambda: load("ideal").fs),
    ("answers.md", r"moves of [\d.]+ s; (\d+) runs per row", lambda: load_study("encoder").seeds),
    ("answers.md", r"\(12 moves; (\d+) runs per row", lambda: load_study("sigma").seeds),
    ("answers.md", r"N m; (\d+) runs\) <!-- table: ripple", lambda: load_study("ripple").seeds),
    ("answers.md", r"0\.1 N m gives ([\d.]+) %", lambda: rounded(typical("torque-noise", "explicit", 0.1))),
    ("answers.md", r"torque noise, (\d+) to \d+ times with encoder noise", lambda: round(min(power_of_encoders()))),
    ("answers.md", r"torque noise, \d+ to (\d+) times with encoder noise", lambda: round(max(power_of_encoders()))),
    ("answers.md", r"the hold alone costs (\d+) to", lambda: round(typical("delay", "explicit", 0.0, "paper"))),
    ("appendix.md", r"random motions with (\d+) to \d+ moves", lambda: scenario_of("motions").trajectory.moves[0]),
    ("appendix.md", r"Cond\(W\) within (\d+) % of 28", lambda: 100 * Table1Motions(1).tolerance),
    ("appendix.md", r"(\d+) moves in 40 s give", lambda: len(load("table1").quintic().durations)),
    ("appendix.md", r"Chebyshev filter of order (\d) at", lambda: paper_chain().operator.order),
    ("appendix.md", r"Hz with decimation by (\d+)", lambda: paper_chain().operator.step(load("table1").fs)),
    ("appendix.md", r"choppers at (\d) kHz", lambda: load("table2").drive.pwm / 1e3),
    ("appendix.md", r"r = (\d+) rows", lambda: table2.PAPER_ROWS),
    ("appendix.md", r"dynamic models, (\w+) for the power model", lambda: table2.REALIZATIONS["power"]),
    ("benchmark.md", r"some hundred instants for (\d+) parameters", lambda: of_set("Franka Panda, ROS 2")["parameters"]),
    ("benchmark.md", r"The (\w+)th set, `sts3215`", lambda: len(kept("benchmark"))),
    ("conclusion.md", r"The SCARA follows (\d+) random motions", lambda: kept_ratios()["seeds"]),
    ("conclusion.md", r"over windows of ([\d.]+) s\.", lambda: Windows().length),
    ("conclusion.md", r"(\w+) of the 24 errors that Table 1 prints contradict", contradictions),
    ("conclusion.md", r"are (\d+) to \d+ times smaller than those of ZZR1", lambda: round(min(zz2_below_zzr1()))),
    ("conclusion.md", r"are \d+ to (\d+) times smaller than those of ZZR1", lambda: round(max(zz2_below_zzr1()))),
    ("benchmark.md", r"two sigma contain (\d+) % of the parameters", lambda: round(100 * of_zoo())),
    ("estimators.md", r"all (\w+) combinations of bits", lambda: len(typicals("estimators", "explicit", "GLS"))),
    ("estimators.md", r"starts that are (\d+) % off", lambda: 100 * load_study("estimators-puma560").start),
    ("estimators.md", r"on six joints with (\d+) parameters", lambda: len(RobotModel("puma560").basis.names)),
    ("excitation.md", r"excitation-predicted-puma`: (\d+) of", lambda: load_study("excitation-predicted-puma").seeds),
    ("noise.md", r"is within a factor of ([\d.]+) of the bound", lambda: rounded(max(over_bound("GLS")[1:]))),
    ("noise.md", r"On Fourier series it is ([\d.]+) to", lambda: rounded(min(of_series()))),
    ("noise.md", r"On Fourier series it is [\d.]+ to ([\d.]+) times the bound", lambda: rounded(max(of_series()))),
    ("noise.md", r"with which stretches of (\d) s are predicted", lambda: leave_out.STRETCH),
    ("servo.md", r"`idbench study servo`: (\d+) s at", lambda: round(duration("servo"))),
    ("servo.md", r"\d+ bits, (\d) ms of jitter", lambda: 1e3 * load("servo").timing.jitter),
    ("servo.md", r"torque off (\w+) times; 100 logs", lambda: len(load("servo").drive.off)),
    ("servo.md", r"100 logs of (\d+) s, torque never off", lambda: round(duration("servo-arm"))),
]


@pytest.mark.parametrize(("page", "sentence", "made_of"), CLAIMS, ids=[f"{page}: {sentence}" for page, sentence, _ in CLAIMS])
def test_numbers_of_the_pages_are_those_of_the_code(page, sentence, made_of):
    path = ROOT / page if page in ("README.md", "SECURITY.md") else ROOT / "docs" / page
    found = re.findall(sentence, " ".join(path.read_text(encoding="utf-8").split()))
    assert found, "the sentence is gone: mend the claim"
    wanted = made_of()
    for said in found:
        number = said if isinstance(wanted, str) else WORDS[said.lower()] if said.lower() in WORDS else float(said)
        assert number == wanted if isinstance(wanted, str) else np.isclose(number, float(wanted)), f"{said}: {wanted}"


def test_every_command_is_in_a_page(root):
    pages = "\n".join(path.read_text() for path in [root / "README.md", *(root / "docs").glob("*.md")])
    assert [name for name in COMMANDS if f"idbench {name}" not in pages] == []
