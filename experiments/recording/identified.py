"""The recording of a run or a log: motion, what was measured and what was true, predictions, residuals, parameters."""

from collections.abc import Mapping
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from experiments.identified import Identified
from experiments.recording.arm import send_arm
from experiments.recording.parts import UNITS, layout, plot, send_bars, send_joints, send_model
from experiments.recording.stream import recording_file, time_columns
from experiments.recording.style import FORMS
from experiments.run import ScenarioRun
from identify import Array, Estimate
from sim.robot import Robot


def record_run(path: Path, ran: ScenarioRun) -> None:
    """Write the recording of a simulated scenario; raise ResultsError if it cannot be written."""
    run = ran.run
    signals = {
        "joint/q": run.q[0],
        "joint/error": run.reference.q - run.q[0],
        "joint/tau": run.log.tau[0],
        "joint/disturbance": run.tau[0] - run.command[0],
    }
    _record(path, ran.scenario.name, ran.identified, run.robots[0], run.q[0], signals)


def record_log(path: Path, found: Identified) -> None:
    """Write the recording of an identified log; raise ResultsError if it cannot be written."""
    log = found.logs[0]
    _record(path, "log", found, Robot.load(found.robot), log.q, {"joint/q": log.q, "joint/tau": log.tau})


def _record(path: Path, name: str, found: Identified, robot: Robot, q: Array, signals: Mapping[str, Array]) -> None:
    log = found.logs[0]
    with recording_file(path, name, _blueprint(found, list(signals))) as recording:
        times = time_columns(log.t, log.fs)
        send_arm(recording, robot, q, times)
        send_joints(recording, times, signals)
        for form, estimate in found.estimates.items():
            send_model(recording, found.chain, form, estimate, FORMS[form], log.fs)
            errors = (
                estimate.error_percent(list(found.truth.values()))
                if found.truth is not None
                else estimate.relative_sigma_percent
            )
            send_bars(recording, f"error/{form}", errors, form)
        recording.log("report", rr.TextDocument(_markdown(found), media_type="text/markdown"), static=True)


def _judged(found: Identified, estimate: Estimate) -> Array:
    """Return the errors [%] where the truth is known, %sigma where it is not."""
    return estimate.relative_sigma_percent if found.truth is None else estimate.error_percent(list(found.truth.values()))


def _blueprint(found: Identified, signals: list[str]) -> rrb.Blueprint:
    units = {"joint/q": "q [rad]", "joint/error": "tracking error [rad]", "joint/tau": "tau in the log [N m]"}
    units["joint/disturbance"] = "true minus commanded torque, mean of each sample [N m]"
    shown = [form for form in UNITS if form in found.estimates]
    bars = f"{'sigma' if found.truth is None else 'error'} [%] of parameters 1 to {len(found.basis.parameters)}"
    columns = [
        rrb.Vertical(*(plot(f"/{path}", units[path]) for path in signals), rrb.BarChartView(origin="/error", name=bars)),
        rrb.Vertical(*(plot(f"/identify/{found.chain}/{f}/signal", f"{f} [{UNITS[f]}]") for f in shown)),
        rrb.Vertical(*(plot(f"/identify/{found.chain}/{f}/residual", f"{f} residual [{UNITS[f]}]") for f in shown)),
    ]
    return layout("parameters", [5, 4], columns, [7, 6, 5, 5])


def _markdown(found: Identified) -> str:
    """Return estimates, with error or sigma, as a markdown table."""
    forms = list(found.estimates)
    what = "sigma" if found.truth is None else "error"
    lines = [f"Estimate and {what}, chain **{found.chain}**, {found.estimator}\n"]
    lines += [f"| | true | {' | '.join(forms)} |", "|---|---:|" + "---:|" * len(forms)]
    for i, name in enumerate(found.basis.parameters):
        true = "" if found.truth is None else f"{list(found.truth.values())[i]:g}"
        cells = []
        for form in forms:
            estimate = found.estimates[form]
            aside = f"{estimate.sigma[i]:.2g}" if found.truth is None else f"{_judged(found, estimate)[i]:+.2g} %"
            cells.append(f"{estimate.X[i]:.4g} ({aside})")
        lines.append(f"| {i + 1} {name} | {true} | {' | '.join(cells)} |")
    conds = " | ".join(f"{e.condition_number:.1f}" for e in found.estimates.values())
    return "\n".join([*lines, f"| Cond(W) | | {conds} |"])
