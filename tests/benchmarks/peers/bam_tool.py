"""BAM's own code on the public bench of an STS3215, judged by the positions that it simulates.

    git clone https://github.com/Rhoban/bam && git -C bam checkout 1b5a1ce
    uv venv env && uv pip install -p env numpy "optuna<4.4" cmaes colorama wandb
    env/bin/python tests/benchmarks/peers/bam_tool.py bam shared.npz OUT.json [--model m1] [--trials N] [--leave-out]

Runs are written in BAM's format for raw logs, resampled by `bam.process`, and fitted by `bam.fit` (CMA-ES, its default) with
its actuator "sts3215", whose range of kt, made for 7.4 V, is widened as its documentation advises. Each run is then simulated
by BAM from its first position and speed, and its commands. Errors are those at the times and positions of the raw log, spikes
included. All that BAM reads and writes is kept beside OUT.json.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from time import perf_counter

import numpy as np

ACTUATOR = "sts3215"
SUPPLY = 12.0
"""Voltage of the bench [V]; it is part of a log, so that the 7.4 V of the actuator's class do not matter."""
PERIOD = 0.005
"""Period of the resampled logs [s]: the default of `bam.process`."""
KEYS = {"timestamp": "t", "position": "q", "speed": "speed", "goal_position": "goal", "input_volts": "volts"}
"""Names of BAM's logs, and of the columns of the bench."""


class Bench:
    """Runs of the bench, and their times and positions, each of shape (run, sample)."""

    def __init__(self, path: Path):
        file = np.load(path)
        self.columns = {str(name): file["data"][:, :, i].astype(float) for i, name in enumerate(file["columns"])}
        self.about = {name: file[name] for name in ("mass", "length", "kp", "trajectory")}
        self.t, self.q = self.columns["t"], self.columns["q"]

    def write(self, folder: Path) -> None:
        """Write a raw log per run, named by its number."""
        folder.mkdir(parents=True)
        on = self.columns["torque_enable"] > 0.5
        for i in range(len(self.t)):
            head = {name: x[i].item() for name, x in self.about.items()} | {"arm_mass": 0.0, "vin": SUPPLY, "motor": ACTUATOR}
            columns = {name: self.columns[column][i].tolist() for name, column in KEYS.items()}
            columns["torque_enable"] = on[i].tolist()
            entries = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
            (folder / f"{i:03d}.json").write_text(json.dumps(head | {"entries": entries}))


def widen(kt_max: float) -> None:
    """Give BAM's actuator a wider range of the torque constant [N m/A]: the servo is that of 12 V, not of 7.4 V."""
    from bam.feetech.actuator import STS3215Actuator

    own = STS3215Actuator.initialize

    def initialize(self: STS3215Actuator) -> None:
        own(self)
        self.model.kt.max = kt_max

    STS3215Actuator.initialize = initialize


def call(bam: Path, module: str, log: Path, kt_max: float, *options: object) -> None:
    """Run a module of BAM as its documentation has it, but for `widen`; what it prints goes to a file."""
    code = f"import runpy, bam_tool; bam_tool.widen({kt_max}); runpy.run_module('bam.{module}', run_name='__main__')"
    command = [sys.executable, "-c", code, *map(str, options)]
    environment = os.environ | {"PYTHONPATH": f"{bam}:{Path(__file__).resolve().parent}", "OPENBLAS_NUM_THREADS": "1"}
    with log.open("w") as out:
        subprocess.run(command, cwd=log.parent, env=environment, stdout=out, stderr=subprocess.STDOUT, check=True)


def fit(args: argparse.Namespace, logs: Path, runs: np.ndarray, folder: Path) -> dict:
    """Return the parameters that BAM finds from some runs, and the seconds that it took."""
    chosen = folder / "logs"
    shutil.rmtree(chosen, ignore_errors=True)
    chosen.mkdir(parents=True)
    for i in runs:
        (chosen / f"{i:03d}.json").symlink_to(logs / f"{i:03d}.json")
    found, start = folder / "params.json", perf_counter()
    options = ["--actuator", ACTUATOR, "--model", args.model, "--logdir", chosen, "--trials", args.trials, "--output", found]
    call(args.bam_dir.resolve(), "fit", folder / "fit.txt", args.kt_max, *options)
    return {"seconds": round(perf_counter() - start, 1), "runs": len(runs), "parameters": json.loads(found.read_text())}


