"""The motions that the studies of excitation compare, and what is predicted of them.

    uv run python docs/build/motions.py [NAME ...]

Each is designed anew, written as a scenario that ships (excited/NAME), and its predicted sigmas are kept in docs/results, where
the pages' tables find them. Without names all are made, which takes some minutes.
"""

import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tomli_w
from scipy.stats import spearmanr

DOCS = Path(__file__).absolute().parent.parent
sys.path.insert(0, str(DOCS.parent))

from idbench.experiments.excite.design import Design  # noqa: E402
from idbench.experiments.excite.excited import Excited  # noqa: E402
from idbench.identify.design.criteria import CRITERIA as CRITERIA_OF_W  # noqa: E402
from idbench.identify.design.criteria import sigmas_of  # noqa: E402
from idbench.sim.encoders import IncrementalEncoder  # noqa: E402
from idbench.sim.limits.motion_limits import MotionLimits  # noqa: E402
from idbench.sim.scenario.measurement import TorqueMeasurement  # noqa: E402
from idbench.sim.scenario.scenario_file import FOLDER, load, to_dict  # noqa: E402

PREDICTED = DOCS / "results" / "excitation-motions.json"
RANKS = DOCS / "results" / "excitation-ranks.json"
ROBOTS = ("scara", "puma560", "panda")
CRITERIA = ("sigma", "determinant", "smallest", "birdy", "condition")


@dataclass(frozen=True)
class Asked:
    """What one of the motions is designed for."""

    robot: str = "scara"
    criterion: str = "sigma"
    kind: str = "fourier"
    duration: float = 10.0
    frequency: float = 1.0
    bits: float = 17.0
    velocity: tuple[float, ...] | None = None

    @property
    def design(self) -> Design:
        """The design."""
        noisy = replace(
            load("ideal"),
            fs=100.0,
            encoder=IncrementalEncoder(lines=(round(2**self.bits / 4),)),
            torque=TorqueMeasurement(noise=(0.05,)),
        )
        limits = MotionLimits(velocity=self.velocity)
        return Design(self.robot, noisy, self.kind, self.duration, self.frequency, limits, criterion=self.criterion)


def asked() -> Iterator[tuple[str, Asked]]:
    """Yield the motions by name."""
    for robot in ROBOTS:
        for criterion in CRITERIA:
            yield f"{robot}-{criterion}", Asked(robot, criterion)
        yield f"{robot}-moves", Asked(robot, kind="moves")
    for duration in (5, 20, 40):
        yield f"scara-{duration}s", Asked(duration=float(duration))
    for tenths in (3, 5, 15, 20):
        yield f"scara-{tenths / 10:g}Hz".replace(".", "p"), Asked(frequency=tenths / 10)
    yield "scara-12bits", Asked(bits=12.0)
    yield "scara-slow", Asked(velocity=(2.0, 2.0))


def main(names: list[str]) -> None:
    """Design motions, write them, and keep what is predicted of them."""
    if not names or "ranks" in names:
        RANKS.write_text(json.dumps({robot: ranks(robot) for robot in ROBOTS}, indent=1) + "\n")
    kept: dict[str, dict[str, object]] = json.loads(PREDICTED.read_text()) if PREDICTED.is_file() else {}
    for name, wanted in asked():
        if names and name not in names:
            continue
        found = Excited.of(wanted.design)
        _write(name, found)
        kept[name] = _predicted(found)
        if wanted == Asked(wanted.robot):
            median = found.random[int(np.argsort(found.typical[1:])[len(found.random) // 2])]
            random = replace(found, c=median)
            _write(f"{wanted.robot}-random", random)
            kept[f"{wanted.robot}-random"] = _predicted(random)
        print(name, round(found.ratios[0], 3), round(found.condition, 1), flush=True)
        PREDICTED.write_text("{\n" + ",\n".join(f'"{key}": {json.dumps(kept[key])}' for key in sorted(kept)) + "\n}\n")


RANKED, STRONGEST = 120, 5.0
"""Random motions whose order by each criterion is compared, and the most by which they are made smaller."""


def ranks(robot: str) -> dict[str, tuple[float, float]]:
    """Return the rank correlation of criteria with the typical sigma over random motions, and what the best by each is worth.

    That is its typical sigma over the least of all. Motions are as they come, or slower, or smaller.
    """
    design = Asked(robot).design
    rng, plan = np.random.default_rng(1), design.plan
    drawn = [design.excitation.random(rng, plan, design.duration, design.frequency) for _ in range(RANKED)]
    motions = [plan.motion(c / STRONGEST ** rng.uniform(0, 2)) for c in drawn]
    columns = [plan.information.columns(motion) * plan.information.weight(motion)[..., None] for motion in motions]
    typical = np.array([float(design.sigma_criterion.value(plan.information.matrix(W))) for W in columns])
    found = {}
    for name, criterion in CRITERIA_OF_W.items():
        matrices = [plan.information.matrix(W) if criterion.noise else np.tensordot(W, W, ((0, 1), (0, 1))) for W in columns]
        values = np.array([float(criterion.value(M)) for M in matrices])
        pick = float(np.exp(typical[values.argmin()] - typical.min()))
        found[name] = (round(float(spearmanr(values, typical).statistic), 3), round(pick, 3))
    return found


def _write(name: str, found: Excited) -> None:
    scenario = to_dict(found.scenario)
    short: Mapping[str, object] = {
        "name": f"excited {name}",
        "origin": found.scenario.origin,
        "robot": Path(found.design.robot).stem,
        "trajectory": scenario["trajectory"],
    }
    (FOLDER / "excited").mkdir(exist_ok=True)
    (FOLDER / "excited" / f"{name}.toml").write_text(tomli_w.dumps(short))


def _predicted(found: Excited) -> dict[str, object]:
    """Return predicted relative sigmas [%] with encoders of several resolutions, and Cond(W)."""
    d, each = found.design, dict[str, list[float | None]]()
    for bits in (12, 14, 17, 24):
        noisy = replace(d.scenario, encoder=IncrementalEncoder(lines=(2 ** (bits - 2),)))
        sigma = sigmas_of(replace(d, scenario=noisy, criterion="sigma").information([found.c]))[0]
        each[str(bits)] = [float(f"{100 * s / abs(x):.4g}") if x else None for s, x in zip(sigma, d.X, strict=True)]
    return {"condition": float(f"{found.condition:.4g}"), "sigma_percent": each}


if __name__ == "__main__":
    main(sys.argv[1:])
