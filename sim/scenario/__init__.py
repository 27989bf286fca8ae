"""What is simulated: the settings of a scenario, and its file."""

from idbench.sim.scenario.scenario import Timing as Timing
