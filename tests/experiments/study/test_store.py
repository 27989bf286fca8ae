"""The folder of a study: what it refuses, and what survives."""

import pyarrow.parquet as pq
import pytest

from experiments.errors import ResultsError, StudyError
from experiments.study import store as module
from experiments.study.shard import Shard, run_shard
from experiments.study.store import Store


@pytest.fixture
def begun(small, tmp_path):
    """A study with its runs 3 to 5 and 9 to 17."""
    store = Store.new(small, tmp_path / "out")
    store.begin()
    for runs in (range(3, 6), range(9, 18)):
        store.write(runs, run_shard(small, runs))
    return store


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
        Store.new(small.with_seeds(3), begun.folder)


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
    with begun.locked(), pytest.raises(StudyError, match="another process is running the study"), begun.locked():
        pass


def test_a_full_disk_keeps_the_finished_shards(begun, small, monkeypatch):
    def full(*args):
        raise OSError(28, "No space left on device")

    shard = run_shard(small, range(3))
    monkeypatch.setattr(pq, "write_table", full)
    with pytest.raises(ResultsError, match=r"No space left on device; make room and go on: .* --resume"):
        begun.write(range(3), shard)
    assert len(list((begun.folder / "shards").iterdir())) == 2


def test_every_shard_has_the_same_columns_even_if_all_its_runs_failed(small, tmp_path):
    store = Store.new(small, tmp_path / "out")
    store.begin()
    common = {"seed": 1, "encoder.lines": 2048, "chain.operator.cutoff": 4.0, "chain": "a", "estimator": "b", "model": "c"}
    store.write(range(1), Shard([{"run": 0, **common, "failure": "why"}]))
    store.write(range(1, 3), run_shard(small, range(1, 3)))
    assert store.table().num_rows == 1 + 2 * 4
    assert store.rows_of(0)[0]["ZZR1"] is None
