"""The command `study`, `run --from`, and what they leave."""

import json
import re
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest
import rerun_cli
from distributed import LocalCluster
from rerun.chunk import RrdReader

from idbench.experiments.cli import main
from idbench.experiments.study import job as engine
from idbench.experiments.study import job as study_job
from idbench.experiments.study.store import Store


@pytest.mark.thorough
def test_the_folder_has_all_that_is_promised(done, undisturbed):
    names = {"study.toml", "shards", "summary.json", "report.html", "recording.rrd"}
    assert names <= {path.name for path in done.iterdir()}
    assert Store.open(done).table().equals(undisturbed)


@pytest.mark.thorough
def test_the_summary_says_what_the_rows_say(done, undisturbed):
    summary = json.loads((done / "summary.json").read_text())
    assert len(summary["cells"]) == 8
    rows = undisturbed.to_pylist()
    for cell in summary["cells"]:
        mine = [r for r in rows if r["model"] == cell["model"] and all(r[k] == v for k, v in cell["settings"].items())]
        error = np.array([100 * (r["Fs1"] - 0.5) / 0.5 for r in mine])
        place = summary["parameters"].index("Fs1")
        assert cell["runs"] == len(mine) == 9
        assert cell["bias_percent"][place] == pytest.approx(error.mean())
        assert cell["rmse_percent"][place] == pytest.approx(np.sqrt(np.mean(error**2)))
    assert summary["versions"]["idbench"]


