"""What is simulated: the settings of a scenario, and its file."""

from sim.scenario.scenario import Physics as Physics
from sim.scenario.scenario import Scenario as Scenario
from sim.scenario.scenario import Timing as Timing
