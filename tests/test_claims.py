"""Numbers in the pages that follow from the code: each sentence beside what it is made of."""

import re
from collections.abc import Callable

import numpy as np
import pytest

from idbench import models
from idbench.experiments.cli.app import COMMANDS
from idbench.experiments.identification import friction_choice
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.judgement.held_out import FAIR, GOOD
from idbench.experiments.judgement.remedies import SURE
from idbench.experiments.judgement.warnings import OPEN, WEAK
from idbench.identify import CHAINS, ESTIMATORS
from idbench.identify.basis.friction import smooth
from idbench.identify.estimators import model_error
from idbench.identify.estimators.likelihood import maximum_likelihood
from idbench.identify.judge import band, delay, held_out, validation
from idbench.identify.noise import noisy_rows, white_noise
from idbench.identify.rows import factors, rows
from idbench.identify.rows.operators import FirLowPass
from idbench.identify.servo import fit as servo_fit
from idbench.identify.signals import filters, masks
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load

WORDS = (
    *("none", "one", "two", "three", "four", "five", "six", "seven", "eight"),
    *("nine", "ten", "eleven", "twelve", "thirteen", "fourteen", "fifteen", "sixteen"),
)

SCENARIO_ONLY = {"pendulum", "horn", "servo_arm"}
"""Robots that ship as benches of servos."""


def shipped() -> set[str]:
    return {path.name for path in models.path("scara").parent.parent.iterdir() if (path / f"{path.name}.xml").is_file()}


CLAIMS: list[tuple[str, str, Callable[[], object]]] = [
    ("any-arm.md", r"(\w+) arms ship: `scara`", lambda: len(shipped() - SCENARIO_ONLY)),
    ("first-hour.md", r"(\w+) arms ship \(`scara`", lambda: len(shipped() - SCENARIO_ONLY)),
    ("first-hour.md", r"and (\w+) benches for servos", lambda: len(shipped() & SCENARIO_ONLY)),
    ("estimators.md", r"(\w+) ship; ", lambda: len(ESTIMATORS.builtin)),
    ("identification.md", r"(\w+) chains ship", lambda: len(CHAINS.builtin)),
    ("gallery.md", r"(\d+) parameters of seven joints", lambda: len(RobotModel("panda").basis.names)),
    ("gallery.md", r"parameters of (\w+) joints", lambda: Robot.load("panda").n),
    ("your-own-log.md", r"default low-pass has a cut-off of (\d+) Hz", lambda: FirLowPass().cutoff),
    ("any-arm.md", r"error² - \(([\d.]+) expected\)²", lambda: validation.MARGIN),
    ("any-arm.md", r"\| good \| up to (\d+) % of the torque", lambda: GOOD),
    ("any-arm.md", r"\| fair \| up to (\d+) % \|", lambda: FAIR),
    ("any-arm.md", r"noise and sigma exceed (\d+) %", lambda: FAIR),
    ("any-arm.md", r"stated one by more than (\w+) sigma", lambda: SURE),
    ("any-arm.md", r"one sigma above (\d+) % of a brisk motion's torque", lambda: 100 * OPEN),
    ("any-arm.md", r"samples times joints² exceed (\S+), rows are not kept", lambda: rows.LONG),
    ("torque.md", r"It looks from (-\d+) to", lambda: 1e3 * delay.RANGE[0]),
    ("torque.md", r"It looks from -\d+ to (\d+) ms", lambda: 1e3 * delay.RANGE[1]),
    ("torque.md", r"farther \(up to ([\d.]+) s", lambda: delay.FARTHEST),
    ("torque.md", r"polynomials of degree (\d)", lambda: 2 * filters.REACH - 1),
    ("noise.md", r"Rows of which the mask leaves less than (\d+) % are dropped", lambda: 100 * noisy_rows.SEEN),
    ("noise.md", r"If a fit is (\d+) standard errors or more away from `GLS`", lambda: maximum_likelihood.FAR),
    ("noise.md", r"autocorrelation\s+up to (\d) s", lambda: model_error.MEMORY),
    ("noise.md", r"Noise levels come from (six)th differences", lambda: white_noise.ORDER),
    ("identification.md", r"\*\*Its threshold\*\* is (\d+) % of each joint's rms speed", lambda: 100 * masks.SLOW),
    ("identification.md", r"or (\d+) times the noise of its velocity", lambda: masks.NOISY),
    ("identification.md", r"\(an F test, ([\d.]+) times\)", lambda: band.EXCESS),
    ("identification.md", r"singular values below (\S+) of the largest", lambda: factors.NOT_SHOWN),
    ("friction.md", r"smooth function of each joint's velocity: (\d+) bumps", lambda: len(smooth.CENTRES)),
    ("friction.md", r"it explains (\d+) % of the squared error there", lambda: 100 * friction_choice.SHOWN),
    ("friction.md", r"(\w+) stretches of the log are left out in turn", lambda: held_out.FOLDS),
    ("servo.md", r"raise the objective by less than (\d+) times its mean", lambda: servo_fit.MIN_RISE),
    ("your-own-log.md", r"\| `\?` \| sigma above (\d+) % of the value", lambda: 100 * WEAK),
    ("gallery.md", r"A delay of (\d+) ms, identified", lambda: 1e3 * load("delay").timing.delay),
    ("recordings.md", r"the logged torque of joint 1 is (\d+) % too large", lambda: 100 * load("gain").torque.gain_error[0]),
]


@pytest.mark.parametrize(("page", "sentence", "made_of"), CLAIMS, ids=[f"{page}: {sentence}" for page, sentence, _ in CLAIMS])
def test_numbers_of_the_pages_are_those_of_the_code(root, page, sentence, made_of):
    found = re.findall(sentence, (root / "docs" / page).read_text())
    assert found, "the sentence is gone: mend the claim"
    wanted = made_of()
    for said in found:
        number = said if isinstance(wanted, str) else WORDS.index(said.lower()) if said.lower() in WORDS else float(said)
        assert number == wanted if isinstance(wanted, str) else np.isclose(float(number), float(wanted)), f"{said}: {wanted}"


def test_every_command_is_in_a_page(root):
    pages = "\n".join(path.read_text() for path in [root / "README.md", *(root / "docs").glob("*.md")])
    assert [name for name in COMMANDS if f"idbench {name}" not in pages] == []
