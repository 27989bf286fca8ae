"""Every kind of summary.json follows the schema that ships: `ran` holds each that it reads to it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator, ValidationError
from pairs import Pairs

import idbench
from idbench.experiments.results.writing import SCHEMA
from idbench.identify.files.log_file import write_log
from idbench.sim.drives import AveragedDrive
from idbench.sim.robot.payload import Payload
from idbench.sim.scenario.scenario_file import load, to_toml
from idbench.sim.trajectories import Quintic, RandomMoves

KINDS = {
    "run": "run ideal --no-rerun --estimator OLS",
    "identify": "identify {logs}/first.parquet --robot puma560 --torque held --torque-delay 0 --model explicit --no-trials",
    "payload": "payload full.parquet --unloaded empty.parquet --robot puma560 --estimator WLS",
    "gains": "gains full.parquet --unloaded empty.parquet --robot puma560 --estimator WLS --mass 2",
    "servo": "servo {horn}/log.parquet --robot horn --servo {horn}/servo.toml --no-rerun",
    "study": "study {study} --no-rerun",
    "table1": "table1 --no-rerun",
    "table1-motions": "table1 --motions 200",
    "table2": "table2 --scenario table2.toml --no-rerun",
    "excite": "excite two_link --duration 3 --no-rerun",
}
"""A command for each kind."""

STUDY = """
name = "short"
question = "?"
scenario = "quantization"
seeds = 2
models = ["explicit", "power"]
estimators = ["OLS"]
[settings.trajectory]
kind = "random"
moves = 6
[[axes]]
field = "encoder.lines"
values = [1024, 4096]
"""


@pytest.fixture(scope="module")
def schema():
    path = Path(idbench.experiments.__file__).parent / "results" / "summary.schema.json"
    return json.loads(path.read_text())


def test_the_schema_is_one_and_knows_every_kind(schema):
    Draft202012Validator.check_schema(schema)
    assert schema["properties"]["schema"]["const"] == SCHEMA
    assert set(KINDS) == set(schema["properties"]["experiment"]["enum"])


@pytest.mark.thorough
@pytest.mark.parametrize("kind", KINDS)
def test_a_summary_of_each_kind_follows_it(kind, logs, ran, tmp_path):
    horn, study = tmp_path / "horn", tmp_path / "short.toml"
    study.write_text(STUDY)
    if kind == "table2":  # six moves of averaged drives
        points = RandomMoves(moves=6).plan(load("table2").nominal_robot)
        moves = Quintic(tuple(map(tuple, points.waypoints.tolist())), tuple(points.durations.tolist()), 3.0)
        (tmp_path / "table2.toml").write_text(to_toml(replace(load("table2"), trajectory=moves, drive=AveragedDrive())))
    if kind in ("payload", "gains"):
        arm = load("arm")
        moves, payload = replace(arm.trajectory, moves=12), Payload(mass=2.0, position=(0.03, -0.02, 0.15), inertia=0.012)
        pairs = Pairs(replace(arm, robot="puma560", fs=250.0, trajectory=moves, payload=payload))
        for name, run in zip(("empty", "full"), pairs.simulated, strict=True):
            write_log(run.alone(0), tmp_path / f"{name}.parquet")
    if kind == "servo":
        ran("run servo --robot horn --no-rerun --out", horn)
    summary = ran(KINDS[kind].format(logs=logs, horn=horn, study=study), "--out found").summary
    assert summary["experiment"] == kind


def test_what_lacks_its_verdict_or_a_unit_does_not(schema):
    good = {"value": 1.0, "sigma": None, "unit": "N m"}
    model = {
        "parameters": {"Fs1": good},
        **{key: [1.0] for key in ("estimate", "sigma", "sigma_noise", "paper_sigma")},
        "condition_number": 2.0,
        "rows": 7,
        "residual_rms": 0.1,
    }
    summary = {
        "schema": SCHEMA,
        "version": "0",
        "experiment": "table2",
        "seed": 0,
        "scenario": {},
        **{key: [] for key in ("parameters", "truth", "robot", "attribution_percent")},
        "models": {"explicit": model},
        "paper_processing": {},
    }
    held = Draft202012Validator(schema)
    held.validate(summary)
    model["parameters"] = {"Fs1": {"value": 1.0, "sigma": 0.1}}
    with pytest.raises(ValidationError, match="'unit' is a required property"):
        held.validate(summary)
