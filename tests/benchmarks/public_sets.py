"""Public sets of real logs: each identified, judged on logs that it was not fitted to, and beside other tools.

    uv run --extra ros python tests/benchmarks/public_sets.py tests/benchmarks/public/ur10e --out runs/benchmark

A set is a folder with logs, a robot, and a benchmark.toml: `Definition`. Its results are one folder below --out: summary.json,
and what other tools read. Torques that these leave there (predicted-TOOL.npz) are judged by the next run.
"""

import argparse
import json
import sys
import time
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from importlib.metadata import version
from itertools import combinations
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from rich.console import Console
from set_tables import print_rows
from set_tools import judged, predictions, what_tools_read, write_for_tools

from idbench.experiments.document import Conclusion
from idbench.experiments.errors import ExperimentError, is_told, reason, report
from idbench.experiments.exports.exports import EXPORTS
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.job import chooses_band, fit_of, request_of
from idbench.experiments.identification.load import load, with_held_out
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.reading import ReadLog, file_of, late, read_as
from idbench.experiments.identification.request import Request
from idbench.experiments.judgement.held_out import WORDS, HeldOut
from idbench.experiments.judgement.judgement import Unjudged, judge
from idbench.experiments.requests.jobs import IdentifyRequest, ServoRequest
from idbench.experiments.requests.table import request_from
from idbench.experiments.requests.words import request_keys, word_of
from idbench.experiments.results.writing import finite
from idbench.experiments.servo.identification import Servos, summary_of
from idbench.experiments.servo.job import servos_identified
from idbench.experiments.text import SIGMAS
from idbench.identify import Array, Estimate, IdentificationError, MotionLog
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.judge.validation import split
from idbench.sim.engine.driven import shoot
from idbench.sim.errors import BenchError, ScenarioError
from idbench.sim.settings import NotNegative, make, settings

FILE = "benchmark.toml"
TAKEN = ("log", "validate", "label")  # Keys of a request that a set states itself, or that say nothing about it
UNSHARED = ("", "none stated")  # Licences under which results are not handed on

Row = dict[str, Any]


@settings
class PublishedFigure:
    """A figure that others have published for the data of a set."""

    value: NotNegative
    metric: Literal["torque error", "position error", "free run"]
    split: str  # What was fitted, and what the figure was computed on
    by: str


@settings
class Definition:
    """A set of logs."""

    title: str
    fit: tuple[str, ...]  # Logs that are fitted together; * stands for any letters
    held_out: tuple[str, ...] = ()  # By default the last quarter of the longest log, which is then not fitted
    identify: dict[str, Any] | None = None  # Keys of `idbench.fit`; files of this folder
    servo: dict[str, Any] | None = None  # Or of `idbench servo`
    repeats: tuple[str, ...] = ()  # Logs that are also fitted one by one; by default those of the fit
    free_run: NotNegative = 0.0  # How long the identified robot is simulated from torques alone, again and again [s]
    delay_told: bool = True  # Whether other tools get torques at the instants when they act
    source: str = ""
    license: str = ""
    get: str = ""  # Commands that get the data, to be run in the folder
    published: tuple[PublishedFigure, ...] = ()

    def __post_init__(self) -> None:
        if not self.fit or not all(name.strip(" .") for name in (*self.fit, *self.held_out, *self.repeats)):
            raise ValueError("fit must name at least one log, and each log must have a name")
        if (self.identify is None) == (self.servo is None):
            raise ValueError("give one table, [identify] or [servo]: how the logs are identified")


def read_definition(folder: Path) -> Definition:
    """The definition of a folder, and of patterns the logs that are there; ExperimentError if it is none."""
    try:
        made: Definition = make(Definition, tomllib.loads((folder / FILE).read_text(encoding="utf-8")), "")
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, ScenarioError) as error:
        raise ExperimentError(f"{folder / FILE}: {error}") from error
    every = [tuple(_named(folder, names)) for names in (made.fit, made.held_out, made.repeats or made.fit)]
    if missing := [name for names in every for name in names if not (folder / name).exists()]:
        raise ExperimentError(f"{folder} has no {missing[0]}; get the data with: {' && '.join(made.get.strip().splitlines())}")
    fitted, held_out, repeats = every
    return replace(made, fit=fitted, held_out=held_out, repeats=repeats)


def _named(folder: Path, names: Sequence[str]) -> dict[str, None]:
    found = [sorted(str(path.relative_to(folder)) for path in folder.glob(name)) or [name] for name in names]
    return dict.fromkeys(name for each in found for name in each)


