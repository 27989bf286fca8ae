"""Pages of the site that are made of the code: commands, settings, the Python reference, notebooks."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import is_dataclass
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parent.parent.parent

KINDS_OF_NAMES = (
    ("Logs", ("MotionLog", "TorqueChannel", "encoder_steps", "smoothed_log")),
    ("Robots", ("scara", "tree_basis", "Basis", "Parameter", "KinematicTree", "Joint", "BaseParameters")),
    ("Identification", ("identify", "identify_each", "attempt_each", "estimate", "Problem", "Estimate", "Status")),
)


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made of the code."""
    sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]
    from notebooks import pages as notebook_pages
    from site_recordings import recordings

    made = {"reference/commands.md": commands(), "reference/settings.md": "\n".join(settings())}
    made |= {"reference/session.md": "\n".join(session())}
    made |= {"reference/identify.md": "\n".join(package("identify")), "reference/sim.md": "\n".join(simulator())}
    made |= notebook_pages()
    for path, text in made.items():
        files.append(File.generated(config, path, content=text))
    for place, path in (viewer_files() | recordings()).items():
        files.append(File.generated(config, place, abs_src_path=str(path)))
    return files


def viewer_files() -> dict[str, Path]:
    """Return the files of rerun's viewer for browsers, by their place in the site."""
    static = Path(str(find_spec("rerun_notebook").submodule_search_locations[0])) / "static"
    return {f"viewer/{name}": static / name for name in ("widget.js", "re_viewer_bg.wasm")}


def commands() -> str:
    """Return what every command says of itself."""
    from idbench.experiments.cli.app import COMMANDS

    pages = ["# Commands\n\n`idbench COMMAND --help-all`, as it is printed. `uv run idbench` runs it from a clone.\n"]
    helps = {name: _help(name) for name in COMMANDS}
    pages[0] += "\n| command | what it does |\n|---|---|\n"
    pages[0] += "\n".join(f"| [{name}](#{name}) | {_summary(text)} |" for name, text in helps.items())
    pages += [f"## {name}\n\n```text\n{text}\n```" for name, text in helps.items()]
    return "\n\n".join(pages)


def _summary(text: str) -> str:
    """Return the first sentence of a help text, between the usage and the options."""
    whole = " ".join(text.split("\n\n")[1].split())
    return re.split(r"(?<!\.)\. ", whole)[0].rstrip(".").replace("|", "&#124;") + "."


def _help(name: str) -> str:
    code = "import sys; from idbench.experiments.cli import entry; entry()"
    plain = os.environ | {"COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb"}
    done = subprocess.run(
        [sys.executable, "-c", code, name, "--help-all"], cwd=ROOT, env=plain, capture_output=True, check=True
    )
    return done.stdout.decode().replace("usage: -c", "usage: idbench").strip()


def settings() -> Iterator[str]:
    """Yield every setting of a scenario, with its unit and what it is by default."""
    from idbench.sim.scenario.scenario import Scenario
    from idbench.sim.scenario.scenario_file import KINDS
    from idbench.sim.settings import fields_of

    yield "# Settings of a scenario\n"
    yield "A scenario is a TOML file. `idbench new scenario mine` writes one with all of this in it.\n"
    yield from _table(Scenario)
    for key, field in fields_of(Scenario).items():
        if key in KINDS:
            for name in KINDS[key].builtin:
                made = KINDS[key].create(name)
                yield f'\n## [{key}] kind = "{name}"\n\n{(type(made).__doc__ or "").strip().splitlines()[0]}\n'
                yield from _table(type(made))
        elif is_dataclass(field.default):
            yield f"\n## [{key}]\n\n{(type(field.default).__doc__ or '').strip().splitlines()[0]}\n"
            yield from _table(type(field.default))
    yield from _limits()


def _limits() -> Iterator[str]:
    from idbench.sim.limits.motion_limits import KeepOut, MotionLimits

    yield "\n## limits.toml\n\nWhat a motion of `idbench excite` must keep (`--limits`).\n"
    yield from _table(MotionLimits)
    yield "\n## [[keep_out]] of limits.toml\n"
    yield from _table(KeepOut)


def _table(cls: type) -> Iterator[str]:
    from idbench.sim.settings import description, fields_of

    if not fields_of(cls):
        yield "It has no settings."
        return
    yield "| setting | by default | what it is |\n|---|---|---|"
    for key, field in fields_of(cls).items():
        default = "" if field.is_required() else _shown(field.default)
        yield f"| `{key}` | {default} | {description(cls, key).replace('|', '&#124;')} |"


def _shown(value: Any) -> str:
    nothing = value is None or value in ("", ())
    return "its own section below" if is_dataclass(value) else "none" if nothing else f"`{value}`"


def session() -> Iterator[str]:
    """Yield what `import idbench` has."""
    import idbench

    yield "# idbench\n\nWhat `import idbench` has: the jobs of the commands ([in Python](../python.md)).\n"
    places = {key: place for place, names in idbench.PLACES.items() for key in names}
    yield from (f"::: idbench.{places[key]}.{key}\n" for key in idbench.__all__ if places[key].startswith("experiments"))


def package(name: str) -> Iterator[str]:
    """Yield the public names of a package, those of one kind together."""
    from idbench import identify

    named = {key: value for key, value in vars(identify).items() if not key.startswith("_")}
    public = [key for key, value in named.items() if not isinstance(value, ModuleType)]
    yield f"# {name}\n\nWhat `from idbench.{name} import ...` has, and [what of sim](sim.md). Shapes and units are in [ ]."
    yield "Equation numbers are the paper's.\n"
    taken = set[str]()
    for title, names in KINDS_OF_NAMES:
        taken |= set(names)
        yield f"## {title}\n"
        yield from (f"::: idbench.identify.{key}\n" for key in names)
    tables = [key for key in public if key.isupper()]
    yield "## Plug-in tables\n"
    yield f"{', '.join(f'`{key}`' for key in tables)}: from a name to what makes the plug-in. `idbench list` prints them.\n"
    yield "## Everything else\n"
    documented = [key for key in public if key not in taken | set(tables) | {"Array", "Columns"}]
    yield from (f"::: idbench.identify.{key}\n" for key in sorted(documented, key=str.lower))


def simulator() -> Iterator[str]:
    """Yield what of the simulator other programs use."""
    yield "# sim\n\nThe virtual robot: `from idbench.sim import load_robot, load_scenario, run, Robot, kinematic_tree`.\n"
    yield "\n".join(
        f"::: {name}\n"
        for name in (
            "idbench.sim.engine.simulation.simulate",
            "idbench.sim.limits.clearance.Clearance",
            "idbench.sim.engine.run.Run",
            "idbench.sim.engine.watch.Watch",
            "idbench.sim.engine.run.ideal_log",
            "idbench.sim.robot.robot.Robot",
            "idbench.sim.robot.tree.kinematic_tree",
            "idbench.sim.scenario.scenario.Scenario",
            "idbench.sim.scenario.scenario_file.load",
            "idbench.sim.scenario.scenario_file.to_toml",
            "idbench.sim.controllers.AbstractController",
            "idbench.sim.controllers.AbstractLaw",
            "idbench.sim.drives.drive.AbstractDrive",
            "idbench.sim.drives.drive.AbstractAmplifier",
            "idbench.sim.encoders.AbstractEncoder",
            "idbench.sim.frictions.friction_law.AbstractFrictionLaw",
            "idbench.sim.trajectories.trajectory.AbstractTrajectory",
        )
    )
