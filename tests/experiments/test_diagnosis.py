"""What is wrong, as a user sees it: the first and the last line, what mends it, and what a summary says."""

import csv
import re
from dataclasses import replace

import pytest

import idbench
from idbench.experiments.identification.friction_laws import FrictionLaws
from idbench.experiments.identification.wordings import WORDINGS
from idbench.identify.judge.mistakes import BASE, COGGING, COLLISION, COMMUTATION, FROM_AN_INSTANT, OF_JOINTS, OF_ROBOT
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.faults import Fault
from idbench.sim.scenario.scenario_file import load


def scaled(source, target, column, factor):
    """Write a log with one column multiplied."""
    with source.open() as file:
        head, *rows = csv.reader(file)
    k = head.index(column)
    with target.open("w", newline="") as file:
        csv.writer(file).writerows([head, *([*row[:k], repr(factor * float(row[k])), *row[k + 1 :]] for row in rows)])


@pytest.mark.thorough
def test_a_wrong_torque_constant_is_named_and_the_option_mends_it(ran, tmp_path):
    ran("new example demo --robot puma560")
    how = "--robot demo/arm.xml --torque held --torque-delay 0.002 --model explicit --no-rerun"
    scaled(tmp_path / "demo/log.csv", tmp_path / "bad.csv", "tau3", 1.1)
    out, err, summary = ran("identify bad.csv", how, "--out bad")
    assert out.startswith("Result: fair")
    assert "joint3: torque constant" in out.splitlines()[1]
    first = summary["diagnosis"][0]
    assert (first["cause"], first["joint"], first["unit"]) == ("gain", "joint3", "1")
    assert abs(first["size"] - 0.1) < 4 * first["sigma"] + 0.01
    assert first["held_out"][1] < first["held_out"][0]
    report = (tmp_path / "bad/report.html").read_text()
    figure = report.partition("What the mistakes explain")[2].partition("<h2>")[0]
    assert "torque constant" in figure
    assert "joint3" in figure
    assert first["remedy"] in err.replace("\n", " ") + out.replace("\n", " ")
    out, _, summary = ran("identify bad.csv", how, first["remedy"], "--out good")
    assert "Result: good" in out
    assert summary["diagnosis"] == []


def test_every_mistake_has_words():
    small = {(m.cause, m.of) for m in (*OF_JOINTS, *OF_ROBOT, *FROM_AN_INSTANT, *BASE, COLLISION, COGGING, COMMUTATION)}
    large = {
        ("sign", "torque"),
        ("sign", "position"),
        ("sign", "joint"),
        ("exchanged", "torque"),
        ("exchanged", "position"),
        ("exchanged", "joint"),
        ("gravity", "base"),
        ("missing_torque", "torque"),
        ("dropouts", "log"),
        ("unit", "position"),
        ("unit", "joint"),
        ("stated", "request"),
    }
    unknown = {("unknown", of) for of in ("position", "velocity", "acceleration", "load", "other joints", "moment")}
    assert set(WORDINGS) == small | large | unknown | {("slip", "position")}


@pytest.mark.parametrize("law", [wording.law for wording in WORDINGS.values() if wording.law])
def test_laws_that_are_advised_exist(law):
    assert FrictionLaws.of([f"standard+{law.format(setting=3.0)}"], ["a", "b"]).names[1]


@pytest.mark.parametrize(("held", "wrong"), [("Fs1=0.5", False), ("Fs1=0.8", True)])
def test_what_is_held_is_asked_of_the_log(held, wrong):
    """Also beside an offset that was not asked for: what is held rightly is no cause."""
    run = simulate(replace(load("ideal"), fault=() if wrong else (Fault("offset", 0.5, "joint2"),)))
    causes = idbench.fit(run.alone(), "scara", hold=(held,)).fit.diagnosis
    if wrong:  # it sets the scale of all torques, whose gains explain the same
        assert {cause.suspect.cause for cause in causes} == {"gain"}
        assert f"or --hold {held} contradicts the log" in causes[0].words
    else:
        assert [cause.suspect.cause for cause in causes] == ["offset"]


def test_options_of_several_mistakes_are_printed_together():
    faults = Fault("gain", 0.15, "joint1"), Fault("delay", 0.01)
    fit = idbench.fit(simulate(replace(load("ideal"), fault=faults)).alone(), "scara")
    assert re.fullmatch(r"--torque-delay estimate --gain 0\.8\d+ 1 or --gain 1 1\.1\d+", fit.answer.step)