def seen(held_out: MotionLog | LogColumns, fitted: Sequence[MotionLog | LogColumns]) -> int:
    """Number of moving samples of a log that are also in others: equal positions and torques.

    A robot that rests repeats its readings; noise of the torques tells other samples apart. Logs that were put on another clock
    do not have their samples any more: give the columns of their files. Torques with a clock of their own are not compared.

    Parameters
    ----------
    held_out : MotionLog or LogColumns
        One run.
    fitted : sequence of MotionLog or LogColumns
        Those of the fit.
    """
    own = _keys(held_out)
    moving = np.zeros(len(own), dtype=bool)
    moving[1:] = (np.diff(held_out.q, axis=0) != 0).any(axis=1)
    others = np.concatenate([keys for keys in map(_keys, fitted) if keys.dtype == own.dtype] or [own[:0]])
    return int(np.isin(own, others)[moving].sum())


def _keys(log: MotionLog | LogColumns) -> npt.NDArray[np.void]:
    """Return the samples of a log as values that can be compared whole, shape (time,)."""
    parts = [log.q, log.tau] if len(log.tau) == len(log.q) else [log.q]
    rows = np.ascontiguousarray(np.concatenate(parts, axis=1)) + 0.0  # -0 is 0
    return rows.view([("", rows.dtype)] * rows.shape[1]).ravel()


def request_in(folder: Path, definition: Definition) -> IdentifyRequest | ServoRequest:
    """What a set asks for; ExperimentError if a key is unknown, or a value wrong."""
    job, kind = ("identify", IdentifyRequest) if definition.servo is None else ("servo", ServoRequest)
    table, keys = definition.identify or definition.servo or {}, request_keys(kind)
    placed = {
        key: _in_folder(folder, value) if key in keys and word_of(keys[key][1]).file else value for key, value in table.items()
    }
    asked = request_from(kind, placed, f"{folder / FILE}, [{job}]", TAKEN)
    fitted, held_out = (tuple(folder / name for name in names) for names in (definition.fit, definition.held_out))
    return replace(asked, log=fitted, validate=held_out)


def _in_folder(folder: Path, value: Any) -> Any:
    """Return a file's name from the folder of the table; names of what ships stay."""
    if isinstance(value, list):
        return [_in_folder(folder, each) for each in value]
    return str(folder / value) if isinstance(value, str) and Path(value).suffix else value


class SetFit(NamedTuple):
    """A set that is fitted: its files are read once."""

    definition: Definition
    fit: Fit
    read: dict[str, ReadLog]
    seconds: float


def fitted(folder: Path, definition: Definition, asked: IdentifyRequest) -> SetFit:
    """The fit of a set; without held-out logs, of all but the last quarter of its longest."""
    begin = time.perf_counter()
    loaded = load(asked.log, asked, request_of(asked), band=chooses_band(asked))
    logs = with_held_out(loaded, asked, None)
    if definition.held_out:
        logs = replace(logs, held_out=dict(zip(definition.held_out, (logs.held_out or {}).values(), strict=True)))
    else:
        k = logs.longest
        rest, end = split(logs.fitted[k])
        every = (*logs.fitted[:k], rest, *logs.fitted[k + 1 :])
        logs = replace(logs, fitted=every, held_out={f"the last quarter of {logs.name(k)}": end})
    made = fit_of(loaded.request, logs)
    seconds = time.perf_counter() - begin
    read = dict(zip(definition.fit, loaded.read, strict=True))
    options, known = replace(asked, torque_delay=None), replace(loaded.read[0].channel, gain=1.0)
    for name in (*definition.held_out, *definition.repeats):
        if name not in read:
            read[name] = read_as(loaded.read[0].path, file_of(folder / name), options, loaded.request.robot_model, known)
    return SetFit(definition, made, read, seconds)


def identified_row(folder: Path, definition: Definition, out: Path) -> Row:
    """The row of a set of torques and positions; files of other tools are written into its folder of results."""
    asked = request_in(folder, definition)
    assert isinstance(asked, IdentifyRequest)
    made = fitted(folder, definition, asked)
    own, judgement = made.fit, judge(made.fit)
    there = [one for one in judgement.on if isinstance(one, HeldOut)]
    row: Row = {
        "title": definition.title,
        "joints": list(own.robot_model.robot.joints),
        "model": own.leading,
        "estimator": own.request.method.estimator_name,
        "parameters": len(own.basis.names),
        "estimate": _estimate(own),
        "seconds": made.seconds,
        "logs": _logs(judgement.on, made),
        "published": [asdict(one) for one in definition.published],
        "notes": list(own.logs.notes),
        "tools_read": what_tools_read(own),
    }
    row["verdict"] = max((log["verdict"] for log in row["logs"] if "verdict" in log), key=WORDS.index, default=None)
    row["repeats"] = _attempted(lambda: _repeats(made))
    length = definition.free_run
    row["free_run"] = [_attempted(lambda: free_runs(one, own.leading, length)) for one in there if length]  # noqa: B023
    tools = predictions(out) if len(there) == len(judgement.on) else {}
    row["tools"] = {tool: _attempted(lambda: judged(there, path)) for tool, path in tools.items()}  # noqa: B023
    write_for_tools(own, definition.delay_told, out)
    _export(own, definition, out)
    return row