def simulate(bench: Bench, batch: dict, parameters: dict) -> np.ndarray:
    """Return the positions of all runs at the times of the bench, simulated by BAM; shape (run, sample)."""
    from bam.model import load_model_from_dict
    from bam.simulate import Simulator

    positions, _, _ = Simulator(load_model_from_dict(parameters)).rollout_log(batch, simulate_control=True)
    number = [int(Path(name).stem) for name in batch["filename"]]  # BAM does not sort its logs
    times, q = PERIOD * np.arange(len(positions)), np.empty_like(bench.q)
    for i, simulated in zip(number, np.stack(positions, axis=1), strict=True):
        q[i] = np.interp(bench.t[i], times, simulated)
    return q


def judged(bench: Bench, batch: dict, found: dict, others: np.ndarray) -> dict:
    """Return a fit with its mean absolute errors [rad]: of its runs, of others, and of others by what distinguishes them."""
    from bam.model import load_model_from_dict

    error = np.abs(simulate(bench, batch, found["parameters"]) - bench.q).mean(axis=1)
    print(f"{error[~others].mean():.4f} rad of the fit's runs, {error[others].mean():.4f} rad of others", flush=True)
    kinds = {
        f"{name} {value:.4g}" if name != "trajectory" else str(value): round(float(error[others & (x == value)].mean()), 5)
        for name, x in bench.about.items()
        for value in np.unique(x[others])
    }
    means = {"mae_fit": error[~others].mean(), "mae_others": error[others].mean(), "mae_all": error.mean()}
    ranges = load_model_from_dict(found["parameters"]).get_parameters()
    bound = [name for name, p in ranges.items() if min(p.value - p.min, p.max - p.value) < 0.01 * (p.max - p.min)]
    return found | {name: round(float(x), 5) for name, x in means.items()} | {"mae_others_by": kinds, "at_bounds": bound}


def main() -> None:
    """Write the figures of a model."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bam_dir", type=Path)
    parser.add_argument("shared", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--model", default="m1", help="m1 to m6")
    parser.add_argument("--trials", type=int, default=5000, help="evaluations of a fit; BAM's default is 100000")
    parser.add_argument("--kt-max", type=float, default=6.0, help="upper bound of kt; 2.5 is BAM's own")
    parser.add_argument("--balanced", action="store_true", help="shift every fifth run by one a block of 20: all gains")
    parser.add_argument("--leave-out", action="store_true", help="instead, leave one mass out of each fit, on all other runs")
    args = parser.parse_args()
    bam, out, bench = args.bam_dir.resolve(), args.out.resolve(), Bench(args.shared)
    raw, logs = out.parent / "raw", out.parent / "processed"
    if not logs.exists():
        bench.write(raw)
        logs.mkdir()
        call(bam, "process", out.parent / "process.txt", args.kt_max, "--raw", raw, "--logdir", logs, "--dt", PERIOD)
    sys.path.insert(0, str(bam))
    widen(args.kt_max)
    from bam.logs import Logs

    batch, number, mass = Logs(str(logs)).make_batch(), np.arange(len(bench.t)), bench.about["mass"]
    figures: dict = {"model": args.model, "trials": args.trials, "kt_max": args.kt_max}
    fifth = {"fifth": (number + args.balanced * (number // 20)) % 5 != 0}
    folds = {f"{m:.4g}": mass == m for m in np.unique(mass)} if args.leave_out else fifth
    for name, others in folds.items():
        found = fit(args, logs, number[~others], out.with_suffix("") / name)
        figures[name] = judged(bench, batch, found, others)
        figures["mae_others_mean"] = round(float(np.mean([figures[x]["mae_others"] for x in folds if x in figures])), 5)
        out.write_text(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
