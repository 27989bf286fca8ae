"""The gallery: what each fault and each scenario looks like, and what idbench says of it.

    uv run python docs/build/gallery.py [--said | --page] [NAME ...]

Every picture is a run's recording in rerun's viewer; faults are those of the study `faults`, of its largest
size. With names only these are made anew, with `--said` without their pictures, with `--page` none: the page is written
from what docs/gallery has.
"""

import json
import re
import sys
import tempfile
import tomllib
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path

import tomli_w
from PIL import Image
from results import DOCS

sys.path.insert(0, str(DOCS))
CAUSE = re.compile(r"^(?:warning|\d+\. [\w ']+): (.*)$", re.MULTILINE)
STUDY = DOCS.parent / "experiments" / "studies" / "faults.toml"
PLACE = DOCS / "gallery"
WIDTH = 1000  # Of a picture [pixels]: signals are read, and fifty of them weigh as much as five recordings
PAGE = DOCS / "recordings.md"
SIGMAS = re.compile(r" \([\d.]+ sigma\)")
MARK = re.compile(r"<!-- gallery -->\n.*?<!-- end -->", re.DOTALL)

SCENARIOS = {
    "ideal": ("overview", "Nothing: residuals of the size of the noise."),
    "quantization": ("overview", "Coarse encoders: residuals are rough wherever a joint moves."),
    "ripple": ("friction", "Cogging: residuals over the position are a wave, once per slot."),
    "saturation": ("overview", "Pink: the drive is at its limit, and the logged torque is not the one that acted."),
    "delay": ("overview", "Nothing late is left: the log states its delay. Without it: the first hour."),
    "gain": (
        "overview",
        "The torque constant of joint 1 is 15 % off: of two joints only their ratio shows, in joint 2.",
    ),
    "stribeck": ("friction", "Friction near standstill: over the velocity a peak beside zero, which the law lacks."),
    "payload": ("overview", "Nothing: a constant payload becomes part of the parameters (ZZ2 0.142 instead of 0.06)."),
    "ruckig": (
        "overview",
        "Jerk-limited moves: velocities rise and fall in straight lines, with little time near rest.",
    ),
    "everything-at-once": ("overview", "All imperfections together; the largest is named first."),
    "arm": ("overview", "A seven-joint arm: the torques of links and rotors far from the base are small."),
    "servo": ("overview", "A servo: it follows its commands late, and no faster than its rate limit."),
    "servo-backlash": ("drive", "Play: the rotor moves while the link rests, wherever the load changes sides."),
    "servo-late": ("overview", "A slow bus: positions follow commands late."),
    "servo-saturation": ("drive", "A duty at its limit: the position falls behind in straight lines."),
}
"""Scenarios that ship: the tab in front, and what there is to see."""

FAULTS = {
    "gain": "The residual of the joint repeats its torque.",
    "offset": "The residual is a constant, between moves, too.",
    "delay": "The residual has spikes where the torque changes fast.",
    "position-delay": "The residual repeats the torque's slope, of inertia and friction alike.",
    "zero": "Nothing: the first moments of the last link turn with its zero.",
    "scale": "The residual grows with the distance from the zero.",
    "eccentric": "The residual is a wave over the position, once a turn.",
    "spring": "The residual is proportional to the position.",
    "load-friction": "The residual jumps at reversals, by more where the load is larger.",
    "stribeck": "The residual has peaks before and after each rest.",
    "asymmetry": "The residual is larger in one direction.",
    "warming": "The residual is friction that fades: large at the beginning, small at the end.",
    "cogging": "The residual is a wave over the position, twelve times a turn.",
    "commutation": "The residual is a wave whose height follows the torque.",
    "backlash": "The residual has spikes at the instants at which the load changes sides.",
    "elasticity": "The residual repeats what the link does beyond its motor: quick oscillations after each start.",
    "push": "One bump, at 8 s, that no motion explains.",
    "payload": "From 12 s on the residuals of all joints repeat gravity.",
    "tilt": "The residual repeats gravity, of an axis that should carry none.",
    "base-motion": "The residuals of all joints oscillate together, also at rest.",
    "rate": "The residual repeats the inertia's torque.",
    "length": "The residuals appear where both joints move.",
    "axis": "The residual is small and slow: what gravity has along the turned axis.",
    "dropouts": "The velocity has notches, and the residual spikes at them.",
}
"""Faults of the study, and what there is to see in their residuals."""