def _export(own: Fit, definition: Definition, out: Path) -> None:
    """Write the robot that was identified, where the data's licence lets others have it."""
    if definition.license in UNSHARED:
        return
    for name in ("identified.xml", "identified.json"):
        try:
            (out / name).write_text(EXPORTS[Path(name).suffix].render(own, own.leading, out / name).texts[out / name])
        except (BenchError, IdentificationError) as error:  # the row is worth having all the same
            (out / f"no-{name}.txt").write_text(f"{error}\n")
    (out / "SOURCE.md").write_text(f"# {definition.title}\n\nData: {definition.source}; licence: {definition.license}.\n")


def _estimate(own: Fit) -> Row:
    found, filed = own.estimates[own.leading], own.robot_model.truth(own.robot_model.robot)
    return {
        "names": list(own.basis.names),
        "X": [finite(x) for x in found.X],
        "sigma": [finite(x) for x in found.standard_errors],
        "filed": [finite(filed[name]) if name in filed else None for name in own.basis.names],
    }


def _logs(on: Sequence[HeldOut | Unjudged], made: SetFit) -> list[Row]:
    """What the row says of each log, with the samples of it that the fit has seen, before any were resampled."""
    found, columns = [], [made.read[name].columns for name in made.definition.fit]
    for one, name in zip(on, made.fit.logs.held_out or {}, strict=True):
        log = _log(one, made.fit)
        if "samples_seen" in log and name in made.read:
            log["samples_seen"] = max(log["samples_seen"], seen(made.read[name].columns, columns))
        found.append(log)
    return found


def _log(one: HeldOut | Unjudged, own: Fit) -> Row:
    if isinstance(one, Unjudged):
        return {"title": one.title, "failure": one.why}
    torques, verdict = one.torques[own.leading], one.verdicts[own.leading]
    inside, outside = one.within_interval(own.leading) or (np.full(len(torques.rms), np.nan), np.nan)
    each = {
        "within_interval": inside,
        "torque_error_rms": torques.rms,
        "torque_error_percent": torques.percent,
        "torque_rms": torques.level,
        "noise_rms": torques.noise,
        "R2": torques.R2,
    }
    return {
        "title": one.title,
        **{name: [finite(x) for x in values] for name, values in each.items()},
        "outside_fitted": finite(outside),
        "verdict": verdict.word,
        "reasons": verdict.reasons,
        "samples": one.log.samples,
        "samples_seen": seen(one.log, own.logs.fitted),
    }


def _repeats(made: SetFit) -> Row:
    """How fits of single logs agree, with the delay of the fit: differences within two standard errors."""
    channel = made.fit.logs.fitted[0].torque
    logs = {name: late(made.read[name], channel).longest for name in made.definition.repeats}
    return repeats(made.fit.request, logs) if len(logs) > 1 else {}


def repeats(request: Request, logs: dict[str, MotionLog]) -> Row:
    """How many differences of the same parameters are within two standard errors, by the first model that each fit has."""
    fits, failed = list[Estimate](), list[str]()
    for name, log in logs.items():
        try:
            found: Fit = fit(request, Logs((log,), (name,), None, (), None))
        except IdentificationError as error:
            failed.append(f"{name}: {error}")
        else:
            fits.append(found.estimates[found.leading])
    pairs = list(combinations(fits, 2))
    alike = [(one, other) for one, other in pairs if one.names == other.names]  # others are grouped with what was left out
    if len(alike) < len(pairs):
        failed.append("fits of single logs that have different parameters are not compared")
    sigma = [np.hypot(one.standard_errors, other.standard_errors) for one, other in alike]
    z = np.array([(one.X - other.X)[s > 0] / s[s > 0] for (one, other), s in zip(alike, sigma, strict=True)]).ravel()
    return {"inside": int(np.sum(np.abs(z) < SIGMAS)), "compared": len(z), "failed": failed}


