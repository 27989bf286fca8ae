"""Tables of many joints: one model leads, the others have a line each; asked for, they are shown whole."""

from typing import NamedTuple

import numpy as np
import pytest

from idbench.experiments.reports.estimates import differing, models_apart


@pytest.mark.parametrize("asked", ["", "--model all", "--model power"])
def test_one_model_is_shown_if_no_other_is_asked_for(four_joints, asked, ran):
    log, robot = four_joints / "log.csv", four_joints / "arm.xml"
    out, _, summary = ran("identify", log, "--robot", robot, "--torque instantaneous", asked, "--no-rerun --out found")
    lines, names = out.splitlines(), summary["parameters"]
    rows = [line for line in lines if line.split() and line.split()[0] in names]
    assert len(rows) == (len(names) if "all" in asked else np.ceil(len(names) / 3))  # three parameters beside each other
    assert sum(line.count(" model") for line in lines if line.startswith("other models differ: ")) == (not asked)
    assert asked or len(lines) <= 32


def test_models_stand_apart_where_they_differ_or_nothing_is_known():
    class Estimate(NamedTuple):
        X: np.ndarray
        standard_errors: np.ndarray

    class Fit(NamedTuple):
        estimates: dict
        leading: str = "explicit"

    sigma, X = np.array([0.1, 0.2]), np.array([1.0, 2.0])
    others = {"implicit": Estimate(X + 1e-4 * sigma, sigma), "power": Estimate(X + sigma, sigma)}
    others["energy"] = Estimate(X + 4.0, np.array([0.1, np.nan]))
    fit = Fit({"explicit": Estimate(X, sigma)} | others)
    assert models_apart(fit) == ("explicit", "power", "energy")
    (line,) = differing(fit, ("explicit",))
    assert "implicit by less than 0.01 sigma, power by at most 0.7 sigma, energy by an unknown number of sigma" in line
