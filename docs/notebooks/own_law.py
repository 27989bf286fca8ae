"""
# A friction law of your own

One class with one function. The same force is identified in all three models, simulated, and written into functions.
"""

from dataclasses import dataclass

import numpy as np

from idbench.identify import AbstractFriction


@dataclass(frozen=True)
class Drag(AbstractFriction):
    """Drag of a fan or of grease, Fq |qd| qd."""

    symbol = "Fq"
    unit = "N m s^2/rad^2"

    def force(self, q, qd):
        """Return |qd| qd."""
        return np.abs(qd) * qd


"""
## Simulate it

A scenario's friction of kind `law` takes the name of any law with one parameter a joint. An object has a name once a table
has it.
"""

from dataclasses import replace

import idbench
from idbench.identify import BLOCKS
from idbench.sim.frictions import Law

name = BLOCKS.name_of(Drag())
scenario = replace(idbench.load_scenario("quantization"), friction=Law(law=name, size=(0.3, 0.02)))
run = idbench.simulate(scenario, seed=1, add=name)
print({name: round(x, 3) for name, x in run.truth.items() if name.startswith("Fq")})

"""
## Identify it

`add` takes the object itself, too.
"""

fit = idbench.fit(run.log, run.robot, model="explicit", truth=run.truth)
for name, p in fit.parameters.items():
    if name.startswith("Fq"):
        print(f"{name} = {p.value:.3f} +- {p.sigma:.1g} {p.unit}, true {p.truth:.3f}")

"""
Without the law the same log is explained worse, and the verdict says so:
"""

print(idbench.fit(run.log, idbench.load_robot("scara"), model="explicit").verdict)

"""
## Write it

The expression of `force` stands in the function for a controller.
"""

from pathlib import Path
from tempfile import mkdtemp

path = Path(mkdtemp()) / "arm.py"
fit.write(path)
print("\n".join(line for line in path.read_text().splitlines() if "np.abs(qd) * qd" in line)[:120])
