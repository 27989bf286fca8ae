"""What a call of a written function costs in C and in Python, beside pinocchio's; operations beside published ones.

uv run --group benchmark python tests/benchmarks/functions.py
"""

import ctypes
import runpy
import subprocess
import tempfile
import time
from math import nan
from pathlib import Path

import numpy as np
import pinocchio as pin
from timing import ur5

from idbench.experiments.exports.c_code import OF_INTERVAL, c_texts
from idbench.experiments.exports.code import Content
from idbench.experiments.exports.functions import RobotFunctions
from idbench.experiments.exports.python_code import python_text
from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify.basis.operations import COLUMNS, operations

ROBOTS = ("scara", "puma560", "panda")
SHOWN = ("inverse_dynamics", "forward_dynamics", "mass_matrix", "gravity", "regressor", "regressor_energy")
CALLS, ROUNDS = 200_000, 5

LOOP = """#include "arm.h"
double arm_many(int calls)
{
    const struct arm_parameters p = ARM_IDENTIFIED;
    static double x[3][ARM_JOINTS], out[ARM_JOINTS * ARM_PARAMETERS + ARM_JOINTS * ARM_JOINTS];
    double sum = 0.0;
    for (int k = 0; k < calls; k++) {
        x[0][k % ARM_JOINTS] += 1e-3;
        arm_FUNCTION(ARGUMENTS, &p, out);
        sum += out[0];
    }
    return sum;
}
"""

PUBLISHED = """published operations of inverse dynamics, six hinges (x / +):
  Newton-Euler (Luh, Walker, Paul 1980; counted by Hollerbach, IEEE Trans. SMC 10 (1980) 730)  852 / 738
  recursive Lagrange, 3 x 3 (Hollerbach 1980)                                                 2195 / 1719
  Lagrange, 4 x 4 (Uicker, Kahn; Hollerbach 1980)                                           66 271 / 51 548"""


def best(call, count):
    """Return the shortest time of a call [us]."""
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        call()
        times.append((time.process_time() - start) / count * 1e6)
    return min(times)


def in_c(content, folder):
    """Return the time of a call of each function in C [us]."""
    for ending, text in c_texts(content, folder / "arm.c").items():
        (folder / f"arm{ending}").write_text(text)
    found = {}
    for function in content.functions.functions:
        if function.name in SHOWN:
            given = ", ".join(f"x[{k}]" for k, _ in enumerate(function.takes))
            (folder / "many.c").write_text(LOOP.replace("FUNCTION", function.name).replace("ARGUMENTS", given))
            library = folder / f"{function.name}.so"
            subprocess.run(
                ["cc", "-std=c99", "-O2", "-shared", "-fPIC", folder / "many.c", folder / "arm.c", "-lm", "-o", library],
                check=True,
            )
            many = ctypes.CDLL(str(library)).arm_many
            found[function.name] = best(lambda many=many: many(CALLS), CALLS)
    return found


def in_python(content, folder):
    """Return the time of a call of each function in Python, of lists [us]."""
    (folder / "arm.py").write_text(python_text(content))
    module = runpy.run_path(str(folder / "arm.py"))
    motion = np.random.default_rng(0).normal(size=(3, content.functions.n)).tolist()
    found = {}
    for function in content.functions.functions:
        call, given = module[function.name], motion[: len(function.takes)]
        found[function.name] = best(lambda call=call, given=given: [call(*given) for _ in range(2000)], 2000)
    return found


def pinocchios():
    """Return the time of pinocchio's rnea of a UR5, called from Python [us]."""
    model = ur5()
    data, motion = model.createData(), np.random.default_rng(0).normal(size=(3, 6))
    return best(lambda: [pin.rnea(model, data, *motion) for _ in range(20_000)], 20_000)


def main():
    """Print the table."""
    print(f"pinocchio's rnea, six joints, called from Python: {pinocchios():.2f} us")
    for name in ROBOTS:
        robot_model = RobotModel(name)
        truth, nothing = list(robot_model.truth(robot_model.robot).values()), [nan] * robot_model.basis.n
        start = time.process_time()
        functions = RobotFunctions(robot_model.basis, robot_model.tree)
        content = Content(functions, truth, truth, dict.fromkeys(OF_INTERVAL, nothing), "benchmark")
        _ = functions.functions
        made = time.process_time() - start
        with tempfile.TemporaryDirectory() as folder:
            c, python = in_c(content, Path(folder)), in_python(content, Path(folder))
        print(f"\n{name}: recorded in {made:.2f} s")
        for function in functions.functions:
            if function.name in SHOWN:
                steps = [functions.tape.steps[k][0] for k in functions.tape.needed(function.values)]
                counts = f"{steps.count('*'):4} / {steps.count('+') + steps.count('-'):4}"
                us = f"C {c[function.name]:6.3f} us, Python {python[function.name]:6.1f} us"
                print(f"  {function.name:18} {counts}   {us}")
        for model in COLUMNS:
            print(f"  columns of {model:9} {operations(robot_model.basis, model)}")
    print(f"\n{PUBLISHED}")


if __name__ == "__main__":
    main()
