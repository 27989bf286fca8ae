"""`idbench log` and `idbench identify` understand a file in the same way, and ask for the same."""

import json

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.identification.reading import read
from idbench.experiments.requests.jobs import IdentifyRequest
from idbench.experiments.requests.shared import ColumnOptions

T = np.arange(0, 3, 0.004)
Q, TAU = np.stack([np.sin(2 * T), np.cos(3 * T)], axis=1), np.stack([9 * np.cos(T), 4 * np.sin(T)], axis=1)
NAMES = {
    "standard": "t,q1,q2,tau1,tau2",
    "joints": "t,q_lift,q_elbow,tau_lift,tau_elbow",
    "ros": "time,position_lift,position_elbow,effort_lift,effort_elbow",
    "currents": "time,position_lift,position_elbow,current_lift,current_elbow",
    "degrees": "timestamp [ms],pos1 [deg],pos2 [deg],torque1 [mNm],torque2 [mNm]",
    "counts": "time,encoder1,encoder2,torque1,torque2",
    "two groups": "time,joint_position_1,joint_position_2,motor_position_1,motor_position_2,effort_1,effort_2",
    "nameless": "",
}
OPTIONS = (
    {},
    {"gain": (2.0, 3.0)},
    {"units": ("tau=A",), "gain": (1.5,)},
    {"units": ("q=count:65536@100", "t=ms")},
    {"units": ("tau=permille:2.4",)},
    {"columns": ("q=joint_position_*",)},
)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("kind", NAMES)
def test_they_agree(kind, options, tmp_path, capsys):
    """Both read the same numbers, and what `log` doubts is what `identify` asks for."""
    columns = [T, *([Q.T[0], Q.T[1]] if kind != "two groups" else [*Q.T, *(100 * Q.T)]), *TAU.T]
    np.savetxt(tmp_path / "log.csv", np.stack(columns, axis=1), delimiter=",", header=NAMES[kind], comments="")
    if kind == "nameless":
        np.savetxt(tmp_path / "log.csv", np.stack(columns, axis=1), delimiter=",")
    words = [x for name, values in options.items() for x in (f"--{name}", *map(str, values))]
    code = main(["log", str(tmp_path / "log.csv"), *words, "--json"])
    out, err = capsys.readouterr()
    request = IdentifyRequest(torque="instantaneous", reading=ColumnOptions(**options))
    try:
        found = read(tmp_path / "log.csv", request, None)
    except ValueError as error:
        if code == 0:  # `log` shows what it can, and what it doubts
            doubts, said = json.loads(out)["doubts"], str(error)
            assert doubts or "a sample every" in said, said
            assert all(doubt in said for doubt in doubts)
        return
    assert code == 0, err
    rows = json.loads(out)["joints"]
    for j, row in enumerate(rows):
        np.testing.assert_allclose(row["q"], [found.logs[0].q[:, j].min(), found.logs[0].q[:, j].max()], rtol=1e-6, atol=1e-9)
        gained = found.logs[0].tau[:, j] * np.asarray(found.logs[0].torque.gain)
        np.testing.assert_allclose(row["tau"], [gained.min(), gained.max()], rtol=1e-6)
