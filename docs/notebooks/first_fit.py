"""
# A robot, a log, a fit

What `idbench identify` does, in a Python session: a log of an arm, its parameters with standard errors, a verdict on
held-out data, torques that are predicted, files for other software. It runs from top to bottom in a quarter of a minute.
"""

import idbench

run = idbench.simulate("ripple", seed=3)  # stands for the log of your robot: idbench.read_log("log.csv", torque="held")
run.log

"""
## The robot

`load_robot` takes an MJCF or a URDF file, or the name of a robot that ships. Which parameters can be identified depends
on the joints and on gravity; what is grouped with what is in the last column.
"""

robot = idbench.load_robot("scara")
robot

"""
## The fit

Without a held-out log the last quarter of the log is held out, and predicted by a fit of the rest. The verdict comes first.
"""

fit = idbench.fit(run.log, robot, model="explicit")
fit

"""
Every number has its unit and its standard error.
"""

Fv1 = fit.parameters["Fv1"]
print(f"{Fv1.name} = {Fv1.value:.4g} +- {Fv1.sigma:.1g} {Fv1.unit}")

"""
## Held-out data

Another motion of the same robot. The error of each joint is in N m and in per cent of its torque.
"""

other = idbench.simulate("brisk", seed=4)
fit.score(other.log)

"""
Torques of any motion, joints in the order of the robot:
"""

import numpy as np

still = np.zeros(len(robot.robot.joints))
print(fit.predict(still, still + 1.0, still).round(3))

"""
## Files

The ending says what is written: a robot, a function for a controller, a report.
"""

from pathlib import Path
from tempfile import mkdtemp

folder = Path(mkdtemp())
fit.write(folder / "arm.py", folder / "arm.json")
fit.report(folder / "report.html")
print(sorted(path.name for path in folder.iterdir()))
