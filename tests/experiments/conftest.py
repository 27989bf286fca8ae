"""What the tests of the command line share."""

import pytest

from experiments.cli import main


@pytest.fixture
def out(tmp_path):
    return tmp_path / "results"


@pytest.fixture
def complaint(capfd):
    """Run the command line on wrong input; return its one line of complaint."""

    def run(*args):
        capfd.readouterr()
        assert main(list(args)) == 2
        lines = capfd.readouterr().err.strip().splitlines()
        assert len(lines) == 1
        assert lines[0].startswith("idbench: ")
        return lines[0]

    return run
