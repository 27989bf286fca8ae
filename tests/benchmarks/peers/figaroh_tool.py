"""FIGAROH on the logs that `public_sets.py` has left in its folders, as its own examples use it.

    uv venv figaroh && uv pip install -p figaroh figaroh==1.0.2
    figaroh/bin/python tests/benchmarks/peers/figaroh_tool.py runs/benchmark

Settings are those of its UR10 example: friction, rotors and offsets; a Butterworth filter of the positions at a tenth of the
sampling frequency; decimation by 10, or less for slow logs; its weighted least squares. Where that leaves noise in the
accelerations, a lower cut-off does better, which its examples leave to the user: 5 times the cut-off of our rows, as "tuned".
Torques of the held-out logs go into predicted-figaroh.npz and predicted-figaroh-tuned.npz; `public_sets.py` judges them.
Beside them are the estimate, its sigma, and `exact`, which fits the moving joints of the last held-out log: of a log without
noise, the truth.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml
from figaroh.identification.base_identification import BaseIdentification
from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced
from figaroh.tools.robot import load_robot

DECIMATION = 10
SLOWEST = 40.0
"""Sampling frequency after decimation that is not gone below [Hz]."""

TUNED = 5.0
"""Cut-off of the positions, in cut-offs of our rows, where it is chosen for the log."""

SLOW = 0.05
"""Share of its rms speed below which a joint counts as slow."""

NOTE = "friction, rotors, offsets; Butterworth at {:.3g} Hz; decimation; wls=True"


def config(told: dict, fs: float, cutoff: float) -> str:
    """Return a configuration in its unified format."""
    parts = {"friction": True, "joint_offset": True, "actuator_inertia": told["rotors"]}
    signals = {"sampling_frequency": fs, "cutoff_frequency": cutoff, "filter_type": "butterworth", "filter_order": 4}
    problem = {"include_external_forces": False, "use_joint_torques": True, "model_components": parts}
    joints, n = told["joints"], len(told["joints"])
    mechanics = {
        "reduction_ratios": [1.0] * n,
        "friction_coefficients": {"viscous": [0.0] * n, "static": [0.0] * n},
        "actuator_inertias": [0.0] * n,
        "joint_offsets": [0.0] * n,
    }
    robot = {"name": "arm", "properties": {"joints": {"active_joints": joints}, "mechanics": mechanics}}
    tasks = {"identification": {"enabled": True, "problem": problem, "signal_processing": signals}}
    return yaml.safe_dump({"robot": robot, "tasks": tasks})


class Identification(BaseIdentification):
    """Logs as arrays: what each user of the tool writes."""

    def __init__(self, robot, file: str, told: dict, logs: list[dict], fs: float, cutoff: float) -> None:
        super().__init__(robot, file)
        self.logs, known = logs, self.identif_config
        joints = [self.model.joints[self.model.getJointId(name)] for name in told["joints"]]
        known["active_joints"], known["act_J"] = told["joints"], joints
        known["act_idxq"], known["act_idxv"] = [j.idx_q for j in joints], [j.idx_v for j in joints]
        filtered = {"nbutter": 4, "f_butter": cutoff, "f_sample": fs}
        self.filter_config = {"differentiation_method": "gradient", "filter_params": filtered}

    def load_trajectory_data(self, data_source=None):
        log = self.logs[0] if data_source is None else data_source
        still = dict.fromkeys(("velocities", "accelerations"))
        return {"timestamps": log["t"][:, None], "positions": log["q"], "torques": log["tau"], **still}

    def process_data(self, truncate=None):
        """Process several logs by themselves, and put them behind each other."""
        every = []
        for log in self.logs:
            self.raw_data = self.load_trajectory_data(log)
            self.process_kinematics_data(self.filter_config)
            self.process_torque_data()
            every.append(self.processed_data)
        self.processed_data = {name: np.concatenate([one[name] for one in every]) for name in every[0]}
        self.num_samples = len(self.processed_data["positions"])
        self._build_full_configuration()

    def predicted(self, log: dict) -> tuple[np.ndarray, np.ndarray]:
        """Return the torques of a log, shape (time, joint), as its own validation does, and the parameters that fit it best."""
        self._load_validation_data(log)
        known = self._val_processed_data
        whole = build_regressor_basic(
            self.robot, known["positions"], known["velocities"], known["accelerations"], self.identif_config
        )
        W = build_regressor_reduced(whole, self._idx_eliminated)[:, self._base_indices]
        tau, moved = (W @ self.phi_base).reshape(-1, self._val_num_samples), self.identif_config["act_idxv"]
        qd = np.gradient(log["q"], log["t"], axis=0).T
        moving = np.abs(qd) > SLOW * np.sqrt((qd**2).mean(axis=1, keepdims=True))
        rows = W.reshape(-1, self._val_num_samples, W.shape[1])[moved][moving]
        return tau[moved].T, np.linalg.lstsq(rows, log["tau"].T[moving], rcond=None)[0]


def of_set(folder: Path) -> None:
    told = json.loads((folder / "summary.json").read_text())["tools_read"]
    logs = [dict(np.load(folder / name)) for name in told["fit"]]
    fs = float(1 / np.median(np.diff(logs[0]["t"])))
    for name, cutoff in (("figaroh", fs / 10), ("figaroh-tuned", min(TUNED * told["cutoff"], 0.4 * fs))):
        made, seconds = fitted(folder, told, logs, fs, cutoff)
        every = {}
        for k, log in enumerate(told["held_out"]):
            every[f"held_out{k + 1}"], exact = made.predicted(dict(np.load(folder / log)))
        sigma = np.abs(made.phi_base) * made.result["wls_std_deviations"] / 100
        every |= {"estimate": made.phi_base, "sigma": sigma, "exact": exact}
        np.savez(folder / f"predicted-{name}.npz", seconds=seconds, note=NOTE.format(cutoff), **every)
        print(f"{folder.name}: {name}, {len(made.phi_base)} parameters, {seconds:.1f} s", flush=True)


def fitted(folder: Path, told: dict, logs: list[dict], fs: float, cutoff: float) -> tuple[Identification, float]:
    """Return an identification, and how long it took [s]."""
    robot = load_robot(str(folder / told["robot"]), load_by_urdf=True)
    robot.model.gravity.linear = np.array(told["gravity"])
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(config(told, fs, cutoff))
        file.flush()
        made = Identification(robot, file.name, told, logs, fs, cutoff)
    begin = time.perf_counter()
    made.initialize()
    factor = min(DECIMATION, max(1, int(fs / SLOWEST)))
    made.solve(decimate=factor > 1, decimation_factor=factor, plotting=False, wls=True)
    return made, time.perf_counter() - begin


if __name__ == "__main__":
    for out in map(Path, sys.argv[1:]):
        for place in sorted(path.parent for path in out.glob("*/summary.json")):
            try:
                of_set(place)
            except Exception as error:  # the tool's own, of any kind: the other sets are tried all the same
                print(f"{place.name}: {type(error).__name__}: {error}")
