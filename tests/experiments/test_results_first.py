"""Results come before what shows them: a view that fails takes nothing else away, and says so in one line."""

import json
from pathlib import Path

import pytest

from idbench.experiments.cli import main
from idbench.experiments.results.writing import NAME
from idbench.identify import IdentificationError

WORDS = "--robot", "puma560", "--model", "explicit", "--estimator", "WLS"


class BrokenError(RuntimeError):
    """What no input should cause."""


def broken(*args, **options):
    raise BrokenError("on purpose")


def refused(*args, **options):
    raise IdentificationError("it cannot be drawn")


RECORDING = "recording.rrd", "recording.idbench-WLS.rrd"

VIEWS = {
    "idbench.experiments.reports.page.rendered": ("report.html", {*RECORDING, "arm.json"}),
    "idbench.experiments.reports.page.friction_figure": (
        "the figure of friction in report.html",
        {"report.html", *RECORDING, "arm.json"},
    ),
    "idbench.experiments.recording.identification_recording.record_log": ("the recording", {"report.html", "arm.json"}),
    "idbench.experiments.exports.exports.json_text": ("--write found/arm.json", {"report.html", *RECORDING}),
    "idbench.experiments.cli.commands.identify.checks": (
        "the checks",
        {"report.html", *RECORDING, "arm.json"},
    ),
}
"""What is broken; what is named; which views are there all the same."""


@pytest.mark.thorough
@pytest.mark.parametrize("error", [broken, refused], ids=["fault", "refusal"])
@pytest.mark.parametrize("view", VIEWS)
def test_a_view_that_fails_leaves_everything_else(view, error, idbench, logs, tmp_path, monkeypatch):
    name, others = VIEWS[view]
    monkeypatch.setattr(view, error)
    code, out, err = idbench("identify", logs / "first.parquet", *WORDS, "--out", "found", "--write", "found/arm.json")
    assert code == 2
    assert "explicit model, WLS" in out
    assert out.startswith("Result: good: torques within ")
    assert len(err.splitlines()) == 1
    assert f"idbench: {name}: " in err
    assert "the estimates are printed, and with the logs in found" in err
    there = {path.name for path in (tmp_path / "found").iterdir()} - {NAME}
    assert there == {"summary.json", "log.parquet", *others, *(["fault.txt"] if error is broken else [])}
    assert "explicit" in json.loads((tmp_path / "found" / "summary.json").read_text())["models"]
    if error is broken:
        assert "a fault of idbench, not of your input (BrokenError: on purpose)" in err
        assert "in broken" in (tmp_path / "found" / "fault.txt").read_text()
    else:
        assert "it cannot be drawn" in err


@pytest.mark.thorough
def test_smooth_functions_which_no_table_shows_break_no_view(idbench, logs, tmp_path):
    words = *WORDS, "--friction", "smooth", "--no-trials"
    code, _, err = idbench("identify", logs / "first.parquet", *words, "--out", "found")
    assert (code, err) == (0, "")
    there = {path.name for path in (tmp_path / "found").iterdir()} - {NAME}
    assert there == {"summary.json", "log.parquet", "report.html", *RECORDING}
    page = (tmp_path / "found" / "report.html").read_text()
    assert "<td>ZZ6</td>" in page
    assert "u1_1" not in page


@pytest.mark.thorough
@pytest.mark.parametrize("error", [broken, refused], ids=["fault", "refusal"])
def test_a_held_out_log_that_cannot_be_judged_leaves_the_others(error, idbench, logs, tmp_path, monkeypatch):
    """The second of three; the table was printed, the summary is there, one line names what is missing."""
    from idbench.experiments.judgement import held_out

    real, calls = held_out.validate, []

    def sometimes(*args):
        calls.append(args)
        return real(*args) if len(calls) != 2 else error()

    monkeypatch.setattr(held_out, "validate", sometimes)
    names = [tmp_path / f"{name}.parquet" for name in "abc"]
    for k, path in enumerate(names):
        part(logs / "second.parquet", path, k)
    words = ["--out", "found", "--no-rerun", "--validate", *names]
    code, out, err = idbench("identify", logs / "first.parquet", *WORDS, *words)
    assert code == 2
    assert len(err.splitlines()) == 1
    assert f"held-out log {names[1]}" in err
    judged = json.loads((tmp_path / "found" / "summary.json").read_text())["validations"]
    assert [bool(one["models"]) for one in judged] == [True, False, True]
    assert out.count("\nheld-out log ") == 2
    assert (tmp_path / "found" / "report.html").is_file()


