"""FloBaRoID on the logs that `public_sets.py` has left in its folders, as its configuration for a fixed arm advises.

    git clone https://github.com/kjyv/FloBaRoID && git -C FloBaRoID checkout 9c06804
    uv venv flo && uv pip install -p flo idyntree numpy scipy sympy cvxpy clarabel pyyaml colorama palettable humanize tqdm \\
        jinja2 matplotlib trimesh plotly
    flo/bin/python tests/benchmarks/peers/flobaroid_tool.py FloBaRoID runs/benchmark

Torques of the held-out logs go into predicted-flobaroid.npz, and `public_sets.py` judges them. Beside them are the estimate,
its sigma, and `exact`, which fits the moving joints of the last held-out log: of a log without noise, the truth.
"""

import contextlib
import io
import json
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from idyntree import bindings

SLOW = 0.05
"""Share of its rms speed below which a joint counts as slow."""

Arrays = dict[str, np.ndarray]


class ZeroedVector6(bindings.Vector6):
    """A Vector6 that starts at zero.

    FloBaRoID takes a new Vector6 for the acceleration of a fixed base, but iDynTree leaves new
    vectors as the memory was, so that each regressor would belong to a base shaken at random.
    """

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        if not arguments:
            self.zero()


def settings(config: Path, joints: int, rate: float, cutoff: float) -> dict[str, Any]:
    """The shipped configuration of a fixed-base arm, less what holds for its KUKA LWR4 alone."""
    options = yaml.safe_load(config.read_text())
    options |= {"num_dofs": joints, "verbose": 0, "createPlots": 0}
    options |= {
        # The 500 samples at 200 Hz are the KUKA's way to its start; some logs here have no more.
        "startOffset": 0,
        # Least squares without constraints: the configuration advises it where torques are the
        # aim, and masses and CAD values, which the constraints need, are not known for each arm.
        "constrainToConsistent": 0,
        "estimateWith": "base",
        # Its refit of friction leans on the friction in the URDF, which is zero in most of these.
        "postIdentifyFriction": 0,
        # The median filter's 11 samples last 55 ms at the KUKA's 200 Hz: no longer elsewhere.
        "filterMedianSize": min(11, 1 + 2 * max(0, round((0.055 * rate - 1) / 2))),
    }
    if options["filterLowPass1"][0] >= rate / 2:
        # A log too slow for the shipped filters: the benchmark's band, in the same proportion.
        options["filterLowPass2"][0] *= cutoff / options["filterLowPass1"][0]
        options["filterLowPass1"][0] = cutoff
    return options


def measurements(log: Arrays, options: dict[str, Any]) -> Arrays:
    """Filter and differentiate a log as FloBaRoID does after an excitation."""
    from identification.data import Data

    shape = log["q"].shape
    filled = ("positions_raw", "velocities", "velocities_raw", "accelerations", "torques_raw")
    kept: Arrays = {name: np.zeros(shape) for name in filled}
    kept |= {"positions": log["q"].copy(), "torques": log["tau"].copy(), "times": log["t"].copy()}
    kept["frequency"] = np.array(1 / np.mean(np.diff(log["t"])))
    Data(options).preprocess(
        *(kept[name] for name in ("positions", "velocities", "accelerations", "torques", "times")),
        Fs=float(kept["frequency"]),
        Q_raw=kept["positions_raw"],
        V_raw=kept["velocities_raw"],
        Tau_raw=kept["torques_raw"],
    )
    return kept


def write_urdf(source: Path, target: Path) -> None:
    """Copy a URDF, with limits for continuous joints: FloBaRoID knows revolute joints only.

    The limits bound the random states from which it derives the base parameters, nothing else.
    """
    tree = ET.parse(source)
    for joint in tree.getroot().findall("joint[@type='continuous']"):
        joint.set("type", "revolute")
        ET.SubElement(joint, "limit", lower="-3.14", upper="3.14", velocity="3.14", effort="1000")
    tree.write(target)


