"""The command line loads what a command uses: what asks for nothing else is there at once."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify.files.log_file import write_log
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import RandomMoves

HEAVY = {"numpy", "scipy", "mujoco", "pydantic", "pyarrow", "rerun", "matplotlib", "idbench.identify", "idbench.sim"}


@pytest.mark.parametrize(
    "words", [["--help"], ["identify", "--help"], ["tabel1"], ["run", "--sed", "3"], ["--version"]], ids=" ".join
)
def test_help_and_wrong_words_load_nothing_heavy(start, words):
    code = "import sys; from idbench.experiments.cli import main\n"
    code += f"try: main({words})\nexcept SystemExit: pass\n"
    code += "names = [name.split('.') for name in sys.modules]\n"
    code += "print('loaded', *{'.'.join(name[: 1 + (name[0] == 'idbench')]) for name in names})"
    out, err = start("-c", code).communicate()
    loaded = set(out.splitlines()[-1].split()[1:])
    assert "idbench.experiments" in loaded, err
    assert not loaded & HEAVY


def test_the_list_of_plugins_loads_neither_scipys_parts_nor_figures(start):
    code = "import sys; from idbench.experiments.cli import main\nmain(['list'])\nprint('loaded', *sys.modules)"
    out, _ = start("-c", code).communicate()
    loaded = set(out.splitlines()[-1].split())
    assert not loaded & {"scipy.signal", "scipy.stats", "scipy.optimize", "matplotlib", "rerun", "pyarrow"}


def test_a_table_loads_scipys_filters_and_no_figures(start, tmp_path):
    """Chain paper has Butterworth's filters, and nothing else needs SciPy's distributions or servos."""
    code = "import sys; from idbench.experiments.cli import main\nmain(['table1', '--no-rerun'])\nprint('loaded', *sys.modules)"
    out, err = start("-c", code, cwd=tmp_path).communicate()
    loaded = set(out.splitlines()[-1].split())
    assert "scipy.signal" in loaded, err
    assert not loaded & {"matplotlib", "idbench.identify.servo"}


@pytest.mark.parametrize(
    ("words", "most"),
    [
        (["identify", "log.parquet", "--robot", "puma560", "--no-rerun", "--model", "explicit"], 1400),
        (["identify", "log.parquet", "--robot", "puma560", "--model", "explicit", "--out", "found"], 1750),
        (["run", "ideal", "--no-rerun"], 1150),
        (["robot", "puma560"], 1020),
    ],
    ids=lambda words: " ".join((words[0], *words[6:])) if isinstance(words, list) else "",
)
def test_fits_and_runs_load_no_more_than_they_use(start, tmp_path, words, most):
    """SciPy's filters and distributions take half a second, figures a third; a tenth more than now is the most."""
    robot = Robot.load("puma560")
    moves = RandomMoves(moves=6, durations=(0.8, 1.2), velocity=(2.0,), rest=0.2).sample(robot, 200.0)
    log = ideal_log(robot, moves)
    write_log(replace(log, tau=log.tau + np.random.default_rng(0).normal(size=log.tau.shape)), tmp_path / "log.parquet")
    code = f"import sys; from idbench.experiments.cli import main\nmain({words})\nprint('loaded', *sys.modules)"
    out, err = start("-c", code, cwd=tmp_path).communicate()
    loaded = set(out.splitlines()[-1].split())
    assert "idbench.sim" in loaded, err
    assert not loaded & {"scipy.signal", "scipy.stats", "matplotlib"}
    assert ("rerun" in loaded) == ("--out" in words)
    assert len(loaded) < most
