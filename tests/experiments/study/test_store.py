"""The folder of a study: what it refuses, and what survives."""

from dataclasses import replace

import pyarrow.parquet as pq
import pytest

from idbench.experiments.errors import ResultsError, StudyError
from idbench.experiments.study import cluster as module
from idbench.experiments.study.shard import Shard, run_shard
from idbench.experiments.study.store import Store


@pytest.fixture(scope="module")
def some(small):
    """Its runs 3 to 5 and 9 to 17."""
    return {runs: run_shard(small, runs) for runs in (range(3, 6), range(9, 18))}


@pytest.fixture
def begun(small, some, tmp_path):
    """A study with these runs."""
    store = Store.new(small, tmp_path / "out")
    with store.held():
        for runs, shard in some.items():
            store.write(runs, shard)
    return store


@pytest.mark.thorough
def test_only_what_is_missing_is_run_and_no_shard_mixes_combinations(begun):
    assert list(begun.missing(2)) == [range(2), range(2, 3), range(6, 8), range(8, 9)]
    assert list(begun.missing(64)) == [range(3), range(6, 9)]


def test_nothing_is_missing_of_nothing(small, tmp_path):
    assert list(Store.new(small, tmp_path).missing(64)) == [range(9), range(9, 18)]


def test_what_is_written_beside_is_no_shard(begun):
    (begun.folder / "shards" / ".runs-0000000000-0000000002.parquet.123").write_bytes(b"half")
    assert len(Store.open(begun.folder).shards()) == 2


def test_a_folder_of_this_study_is_gone_on_with(begun, small):
    with pytest.raises(StudyError, match=r"holds this study already: go on with .* --resume"):
        Store.new(small, begun.folder)


def test_a_folder_of_another_study_is_refused(begun, small):
    with pytest.raises(StudyError, match="holds another study, or this one before it was changed"):
        Store.new(replace(small, seeds=3), begun.folder)


def test_shards_without_a_description_are_refused(begun, small):
    (begun.folder / "study.toml").unlink()
    with pytest.raises(StudyError, match=r"no study\.toml"):
        Store.open(begun.folder)
    with pytest.raises(StudyError, match=r"holds shards but no study\.toml"):
        Store.new(small, begun.folder)


def test_a_description_that_was_changed_is_refused(begun):
    file = begun.folder / "study.toml"
    file.write_text(file.read_text().replace("seeds = 9", "seeds = 10"))
    with pytest.raises(StudyError, match=r"study\.toml was changed since runs-0000000003-0000000005\.parquet was made"):
        Store.open(begun.folder)


def test_other_versions_are_refused(begun, monkeypatch):
    now = module.versions()
    monkeypatch.setattr(module, "versions", lambda: now | {"numpy": "3.0"})
    with pytest.raises(StudyError, match=r"the maker of runs-.* has numpy .* \(here 3\.0\)"):
        Store.open(begun.folder)


def test_a_damaged_shard_is_named(begun):
    begun.shards()[0].write_bytes(b"PAR1 no")
    with pytest.raises(StudyError, match=r"runs-0000000003-0000000005\.parquet is damaged .*remove it"):
        Store.open(begun.folder)


def test_two_processes_do_not_share_a_folder(begun):
    with begun.held(), pytest.raises(StudyError, match="another process is running the study"), begun.held():
        pass


def test_a_study_that_came_into_the_folder_meanwhile_is_noticed(small, tmp_path):
    """Both have looked, and found it empty; one begins."""
    one, other = Store.new(small, tmp_path / "out"), Store.new(replace(small, seeds=3), tmp_path / "out")
    with one.held():
        pass
    with pytest.raises(StudyError, match="holds another study"), other.held():
        pass


def test_what_a_killed_process_left_half_written_goes(begun):
    half = begun.folder / "shards" / ".runs-0000000000-0000000002.parquet.123"
    half.write_bytes(b"half")
    with begun.held():
        assert not half.exists()


def test_a_folder_that_cannot_be_written_is_told(small, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultsError, match="cannot write to"), Store.new(small, tmp_path / "file" / "out").held():
        pass


def test_shards_of_the_same_runs_and_of_other_names_are_refused(begun):
    shards = begun.folder / "shards"
    copy = shards / "runs-0000000003-0000000005 (copy).parquet"
    copy.write_bytes(begun.shards()[0].read_bytes())
    with pytest.raises(StudyError, match="is not the name of a shard: remove it"):
        Store.open(begun.folder)
    copy.rename(shards / "runs-0000000004-0000000006.parquet")
    with pytest.raises(StudyError, match="hold the same runs: remove one"):
        Store.open(begun.folder)
    (shards / "runs-0000000004-0000000006.parquet").rename(shards / "runs-0000000006-0000000009.parquet")
    with pytest.raises(StudyError, match="has 12 rows, its name and the study say 16"):
        Store.open(begun.folder)


def test_a_shard_with_damaged_pages_is_named(begun):
    """The footer, which is looked at first, is whole."""
    path = begun.shards()[0]
    data = bytearray(path.read_bytes())
    data[4:400] = bytes(396)
    path.write_bytes(bytes(data))
    with pytest.raises(StudyError, match=r"is damaged .*remove it"):
        Store.open(begun.folder).table()


def test_a_full_disk_keeps_the_finished_shards(begun, small, monkeypatch):
    def full(*args):
        raise OSError(28, "No space left on device")

    shard = run_shard(small, range(3))
    monkeypatch.setattr(pq, "write_table", full)
    with pytest.raises(ResultsError, match=r"No space left on device; make room and go on with --resume"):
        begun.write(range(3), shard)
    assert len(list((begun.folder / "shards").iterdir())) == 2


def test_every_shard_has_the_same_columns_even_if_all_its_runs_failed(small, tmp_path):
    store = Store.new(small, tmp_path / "out")
    (store.folder / "shards").mkdir(parents=True)
    common = {"seed": 1, "encoder.lines": 2048, "chain.operator.cutoff": 4.0, "chain": "a", "estimator": "b", "model": "c"}
    store.write(range(1), Shard([{"run": 0, **common, "failure": "why"}]))
    store.write(range(1, 3), run_shard(small, range(1, 3)))
    assert store.table().num_rows == 1 + 2 * 4
    assert store.rows_of(0)[0]["ZZR1"] is None