def run_set(flobaroid: Path, folder: Path, read: dict[str, Any], scratch: Path) -> str:
    """Identify one arm, save the predictions, and tell how it was done."""
    from identifier import Identification  # found only once main has extended the path

    logs: dict[str, Arrays] = {name: dict(np.load(folder / name)) for name in read["fit"] + read["held_out"]}
    rate = 1 / float(np.mean(np.diff(logs[read["fit"][0]]["t"])))
    options = settings(flobaroid / "configs/kuka_lwr4.yaml", len(read["joints"]), rate, read["cutoff"])
    # FloBaRoID keeps a cache beside the URDF, hence a copy in a folder that goes afterwards.
    urdf = scratch / "robot.urdf"
    write_urdf(folder / read["robot"], urdf)

    start = time.perf_counter()
    files = [str(scratch / name) for name in read["fit"]]
    for name, file in zip(read["fit"], files, strict=True):
        np.savez(file, **measurements(logs[name], options))
    found = Identification(options, str(urdf), None, [files], None, None)
    if found.model.jointNames != read["joints"]:
        raise ValueError(f"joints come in the order {found.model.jointNames}")
    # Its gravity points along -z; the base parameters just derived hold for either sign.
    for axis, value in enumerate(read["gravity"]):
        found.model.gravity_vec.setVal(axis, value)
    found.estimateParameters()
    seconds = time.perf_counter() - start

    # Its standard deviations are shares of the parameters; without priors it takes them of the torque, not of the residual.
    found.estimateRegressorTorques("base")
    estimate = np.array(found.model.xBase)
    predicted: Arrays = {"estimate": estimate, "sigma": found.getStdDevForParams() * np.abs(estimate)}
    for name in read["held_out"]:
        found.data.init_from_data(measurements(logs[name], options))
        found.model.computeRegressors(found.data)
        found.estimateRegressorTorques()
        predicted[Path(name).stem] = found.tauEstimated
        qd = np.gradient(logs[name]["q"], logs[name]["t"], axis=0)
        moving = (np.abs(qd) > SLOW * np.sqrt((qd**2).mean(axis=0))).ravel()
        predicted["exact"] = np.linalg.lstsq(found.model.YBase[moving], logs[name]["tau"].ravel()[moving], rcond=None)[0]
        if not np.all(np.isfinite(found.tauEstimated)):
            raise ValueError(f"torques of {name} are not finite")
    note = (
        f"unweighted OLS of {found.model.num_base_params} base parameters with Fc, Fv, offset; "
        f"median of {options['filterMedianSize']}, low-pass {options['filterLowPass1'][0]:g} Hz, "
        f"of velocities {options['filterLowPass2'][0]:g} Hz; base acceleration set to zero by us"
    )
    np.savez(folder / "predicted-flobaroid.npz", seconds=seconds, note=note, **predicted)
    return f"{seconds:.1f} s, {note}"


def main(flobaroid: Path, results: list[Path]) -> None:
    """Run every set below the given folders; one that fails does not stop the others."""
    sys.path.insert(0, str(flobaroid))
    bindings.Vector6 = ZeroedVector6
    for summary in sorted(path for folder in results for path in folder.glob("*/summary.json")):
        np.random.seed(0)  # noqa: NPY002  # FloBaRoID draws states from it
        try:
            with tempfile.TemporaryDirectory() as scratch, contextlib.redirect_stdout(io.StringIO()):
                read = json.loads(summary.read_text())["tools_read"]
                outcome = run_set(flobaroid, summary.parent, read, Path(scratch))
        except (Exception, SystemExit) as error:  # FloBaRoID leaves by sys.exit at times
            outcome = f"failed: {type(error).__name__}: {error}"
        print(f"{summary.parent.name}: {outcome}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(argument) for argument in sys.argv[2:]])
