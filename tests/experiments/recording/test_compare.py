"""Runs laid over each other: estimates first, then the settings that differ, and a motion that begins later is moved back."""

import json
import shutil

import numpy as np
import pytest
from rerun.chunk import RrdReader

from idbench.experiments.cli import main
from idbench.experiments.recording.compared import difference, estimates, named_runs, shift_of
from idbench.identify import MotionLog, TorqueChannel

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two runs of which the second has a delay, and lines of text that ask for it."""
    at = tmp_path_factory.mktemp("compared")
    for name in ("ideal", "delay"):
        assert main(["run", name, "--out", str(at / name)]) == 0
    return at


def test_estimates_stand_first_then_what_differs_and_every_run_is_an_identification(folder, reading):
    one = folder / "both.rrd"
    assert main(["view", str(folder / "ideal"), str(folder / "delay"), "--save", str(one)]) == 0
    reading.verify(one)
    (chunk,) = [c for c in RrdReader(one).stream().filter(content="/comparison").to_chunks() if c.is_static]
    text = chunk.to_record_batch().column("TextDocument:text").to_pylist()[0][0]
    assert text.index("**Estimates**") < text.index("timing.delay") < text.index("encoder.noise")
    assert "| ideal | delay |" in text
    assert "| ZZR1 [kg m²] |" in text
    there = reading.entities(one)
    for name in ("ideal", "delay"):
        assert {
            f"identify/{name}/explicit/residual/joint1",
            f"legend/{name}",
            f"identify/{name}/friction/joint2/frame",
        } <= there
    _, measured = reading.column(folder / "delay" / "recording.rrd", "q/measured")
    _, shown = reading.column(one, "versus/1/q/measured")
    np.testing.assert_array_equal(shown, measured)
    _, first = reading.column(folder / "ideal" / "recording.rrd", "q/measured")
    _, apart = reading.column(one, "difference/q/delay")
    np.testing.assert_allclose(apart, measured - first, atol=1e-12)


def test_folders_of_table1_and_of_earlier_versions_are_compared(folder, tmp_path):
    for name in ("one", "two"):
        assert main(["table1", "--out", str(tmp_path / name)]) == 0
    found = tmp_path / "two" / "summary.json"
    summary = json.loads(found.read_text())
    found.write_text(json.dumps({key: x for key, x in summary.items() if key != "units"}))
    runs = named_runs([tmp_path / "one", tmp_path / "two"])
    assert "| ZZR1 [kg m²] |" in estimates(runs)
    assert "| ZZR1 |" in estimates(runs[::-1])


def test_without_a_name_the_latest_is_opened(folder, monkeypatch, capsys, tmp_path):
    (tmp_path / "runs").symlink_to(folder)
    monkeypatch.chdir(tmp_path)
    assert main(["view", "--save", "one.rrd"]) == 0
    assert "the latest of runs: runs/delay" in capsys.readouterr().out


def test_what_cannot_be_compared_is_refused(folder, capsys, tmp_path):
    def complaint(*words):
        assert main(["view", *map(str, words), "--save", str(tmp_path / "x.rrd")]) == 2
        return capsys.readouterr().err

    assert "given twice" in complaint(folder / "ideal", folder / "ideal")
    assert "holds no run" in complaint(folder / "ideal", tmp_path)
    assert not (tmp_path / "x.rrd").exists()


def moved(log, seconds):
    """Return the same motion that begins later."""
    rows = round(seconds * log.fs)
    q = np.concatenate([np.repeat(log.q[:1], rows, axis=0), log.q])
    return MotionLog(log.fs, q, np.concatenate([np.repeat(log.tau[:1], rows, axis=0), log.tau]), log.torque)


def test_a_motion_that_begins_later_is_found(table1):
    later = moved(table1.log, 1.37)
    assert shift_of(table1.log, table1.log) == 0
    assert shift_of(table1.log, later) == pytest.approx(-1.37, abs=1e-9)
    t, apart = difference(table1.log, later, -1.37)
    assert len(t) == table1.log.samples
    assert np.abs(apart["q"]).max() < 1e-9


def test_another_motion_is_not_laid_over(table1):
    rng = np.random.default_rng(0)
    q = np.cumsum(np.cumsum(rng.normal(size=(3000, 2)), axis=0), axis=0) / 1e5
    assert shift_of(table1.log, MotionLog(100.0, q, np.zeros_like(q), TorqueChannel("held"))) is None


def test_runs_of_equal_names_and_of_names_that_begin_alike_stay_apart(folder, tmp_path, reading):
    """Of every run its own curves, named and coloured as its own."""
    copies = [shutil.copytree(folder / "ideal", tmp_path / "copies" / name) for name in ("x/run", "y/run", "rip-2", "rip")]
    for k, (first, second) in enumerate((copies[:2], copies[2:])):
        one = tmp_path / f"{k}.rrd"
        assert main(["view", str(first), str(second), "--save", str(one)]) == 0
        names = sorted({path.split("/")[1] for path in reading.entities(one) if path.startswith("identify/")})
        assert len(names) == 2
        for name in names:
            found = RrdReader(one).stream().filter(content=f"/identify/{name}/explicit/residual/joint1").to_chunks()
            styles = [c.to_record_batch().column("SeriesLines:names").to_pylist() for c in found if c.is_static]
            assert [f"explicit, {name}"] in [row for rows in styles for row in rows]
            assert not any(other != name and [f"explicit, {other}"] in rows for rows in styles for other in names)


def test_layers_whose_labels_have_dots_stay_apart(folder, tmp_path, reading):
    run = shutil.copytree(folder / "ideal", tmp_path / "run")
    for label in ("v.0", "v.1"):
        assert main(["identify", str(run), "--label", label, "--model", "explicit"]) == 0
    one = tmp_path / "one.rrd"
    assert main(["view", str(run), str(folder / "delay"), "--save", str(one)]) == 0
    methods = {path.split("/")[1] for path in reading.entities(one) if path.startswith("identify/")}
    assert methods == {"run-idbench-GLS", "run-v.0", "run-v.1", "delay"}