class Page(HTMLParser):
    """What a page opens and loads."""

    def __init__(self):
        super().__init__()
        self.tags, self.loads = [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.loads += [value for name, value in attrs if name in {"src", "href", "xlink:href"} and not value.startswith("#")]


@pytest.mark.thorough
def test_the_report_is_one_file_with_everything_in_it(done):
    text = (done / "report.html").read_text()
    page = Page()
    page.feed(text)
    assert page.tags.count("svg") == 2 * 2 + 2  # error and coverage of two cut-offs, the typical error, and cost
    assert not page.loads
    assert "script" not in page.tags
    summary = json.loads((done / "summary.json").read_text())
    for printed in ("Does it work?", "idbench run --from", "SeedSequence(0", "mujoco", "lines = ", *summary["parameters"]):
        assert printed in text
    assert summary["answer"].split(";")[0].split("(p")[0] in text


@pytest.mark.thorough
def test_the_recording_holds_every_error(done, undisturbed):
    """Dots of a parameter, back through the logarithmic axis: as many as runs, each at its size."""
    path = done / "recording.rrd"
    verified = subprocess.run(
        [rerun_cli.__path__[0] + "/rerun", "rrd", "verify", str(path)], capture_output=True, text=True, check=False
    )
    assert verified.returncode == 0, verified.stderr
    errors = [100 * abs(r["Fv2"] - 0.01) / 0.01 for r in undisturbed.to_pylist() if r["model"] == "power"]
    cutoffs = sorted({r["chain.operator.cutoff"] for r in undisturbed.to_pylist()})
    assert len(cutoffs) == 2
    chunks = RrdReader(path).stream().filter(content="/study/chain.operator.cutoff/parameters/06/Fv2/dots/**").to_chunks()
    of_power = [chunk for chunk in chunks if "_power_" in chunk.entity_path]
    batches = [chunk.to_record_batch() for chunk in of_power]
    places = np.concatenate([np.array(batch.column("Points2D:positions").to_pylist()[0]) for batch in batches])
    assert 0.9 * len(errors) <= len(places) <= len(errors)  # errors that are zero by chance lie below the axis
    up = np.sort(-places[:, 1])
    expected = np.sort(np.log10(errors))[-len(up) :]
    slope, offset = np.polyfit(expected, up, 1)
    np.testing.assert_allclose(up, slope * expected + offset, atol=1e-5)


@pytest.mark.thorough
def test_a_run_is_made_again_bit_for_bit(done, tmp_path, capfd):
    assert main(["run", "--from", str(done), "--index", "13", "--method", "1", "--out", str(tmp_path / "again")]) == 0
    assert "run 13 of" in capfd.readouterr().out.splitlines()[0]
    summary = json.loads((tmp_path / "again" / "summary.json").read_text())
    row = next(r for r in Store.open(done).rows_of(13) if r["model"] == "power" and r["chain.operator.cutoff"] == 5.0)
    assert summary["models"]["power"]["estimate"][0] == row["ZZR1"]
    assert summary["models"]["power"]["sigma"][0] == row["ZZR1.sigma"]
    assert summary["seed"] == row["seed"]


@pytest.fixture
def bare(monkeypatch):
    """Leave the figures of reports out: they take most of the time of a study of a second."""
    monkeypatch.setattr("idbench.experiments.study.study_results.report", lambda *args: "")


@pytest.mark.thorough
def test_an_interrupted_study_says_how_to_go_on(file, tmp_path, capfd, monkeypatch, undisturbed, bare):
    out, real = tmp_path / "out", Store.write

    def write(self, runs, shard):
        real(self, runs, shard)
        raise KeyboardInterrupt

    monkeypatch.setattr(Store, "write", write)
    assert main(["study", str(file), "--out", str(out), "--shard", "3", "--threads", "1"]) == 130
    assert f"3 of 18 runs are kept; go on with: uv run idbench study --resume {out}" in capfd.readouterr().err
    monkeypatch.setattr(Store, "write", real)
    assert main(["study", "--resume", str(out)]) == 0
    assert Store.open(out).table().equals(undisturbed)


def test_studies_are_listed(capfd):
    assert main(["study"]) == 0
    assert re.search(r"^encoder +How fine", capfd.readouterr().out, re.MULTILINE)


def test_number_of_seeds(file, tmp_path, bare):
    assert main(["study", str(file), "--seeds", "2", "--out", str(tmp_path / "out")]) == 0
    assert Store.open(tmp_path / "out").table().num_rows == 2 * 2 * 2 * 2


@pytest.mark.thorough
def test_a_thousand_million_runs_are_asked_for_twice(file, complaint, tmp_path, monkeypatch, bare):
    out = ("--out", str(tmp_path / "out"))
    printed = complaint("study", str(file), "--seeds", "1000000000", *out)
    assert "2,000,000,000 runs, more than 100,000: if you mean it, add --yes" in printed
    assert not (tmp_path / "out").exists()
    monkeypatch.setattr(study_job, "MANY", 3)
    assert "18 runs, more than 3" in complaint("study", str(file), *out)
    assert main(["study", str(file), "--yes", *out]) == 0


@pytest.mark.thorough
def test_wrong_calls(done, file, complaint):
    assert "holds this study already" in complaint("study", str(file), "--out", str(done))
    assert "holds another study" in complaint("study", str(file), "--seeds", "3", "--out", str(done))
    assert "leave out --seeds" in complaint("study", "--resume", str(done), "--seeds", "3")
    assert "--method 2 does not exist" in complaint("run", "--from", str(done), "--index", "1", "--method", "2")
    assert "run 18 does not exist" in complaint("run", "--from", str(done), "--index", "18")


@pytest.mark.thorough
def test_a_scheduler_may_be_anywhere(file, tmp_path, undisturbed, bare):
    """Its workers have no part in the folder: rows travel."""
    with LocalCluster(n_workers=1, threads_per_worker=2, host="127.0.0.1", dashboard_address="127.0.0.1:0") as cluster:
        scheduler = cluster.scheduler_address
        assert main(["study", str(file), "--scheduler", scheduler, "--out", str(tmp_path / "out")]) == 0
    assert Store.open(tmp_path / "out").table().equals(undisturbed)


def test_an_unreachable_scheduler_leaves_nothing(file, tmp_path, complaint, monkeypatch):
    monkeypatch.setattr("idbench.experiments.study.cluster.PATIENCE", 1.0)
    printed = complaint("study", str(file), "--scheduler", "tcp://127.0.0.1:9", "--out", str(tmp_path / "out"))
    assert "cannot reach the scheduler tcp://127.0.0.1:9" in printed
    assert not (tmp_path / "out").exists()


def test_without_dask_workers_are_refused_and_the_rest_works(file, tmp_path, complaint, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    assert "install the extra" in complaint("study", str(file), "--workers", "2", "--out", str(tmp_path / "out"))


def test_an_error_in_a_shard_is_not_taken_for_a_result(file, tmp_path, monkeypatch, capfd):
    """A mistake in the program is no reason in a row."""
    monkeypatch.setattr(engine, "run_shard", lambda *args, **kwargs: 1 / 0)
    assert main(["study", str(file), "--out", str(tmp_path / "out")]) == 1
    assert "a fault of idbench, not of your input (ZeroDivisionError: division by zero)" in capfd.readouterr().err


ODD = """
name = "odd"
question = "Is [/b] [red]fine?"
scenario = "ideal"
seeds = 2
models = ["power"]

[settings.trajectory]
kind = "random"
moves = 3
durations = [0.9, 0.9]
rest = 0.6
"""


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("axis", "failed"),
    [
        ('field = "torque.noise"\nvalues = [0.1, [0.1, 0.01]]', 0),
        ('field = "friction"\nvalues = [{kind = "coulomb"}, {kind = "stribeck"}]', 0),
        ('field = "origin"\nvalues = ["[/b]", "one"]', 0),
        ('field = "timing.jitter"\nvalues = [0.02, 0.03]', 4),
        ('field = "fs"\nvalues = [9.0, 100.0]', 2),
        ('field = "chain.mask.threshold"\nvalues = [0.1, 50.0]', 2),
        ('field = "friction.coulomb"\nvalues = [0.0, 1.0]', 0),
    ],
)
def test_odd_studies_end_in_a_report(tmp_path, axis, failed, capfd):
    """Values of several kinds, words that look like markup, runs that all fail, noise that nothing shows, a truth of 0."""
    (tmp_path / "odd.toml").write_text(f"{ODD}\n[[axes]]\n{axis}\n")
    code = main(["study", str(tmp_path / "odd.toml"), "--out", str(tmp_path / "out")])
    printed = capfd.readouterr()
    assert "Is [/b] [red]fine?" in printed.out
    assert ("\nfailed: " in printed.out) == bool(failed)
    assert code == (2 if failed == 4 else 0)
    assert ("no run of study odd gave an estimate: 2 times" in printed.err) == (failed == 4)
    cells = json.loads((tmp_path / "out" / "summary.json").read_text())["cells"]
    assert sum(sum(cell["failures"].values()) for cell in cells) == failed
    assert sum(cell["runs"] for cell in cells) + failed == 4
