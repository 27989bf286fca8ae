"""
# Identify your arm

From a robot's file and a log to parameters, a verdict, and a look at the residuals. Put your own file and log in the
first two cells. As it stands it simulates a PUMA 560, so that the truth is known.
"""

from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree

robot = Robot.load("puma560")  # or the path of an MJCF or URDF file
tree = kinematic_tree(robot)
print(f"{robot.name}: {', '.join(robot.joints)}")

"""
## A log

Positions [rad] and torques [N m] at the joints, and what a torque sample means. Here the torque is a controller's command,
held for a period. Of a file: `read_log(Path("log.csv"), TorqueChannel("held", delay=0.001))`.
"""

from dataclasses import replace

from idbench.sim.engine import simulate
from idbench.sim.scenario.scenario_file import load

scenario = replace(load("arm"), robot="puma560", fs=500.0)
scenario = replace(scenario, trajectory=replace(scenario.trajectory, moves=15))
run = simulate(scenario)
log = run.alone()
print(
    f"{log.samples / log.fs:.0f} s at {log.fs:g} Hz; the torque is {log.torque.meaning}, {1e3 * log.torque.delay:.2f} ms late"
)

"""
## What can be identified

Not all ten parameters of every link are identifiable. *Base parameters* are their identifiable combinations.
"""

from idbench.identify import BaseParameters, tree_basis

base = BaseParameters.of(tree, tree_basis(tree))
print(f"{len(base.names)} base parameters; one of them: {base.names[3]} = {base.grouping(3)}")

"""
## Identify

`GLS` weighs every row by the noise that encoders and torques give it. The noise is found in the log.
"""

from idbench.identify import ExplicitModel, GeneralizedLeastSquares, identify

estimate = identify(log, base.basis, ExplicitModel(), estimator=GeneralizedLeastSquares())
weak = [name for name, share in zip(estimate.names, estimate.paper_sigma_percent) if share > 20]
print(f"Cond(W) = {estimate.condition_number:.0f}; {len(estimate.names) - len(weak)} parameters known to 20 %")
print("torque noise found [N m]:", estimate.noise_levels.torque.round(4))

"""
A parameter that is known to worse than 20 % hardly shows in this motion. Most of these are tiny: the wrist weighs grams
behind rotors of 0.2 kg m².

## Is it any good?

Validate it on held-out data: three quarters of the log are fitted, the last quarter is predicted.
"""

from idbench.identify import Problem, split, validate

first, last = split(log)
fitted = identify(first, base.basis, ExplicitModel(), estimator=GeneralizedLeastSquares())
judged = validate(Problem((last,), base.basis, ExplicitModel(), estimate.problem.chain), fitted.X)
for joint, percent in zip(robot.joints, judged.percent):
    print(f"{joint:8} torque predicted to {percent:.2g} %")

"""
The command line does all of this in one line, says what to mend, and records it:

    idbench identify log.csv --robot arm.xml --torque held --torque-delay estimate --out runs/mine
    idbench view runs/mine
"""