def free_runs(held_out: HeldOut, model: str, length: float) -> Row:
    """NRMSE of positions that are simulated from where the log is: rms of the error over the range of the joint."""
    robot, log, qd = held_out.driven(model)
    samples = round(length * log.fs)
    if not 0 < samples <= log.samples:
        raise ScenarioError(f"a log of {log.samples / log.fs:.3g} s has no stretch of {length:g} s: use another length")
    first = samples * np.arange(log.samples // samples)
    measured = log.q[first[:, None] + np.arange(samples)]
    simulated = shoot(robot, {}, (log.q[first], qd[first]), log, first, samples)
    kept = np.asarray(np.isfinite(simulated).all(axis=(1, 2)))
    squares, whole = (measured[kept] - simulated[kept]) ** 2, np.ptp(log.q, axis=0)
    nrmse = np.sqrt(squares.mean(axis=(0, 1))) / np.where(whole > 0, whole, np.nan) if kept.any() else np.full(log.n, np.nan)
    return {"length": length, "stretches": len(kept), "diverged": int((~kept).sum()), "nrmse": [finite(x) for x in nrmse]}


def servo_row(folder: Path, definition: Definition, out: Path) -> Row:
    """The row of a set of servos: positions of held-out logs, simulated from their commands alone."""
    del out  # what other tools of servos read differs from tool to tool
    if not definition.held_out and len(definition.fit) < 2:
        raise ExperimentError(f"{FILE}: name a second log, or held_out: one alone says nothing of others")
    begin, asked = time.perf_counter(), request_in(folder, definition)
    assert isinstance(asked, ServoRequest)
    made = servos_identified(asked)
    joints, others = made.servos.links.joints, made.others
    assert others is not None
    none = np.full(len(others.logs), np.nan)
    errors = np.array([made.errors["held out"].get(joint, none) for joint in joints]).T
    return {
        "title": definition.title,
        "joints": list(joints),
        "model": ", ".join(dict.fromkeys(each.friction for each in made.fits.values())),
        "estimator": "output error",
        "parameters": sum(len(each.p) for each in made.fits.values()),
        "estimate": {joint: summary_of(each) for joint, each in made.fits.items()},
        "seconds": time.perf_counter() - begin,
        "logs": [
            {"title": others.name(path), "position_error": [finite(x) for x in own], "samples_seen": 0}
            for path, own in zip(others.logs, errors, strict=True)
        ],
        "published": [asdict(one) for one in definition.published],
        "notes": [f"{joint}: {why}" for joint, why in made.every.items() if isinstance(why, str)],
        "verdict": None,
        "verdicts": [line for _, line in made.verdicts],
        "repeats": {},
        "free_run": [{"nrmse": [finite(x) for x in nrmse]} for nrmse in _of_servos(others, made.fits, joints)],
        "tools": {},
    }


def _of_servos(servos: Servos, fits: dict[str, Any], joints: Sequence[str]) -> Array:
    """NRMSE of each log and joint, without spikes, shape (log, joint)."""
    runs = servos.runs_with(fits)
    found = np.full((len(servos.logs), len(joints)), np.nan)
    for joint, each in fits.items():
        for k, (run, simulated) in enumerate(zip(runs[joint], each.simulate(runs[joint]), strict=True)):
            q, off = run.q[run.read_well], (run.q - simulated)[run.read_well]
            found[k, joints.index(joint)] = np.sqrt((off**2).mean()) / np.ptp(q) if np.ptp(q) > 0 else np.nan
    return found


def _attempted(part: Callable[[], Row]) -> Row:
    """A part of a row, or why there is none."""
    try:
        return part()
    except Exception as error:
        if not is_told(error):
            raise
        return {"failure": reason(error)}


def main() -> int:
    """Make the row of each set, and print them; what fails leaves the others."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+", type=Path, help=f"folders with a {FILE} and its data")
    parser.add_argument("--out", type=Path, default=Path("runs/benchmark"))
    asked = parser.parse_args()
    rows, failed, names = [], {}, [folder.resolve().name for folder in asked.sets]
    for folder, name in zip(asked.sets, names, strict=True):
        out = asked.out / name
        try:
            if names.count(name) > 1 or out.resolve() == folder.resolve():
                raise ExperimentError("its results would go where others are: rename the folder, or choose another --out")
            definition = read_definition(folder)
            out.mkdir(parents=True, exist_ok=True)
            row = (identified_row if definition.servo is None else servo_row)(folder, definition, out)
        except Exception as error:  # a fault of one set takes no other away
            failed[name] = reason(error) if is_told(error) else f"{reason(error)}; its traceback is in {report(error)}"
            continue
        rows.append({"set": name, **json.loads(json.dumps(row))})
        content = {"version": version("idbench"), **rows[-1]}
        (out / "summary.json").write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    if rows:
        off = [float(np.median(each)) for row in rows if (each := row.get("percent", {}).get("idbench"))]
        span = f", torques of the median joint within {min(off):.2g} to {max(off):.2g} %" if off else ""
        finding = f"Result: {len(rows)} set{'s' * (len(rows) > 1)}{span}"
        Conclusion("", finding, f"summaries are in {asked.out}").show(Console())
        print_rows(Console(), rows)
    for name, why in failed.items():
        print(f"{name}: {why}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