OF_FAULT = "fault-"  # What the names of files of faults begin with


def _cases() -> dict[str, dict[str, object]]:
    """Return scenarios with a fault each, by the name of their files."""
    study = tomllib.loads(STUDY.read_text())
    every = study["axes"][0]["cases"]
    return {f"{OF_FAULT}{name}": {"name": name, **study["settings"], **every[name]} for name in FAULTS}


def ran(name: str, *more: str) -> Path:
    """Run a scenario or a fault, and keep which causes are named; return the folder of the results."""
    from idbench.experiments.cli import main as idbench

    described = name
    if name.startswith(OF_FAULT):
        described = f"{name}.toml"
        Path(described).write_text(tomli_w.dumps(_cases()[name]))
    out = Path("runs") / name
    with redirect_stdout(StringIO()) as printed:
        failed = idbench(["run", described, "--out", str(out), "--force", *more])
    if failed:
        sys.exit(f"run {described} failed")
    (PLACE / f"{name}.json").write_text(json.dumps(CAUSE.findall(printed.getvalue()), indent=1, ensure_ascii=False) + "\n")
    return out


def photographed(name: str, client: object) -> None:
    """Run a scenario or a fault, and keep a picture of its recording."""
    from pictures import Picture, take

    out, tab = ran(name), SCENARIOS.get(name, ("overview", ""))[0]
    place = Path(name).absolute()
    take(client, out, Picture((), tab, 0.4), place)
    picture = Image.open(place.with_suffix(".png")).convert("RGB")
    if name.startswith(OF_FAULT):  # torques of the joints, measured and predicted, and residuals
        picture = picture.crop((round(0.555 * picture.width), 0, picture.width, picture.height - 30))
    width = min(WIDTH, picture.width)
    small = picture.resize((width, round(width * picture.height / picture.width)))
    small.save(PLACE / f"{name}.webp", quality=70)


def page() -> str:
    """Return what goes into the page."""
    study = tomllib.loads(STUDY.read_text())["settings"]
    fault = tomli_w.dumps({"name": "fault", **study, "fault": [{"kind": "offset", "joint": "elbow", "size": 0.33}]})
    return "\n".join(
        [
            "Each picture is the recording of a run, each quotation what `run` prints: without one, the cause is not named at",
            "this size; where another is named, that is wrong. Scenarios: `uv run idbench run NAME`.\n",
            *(_figure(name, see, name) for name, (_, see) in SCENARIOS.items()),
            "Faults of two links, with their sizes: the lines below are `fault.toml`; `uv run idbench run fault.toml`.",
            f"From which size on each is named: [a study](benchmark.md#what-is-wrong).\n\n```toml\n{fault}```\n",
            *(_figure(name, FAULTS[name.removeprefix(OF_FAULT)], _named(case)) for name, case in _cases().items()),
        ]
    )


def _named(case: dict[str, object]) -> str:
    (fault,) = case["fault"]  # type: ignore[misc]
    when = [f"{key} {fault[key]:g}" for key in ("start", "end") if key in fault]  # type: ignore[index, operator]
    return ", ".join([f"{fault['kind']}, {fault['size']:g}", *when])  # type: ignore[index]


def _figure(name: str, see: str, title: str) -> str:
    said = json.loads((PLACE / f"{name}.json").read_text())
    quoted = f" *{SIGMAS.sub('', said[0].split('; ')[0])}*" if said else ""
    return f"**{title}.** {see}{quoted}\n\n![{name}](gallery/{name}.webp)\n"


def write() -> None:
    """Write the page."""
    PAGE.write_text(MARK.sub(lambda _: f"<!-- gallery -->\n{page()}<!-- end -->", PAGE.read_text()))


if __name__ == "__main__":
    from pictures import viewer

    PLACE.mkdir(exist_ok=True)
    names = [word for word in sys.argv[1:] if not word.startswith("--")] or [*SCENARIOS, *_cases()]
    if "--page" not in sys.argv:
        with tempfile.TemporaryDirectory(prefix="idbench-") as folder, chdir(folder):
            for one in names:
                if "--said" in sys.argv:
                    ran(one, "--no-rerun")
                    continue
                with viewer(Path(folder)) as client:
                    photographed(one, client)
    write()
