"""One law of friction: what is identified can be simulated, and written, by the same force; laws of one's own, too."""

from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np
import pytest

import idbench
from idbench.identify import BLOCKS, AbstractFriction, NoMask, ShapedFriction, idbench_chain
from idbench.sim.frictions import Law
from idbench.sim.trajectories import RandomMoves


@final
@dataclass(frozen=True)
class Square(AbstractFriction):
    """Friction of air, Fq |qd| qd."""

    symbol: ClassVar[str] = "Fq"
    unit: ClassVar[str] = "N m s^2/rad^2"

    power: float = 2.0

    def force(self, q, qd):
        """Return |qd|^power sign(qd)."""
        del q
        return np.abs(qd) ** self.power * np.sign(qd)


def laws():
    """Return the laws of the table with one parameter a joint, but for those that every robot has, by name."""
    made = {name: BLOCKS.create(name) for name in BLOCKS.builtin}
    found = {name: block.law if isinstance(block, ShapedFriction) else block for name, block in made.items()}
    return {name: law for name, law in found.items() if isinstance(law, AbstractFriction) and law.symbol not in ("Fv", "Fs")}


@pytest.mark.parametrize("name", [*laws(), Square()], ids=str)
def test_what_is_simulated_is_identified(name):
    """Without noise, the errors are those of held torques and of the low-pass."""
    name = BLOCKS.name_of(name)
    scenario = idbench.load_scenario("ideal")
    moves = RandomMoves(moves=12, durations=(0.6, 1.2), rest=0.1, seed=1)
    wide = {"vs": 0.8} if name.startswith("stribeck") else {}  # seen above the filter's band, which ends at 5 Hz
    size, chain = (0.3, 0.05), replace(idbench_chain(), mask=NoMask())  # slow motion is what some laws are about
    made = replace(scenario, trajectory=moves, friction=Law(law=name, size=size, settings=wide, coulomb=(0.0, 0.0)))
    run = idbench.simulate(made, friction=f"viscous+{name}")
    symbol = made.friction._force.symbol
    found = idbench.fit(run.log, run.robot, model="explicit", estimator="OLS", chain=chain)
    for j, true in enumerate(size):
        assert run.truth[f"{symbol}{j + 1}"] == pytest.approx(true)
        # A tenth: the low-pass rounds what laws with a jump do at reversals; without one the rest is a thousandth.
        assert found.parameters[f"{symbol}{j + 1}"].value == pytest.approx(true, rel=0.1)
