"""Turn the runs of the bench, JSON files of a folder, into logs, their robots and servo.toml."""

import json
import sys
from itertools import count
from pathlib import Path

ROBOT = """<mujoco model="{name}">
  <worldbody>
    <body name="arm">
      <joint name="axis" axis="0 -1 0"/>
      <inertial pos="0 0 -{length}" mass="{mass}" diaginertia="1e-6 1e-6 1e-6"/>
    </body>
  </worldbody>
</mujoco>
"""

SERVO = """# 12 V; its gain and its largest duty were measured on the bench with an oscilloscope.
gain = 0.166
duty_limit = 0.97
counts = 4096
supply = 12.0
kp = 16
"""


def main(folder: Path) -> None:
    """Write one log a run, named by its mass, length, gain and motion."""
    robots = set()
    gains = set()
    names = set()
    for path in sorted(folder.rglob("*.json")):
        run = json.loads(path.read_text())
        mass = float(run["mass"])
        length = float(run["length"])
        kp = int(run["kp"])
        robot = f"{1000 * mass:.0f}g-{1000 * length:.0f}mm"
        if robot not in robots:
            Path(f"{robot}.xml").write_text(ROBOT.format(name=robot, mass=mass, length=length))
        robots.add(robot)
        gains.add(kp)
        kinds = (f"{robot}-kp{kp}-{run['trajectory']}-{k}.csv" for k in count(1))
        name = next(name for name in kinds if name not in names)
        names.add(name)
        start = run["entries"][0]["timestamp"]
        rows = [
            f"{e['timestamp'] - start},{e['position']},{e['goal_position']},{int(e['torque_enable'])}" for e in run["entries"]
        ]
        Path(name).write_text("\n".join(["t,q1,command1,on1", *rows, ""]))
    parts = [f'\n[logs."{robot}-*"]\nrobot = "{robot}.xml"\n' for robot in sorted(robots)]
    parts += [f'\n[logs."*-kp{kp}-*"]\nkp = {kp}\n' for kp in sorted(gains)]
    Path("servo.toml").write_text(SERVO + "".join(parts))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
