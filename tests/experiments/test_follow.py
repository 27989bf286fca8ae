"""A log is identified while it is being written."""

import threading
import time

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.identify.files.log_file import write_log

TORQUE = ["--torque", "instantaneous", "--torque-delay", "0"]


@pytest.fixture
def whole(table1, tmp_path):
    """The lines of a log of 46 s."""
    write_log(table1.log, tmp_path / "whole.csv")
    return (tmp_path / "whole.csv").read_text().splitlines(keepends=True)


@pytest.mark.thorough
def test_estimates_come_while_the_log_grows_and_the_last_is_of_all_of_it(whole, tmp_path, ran):
    path, pieces = tmp_path / "grows.csv", np.array_split(np.array(whole, dtype=object), 5)

    def write():
        with path.open("w") as file:
            for piece in pieces:
                text = "".join(piece)
                file.write(text[:-7])  # a line that is not complete yet
                file.flush()
                time.sleep(0.3)
                file.write(text[-7:])

    writer = threading.Thread(target=write)
    writer.start()
    words = ("identify", path, *TORQUE, "--model explicit")
    printed, told, _ = ran(*words, "--follow 4")
    writer.join()
    assert "8 of 8 parameters known to 10 %" in told
    assert f"following {path}" in told
    assert ran(*words).out == printed


def test_what_cannot_be_followed_is_refused(whole, tmp_path, capsys):
    path = tmp_path / "bad.csv"
    path.write_text("".join(whole[:1]).replace("q1", "x") + "".join(whole[1:]))
    for words, complaint in (
        ([str(path), *TORQUE, "--follow", "1"], f"{path}: 1 columns of positions and 2 of torques"),
        ([str(path), *TORQUE, "--follow", "0"], "--follow 0 must be above 0"),
        ([str(tmp_path / "log.parquet"), *TORQUE, "--follow", "1"], "only a CSV log"),
        ([str(tmp_path / "nothing.csv"), *TORQUE, "--follow", "0.1"], "nothing.csv"),
    ):
        assert main(["identify", *words]) == 2
        assert complaint in capsys.readouterr().err
