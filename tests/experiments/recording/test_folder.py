"""Recordings on disk: layers laid over each other, one file of them all."""

import shutil

import numpy as np
import pytest
from rerun.chunk import RrdReader

from idbench.experiments.cli import main
from idbench.experiments.errors import ResultsError
from idbench.experiments.recording.folder import files, known, merge
from idbench.experiments.recording.run_layouts import friction
from idbench.experiments.recording.stream import parts
from idbench.experiments.recording.views import Shelf


@pytest.fixture
def copied(recorded, tmp_path):
    """Return a results folder that may be changed."""
    from idbench.experiments.results.folder import ResultsFolder
    from idbench.experiments.results.writing import write_summary
    from idbench.identify.files.log_file import write_log

    folder = ResultsFolder(tmp_path / "run", "run", "idbench run short")
    with folder.held(), folder.complete() as hidden:
        shutil.copytree(recorded.folder, hidden, dirs_exist_ok=True)
        write_log(recorded.ran.run.alone(), hidden / "log.parquet")
        write_summary(hidden / "summary.json", recorded.ran.summary())
    return folder.out


@pytest.mark.thorough
def test_identify_adds_a_layer_to_a_run_and_replaces_one_of_the_same_name(copied, reading, capsys, recorded):
    before = (copied / "recording.rrd").read_bytes()
    layer = "identify", str(copied), "--label", "second"
    assert main([*layer, "--estimator", "OLS"]) == 0
    assert main([*layer, "--estimator", "GLS"]) == 2
    assert "holds the layer 'second' of `uv run idbench identify" in capsys.readouterr().err
    assert main([*layer, "--estimator", "GLS", "--force"]) == 0
    assert "added to the recording" in capsys.readouterr().out
    assert (copied / "recording.rrd").read_bytes() == before
    assert len(files(copied)) == 4
    name, there = known(files(copied))
    assert name == recorded.streams[0][1].name
    assert {"identify/second/power/residual/power", "identify/idbench-GLS/power/residual/power"} <= there
    _, mine = reading.column(copied / "recording.second.rrd", "identify/second/power/residual/power")
    theirs = recorded.column("identify/idbench-GLS/power/residual/power", file="recording.idbench-GLS.rrd")[1]
    np.testing.assert_array_equal(mine, theirs)


def test_a_layer_knows_the_truth_of_its_run(copied, reading):
    assert main(["identify", str(copied), "--label", "second"]) == 0
    ns, value = reading.column(copied / "recording.second.rrd", "truth/ZZR1")
    assert (value == 3.5).all()
    assert ns[0] == 0


def test_every_layer_lays_out_the_others_too(copied):
    assert main(["identify", str(copied), "--label", "second"]) == 0
    shown = {path.name: str(RrdReader(path).store(store=RrdReader(path).blueprints()[0]).summary()) for path in layers(copied)}
    assert set(shown) == {"recording.idbench-GLS.rrd", "recording.second.rrd"}
    sizes = {name: len(text.splitlines()) for name, text in shown.items()}
    assert len(set(sizes.values())) == 1  # the same views in both


def layers(folder):
    return [path for path in files(folder) if path.name not in ("recording.rrd", "recording.inner.rrd")]


def test_one_file_holds_everything(copied, reading):
    one = copied / "one.rrd"
    assert main(["view", str(copied), "--tab", "friction", "--save", str(one)]) == 0
    assert reading.entities(one) == known(files(copied))[1]
    for path, file in (("q/true", "recording.rrd"), ("inner/voltage", "recording.inner.rrd")):
        for mine, theirs in zip(reading.column(one, path), reading.column(copied / file, path), strict=True):
            np.testing.assert_array_equal(mine, theirs)
    assert len(RrdReader(one).recordings()) == len(RrdReader(one).blueprints()) == 1
    reading.verify(one)


@pytest.mark.thorough
def test_what_is_wrong_is_told(copied, tmp_path, complaint):
    assert "no tab 'frictoin'; it has result, overview, friction, drive, filters, noise, excitation, parameters" in complaint(
        "view", str(copied), "--tab", "frictoin", "--save", str(tmp_path / "x.rrd")
    )
    assert "must end with .rrd" in complaint("view", str(copied), "--save", str(tmp_path / "x.png"))
    for label in ("a/b", "inner", "..", "-x"):
        assert f"--label {label!r} must be of letters" in complaint("identify", str(copied), f"--label={label}")
    assert "would be a part of the recording" in complaint("view", str(copied), "--save", str(copied / "recording.all.rrd"))
    (copied / "recording.rrd").write_bytes(b"nonsense")
    assert "cannot read the recording" in complaint("identify", str(copied), "--label", "second")
    (copied / "recording.rrd").unlink()
    assert "there is no recording.rrd in" in complaint("identify", str(copied), "--label", "second")
    (copied / "summary.json").write_text('{"parameters": ["ZZR1"], "truth": [1, 2]}')
    assert "is no summary of a run" in complaint("identify", str(copied))
    (copied / "summary.json").write_text("{")
    assert "is no summary of a run" in complaint("identify", str(copied))
    (copied / "log.parquet").unlink()
    assert "there is no log.parquet in" in complaint("identify", str(copied))


def test_files_of_two_recordings_are_not_mixed(copied, table1, tmp_path):
    from idbench.experiments.recording.comparison_recording import record_table1

    name, stream = record_table1(table1)[0]
    stream.write(tmp_path / name)
    with pytest.raises(ResultsError, match="hold 2 recordings"):
        merge([copied / "recording.rrd", tmp_path / name], "", tmp_path / "x.rrd")


def test_a_full_disk_leaves_the_layers_that_were_there(copied, complaint, monkeypatch):
    before = {path.name: path.read_bytes() for path in copied.iterdir()}

    def full(path, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    assert "No space left on device" in complaint("identify", str(copied), "--label", "second")
    assert {path.name: path.read_bytes() for path in copied.iterdir()} == before


def test_a_run_and_a_study_of_one_name_do_not_share_a_folder(tmp_path, complaint, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for file, command, printed in (("study.toml", "run", "holds a study"), ("scenario.toml", "study", "holds a run")):
        (tmp_path / "runs" / "ripple").mkdir(parents=True, exist_ok=True)
        (tmp_path / "runs" / "ripple" / file).write_text("")
        assert f"runs/ripple {printed}: choose another --out" in complaint(command, "ripple")
        (tmp_path / "runs" / "ripple" / file).unlink()


def test_joints_come_in_the_order_of_the_robot():
    """Not in that of their names: elbow is the third."""
    names = ["shoulder", "upper", "elbow", "wrist"]
    there = {f"joints/{k:03}/{name}" for k, name in enumerate(names)}
    there |= {f"identify/one/over_velocity/{name}/frame" for name in names} | {"identify/one/report"}
    there |= {f"identify/one/explicit/estimate/F{kind}{k + 1}" for kind in "vs" for k in range(4)}
    pages = friction(Shelf(there))
    assert [page.name for page in pages.contents] == names
    shown = [view.name for view in pages.contents[2].contents[1].contents]
    assert shown == ["Fv3 [N m s/rad]", "Fs3 [N m]"]


def test_names_that_make_the_same_path_stay_apart():
    assert parts(["lift/z", "lift z", "turn"]) == ["lift_z", "lift_z.2", "turn"]