def test_a_conclusion_that_fails_leaves_the_estimates(idbench, logs, tmp_path, monkeypatch):
    monkeypatch.setattr("idbench.experiments.cli.commands.identify.conclusion", broken)
    code, out, _ = idbench("identify", logs / "first.parquet", *WORDS, "--no-rerun", "--out", "found")
    assert code == 1
    assert "explicit model, WLS" in out
    assert "explicit" in json.loads((tmp_path / "found" / "summary.json").read_text())["models"]


def part(log, target, k):
    """Write a part of a log."""
    from idbench.identify.files.log_file import read_log, write_log

    whole = read_log(log)
    write_log(whole.part(100 * k, whole.samples - 100), target)


def test_a_fault_before_the_results_is_told_with_its_report(idbench, logs, monkeypatch, tmp_path):
    monkeypatch.setattr("idbench.experiments.identification.job.fit", broken)
    code, out, err = idbench("identify", logs / "first.parquet", *WORDS, "--out", "found")
    assert (code, out) == (1, "")
    assert len(err.splitlines()) == 1
    assert "a fault of idbench, not of your input (BrokenError: on purpose); its traceback is in " in err
    with open(err.rpartition(" ")[2].strip()) as report:  # noqa: PTH123
        assert "in broken" in report.read()
    assert not (tmp_path / "found").exists()


def test_results_are_saved_before_the_judgement(idbench, logs, tmp_path, monkeypatch):
    """Ctrl-C while it is judged: the estimates are on the screen and in the folder."""

    def interrupted(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr("idbench.experiments.cli.commands.identify.judge", interrupted)
    code, out, err = idbench("identify", logs / "first.parquet", *WORDS, "--out", "found")
    kept = "idbench: the estimates are printed, and with the logs in found"
    assert (code, err.strip().splitlines()) == (130, [kept, "idbench: interrupted"])
    assert "explicit model, WLS" in out
    summary = json.loads((tmp_path / "found" / "summary.json").read_text())
    assert summary["models"]["explicit"]["estimate"]
    assert (tmp_path / "found" / "log.parquet").is_file()


@pytest.mark.thorough
def test_a_run_without_a_recording_gets_no_layer(idbench, tmp_path):
    assert idbench("run", "ideal", "--no-rerun", "--out", "ran")[0] == 0
    code, out, err = idbench("identify", "ran", "--estimator", "WLS")
    assert (code, err, "explicit model, WLS" in out) == (0, "", True)
    code, out, err = idbench("identify", "ran", "--estimator", "WLS", "--label", "again")
    assert (code, out) == (2, "")
    assert "there is no recording.rrd in ran, to which --label again could add" in err
    assert not list((tmp_path / "ran").glob("*.rrd"))


WRITTEN = ("arm.xml", "arm.urdf", "arm.json", "arm.py")
"""Files for other software."""


@pytest.mark.thorough
@pytest.mark.parametrize("lost", ["report.html", "recording.rrd", *WRITTEN])
def test_a_disk_that_is_full_for_one_file_leaves_the_others(lost, idbench, logs, tmp_path, monkeypatch):
    def full(path, write):
        if path.name == lost:
            raise OSError(28, "No space left on device")
        return write

    for name in ("write_text", "write_bytes"):
        write = getattr(Path, name)
        monkeypatch.setattr(Path, name, lambda path, *args, _write=write, **options: full(path, _write)(path, *args, **options))
    targets = ["--write", *(f"found/{name}" for name in WRITTEN)]
    code, out, err = idbench("identify", logs / "first.parquet", *WORDS, "--out", "found", *targets)
    assert (code, len(err.splitlines()), out.startswith("Result: good")) == (2, 1, True)
    assert "No space left on device" in err
    there = {path.name for path in (tmp_path / "found").iterdir()} - {NAME}
    gone = set(RECORDING) if lost == "recording.rrd" else {lost}
    assert there == {"summary.json", "log.parquet", "report.html", *RECORDING, *WRITTEN} - gone


@pytest.mark.thorough
def test_json_is_whole_whatever_fails(idbench, logs, monkeypatch):
    monkeypatch.setattr("idbench.experiments.reports.page.rendered", broken)
    code, out, err = idbench("identify", logs / "first.parquet", *WORDS, "--out", "found", "--no-rerun", "--json")
    assert code == 2
    found = json.loads(out)
    assert found["validation"]["models"]["explicit"]["verdict"] == "good"
    assert "report.html" in err


def test_runs_and_tables_keep_theirs(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("idbench.experiments.recording.identification_recording.Layer", broken)
    assert main(["run", "ideal", "--estimator", "OLS", "--out", "kept"]) == 2
    out, err = capfd.readouterr()
    assert "Cond(W)" in out
    assert "idbench: the recording: a fault of idbench" in err
    assert {path.name for path in (tmp_path / "kept").iterdir()} == {
        NAME, "fault.txt", "log.parquet", "scenario.toml", "summary.json",
    }  # fmt: skip
