"""Servos that were identified from public logs, and files of them."""

from collections.abc import Mapping
from typing import Any

from rich.text import Text

from idbench.experiments.cli.options.tools import ShowDevice
from idbench.experiments.cli.saving import require_targets
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.robot_model import absolute
from idbench.experiments.results.page import Page
from idbench.experiments.results.writing import write_text
from idbench.experiments.servo.bam import require_drive
from idbench.experiments.servo.servo_files import BENCH, cannot_express, device_of, devices, mjcf_of_device, servo_toml_of
from idbench.experiments.text import new_table, print_titled
from idbench.identify.errors import require_positive
from idbench.identify.tables import concise
from idbench.sim.robot.robot import Robot


def device(options: ShowDevice) -> None:
    """List devices, or print one, and write its files."""
    if not 0 < options.kp < float("inf"):
        raise ExperimentError(f"--kp {options.kp:g} must be a finite number above 0")
    robot = absolute(options.robot or BENCH)
    names = Robot.load(robot).joints if options.robot or options.joints or options.write else ()
    if wrong := [joint for joint in options.joints if joint not in names]:
        raise ExperimentError(f"--joints {wrong[0]}: {robot} has no such joint; it has {', '.join(names)}")
    page = Page(machine=options.json)
    require_targets(options.write, [".xml", ".toml"], force=options.force)
    if not options.name:
        page.found |= {"devices": list(devices())}
        for name, known in devices().items():
            page.print(Text(f"{name}: {known['source']}"), soft_wrap=True)
        page.close()
        return
    known, places = device_of(options.name), [names.index(joint) for joint in options.joints or names]
    if options.supply is not None:
        require_positive(supply=options.supply)
        known = {**known, "known": {**known["known"], "supply": options.supply}}
    page.found |= known
    _print(page, known)
    beyond = known.get("beyond", {}).items()
    page.warn({known["name"]: [f"{name} = {x:.3g} has no place in law {known['friction']}" for name, x in beyond]})
    for path in options.write:
        require_drive(known)
        text, said = servo_toml_of(known, options.kp), "what is known of it, for idbench servo --servo"
        if path.suffix == ".xml":
            text = mjcf_of_device(known, robot, places, options.kp, path.absolute().parent)
            said = f"{known['name']} at {', '.join(names[j] for j in places)}"
            page.warn({"the written file": cannot_express(known["parameters"])})
        write_text(path, text, "--write", force=options.force)
        page.print(f"written to {path}: {said}", soft_wrap=True)
    page.close()


def _print(page: Page, known: Mapping[str, Any]) -> None:
    grid = new_table("", ["value", "unit", "spread between units"])
    for letter, of in known["parameters"].items():
        spread = "" if of["spread"] is None else f"{of['spread']:.2g}"
        grid.add_row(letter, concise(of["value"], of["sigma"] or 0.0), of["unit"], spread)
    print_titled(page, f"{known['name']}, friction law {known['friction']}", grid)
    page.print(Text(known["source"]), soft_wrap=True)
    if (off := known.get("held_out_error")) is not None:
        page.print(f"mean error of the position in runs that fits did not see: {off:.2g} rad", soft_wrap=True)
    if known.get("units") == 1:
        page.print("one unit was logged: what others of the same model differ by is not known", soft_wrap=True)
