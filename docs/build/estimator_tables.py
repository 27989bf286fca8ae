"""Tables of the studies that compare estimators."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import log2
from pathlib import Path
from typing import Any

import numpy as np
from results import Cell, cells, table, typical

NOISES = {"0.0": 0.0, "[0.01, 0.001]": 0.01, "[0.1, 0.01]": 0.1}
"""Torque noise of joint 1 in the study of estimators, as its cells have it."""

Key = tuple[float, ...]

SCARA: Mapping[Key, str] = {
    (bits, noise): f"{bits} bits, {noise:g} N m"
    for bits, noise in ((10, 0.01), (12, 0.01), (14, 0.01), (16, 0.0), (16, 0.01), (16, 0.1), (18, 0.0))
}
"""Encoder bits and torque noise that the tables have."""

PUMA: Mapping[Key, str] = {(1.75e-6,): "1.75e-6 rad", (1.75e-5,): "1.75e-5 rad", (1.75e-4,): "1.75e-4 rad"}
"""Noises of the positions of the study on six joints."""


def _of_scara(settings: dict[str, Any]) -> Key:
    return log2(4 * settings["encoder.lines"]), NOISES[str(settings["torque.noise"])]


def _of_puma(settings: dict[str, Any]) -> Key:
    return (settings["encoder.noise"],)


def compared(chain: str) -> Callable[[], Iterator[str]]:
    """Return what makes the table of estimators behind a chain, over encoders and noises of the torque."""
    return lambda: _compared([c for c in cells("estimators") if c["chain"] == chain], _of_scara, SCARA)


def compared_in_birdys_shape() -> Iterator[str]:
    """Yield the table of estimators on six joints, over noises of the positions."""
    return _compared(cells("estimators-puma560"), _of_puma, PUMA)


PICTURED = {"encoder.lines": 4096.0, "torque.noise": "[0.01, 0.001]"}
"""Settings of the picture: 14 bits, 0.01 N m."""


def picture(place: Path) -> None:
    """Draw mean and standard deviation of every parameter's error by each estimator, from what is kept of the study."""
    from idbench.experiments.identification.robot_model import RobotModel
    from idbench.experiments.study.figures import bars

    found = [c for c in cells("estimators") if c["settings"] == PICTURED and c["chain"] == "idbench"]
    mean, rms, least = (np.array([c[f"{x}_percent"] for c in found]) for x in ("bias", "rmse", "bound"))
    runs = np.array([c["runs"] for c in found])[:, None]
    spread = np.sqrt(np.maximum(rms**2 - mean**2, 0) * runs / (runs - 1))  # of a sample, as the study's report has it
    names, parameters = [c["estimator"] for c in found], RobotModel("scara").basis.names
    bars(names, parameters, mean, spread, least, runs=int(runs.max())).savefig(place, dpi=100)


def _compared(found: Sequence[Cell], key_of: Callable[[dict[str, Any]], Key], heads: Mapping[Key, str]) -> Iterator[str]:
    mine: dict[str, dict[Key, Cell]] = {}
    for cell in found:
        mine.setdefault(cell["estimator"], {})[key_of(cell["settings"])] = cell

    def rows() -> Iterator[Sequence[str]]:
        # The bound is that of all estimators: any that has an estimate says it.
        solved = [next(group[key] for group in mine.values() if group[key]["runs"]) for key in heads]
        yield ["bound", *(typical({"rmse_percent": cell["bound_percent"]}) for cell in solved), "", "", ""]
        for name, group in mine.items():
            errors = [typical(group[key]) if group[key]["runs"] else "-" for key in heads]
            yield [name, *errors, *_told(list(group.values()))]

    return table(["", *heads.values(), "within 2 sigma [%]", "failed", "simulations"], rows())


def _told(group: Sequence[Cell]) -> Sequence[str]:
    """Return coverage, failures and most simulations of an estimator, over all that it was tried on."""
    solved = [cell for cell in group if cell["runs"]]
    shares = [100 * x for cell in solved for x in cell["coverage"]]
    failed = sum(sum(cell["failures"].values()) for cell in group)
    often = max((cell["simulations"] for cell in solved), default=0.0)
    every = failed + sum(cell["runs"] for cell in group)
    return [f"{sum(shares) / len(shares):.0f}", f"{failed} of {every}", f"{often:.0f}" if often else ""]
