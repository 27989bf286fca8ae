"""Writing scenarios, studies and packages of plug-ins to start from."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from importlib.util import find_spec
from keyword import iskeyword
from pathlib import Path

from jinja2 import Environment, StrictUndefined

from idbench.experiments.errors import ExperimentError, ResultsError
from idbench.experiments.plugin_tables import TABLES
from idbench.experiments.results.writing import exchange, folder_for, hidden_folder
from idbench.identify.plugins import did_you_mean
from idbench.models import names
from idbench.sim.scenario.scenario_file import load, to_toml

NAME = re.compile(r"[A-Za-z]([A-Za-z0-9_-]*[A-Za-z0-9])?")


@dataclass(frozen=True)
class Kind:
    """A kind of plug-in."""

    point: str
    """Its plug-in point."""
    what: str
    """What it is called."""
    use: str
    """How it is used, with NAME for its name."""


OF_SCENARIOS = 'In a scenario (`idbench new scenario mine`): `[{}]`, `kind = "NAME"`, and its settings.'

KINDS: Mapping[str, Kind] = {
    "estimator": Kind("estimators", "An estimator", "`idbench identify LOG.csv --estimator NAME`"),
    "block": Kind("blocks", "A friction law that is identified", "`idbench identify LOG.csv --robot panda --add NAME`"),
    "friction": Kind("frictions", "A friction of the simulated robot", OF_SCENARIOS.format("friction")),
    "trajectory": Kind("trajectories", "A trajectory", OF_SCENARIOS.format("trajectory")),
    "controller": Kind("controllers", "A controller", OF_SCENARIOS.format("controller")),
    "drive": Kind("drives", "A drive", OF_SCENARIOS.format("drive")),
    "excitation": Kind("excitations", "A kind of motion that is designed", "`idbench excite scara --kind NAME`"),
    "encoder": Kind("encoders", "An encoder", OF_SCENARIOS.format("encoder")),
}
"""Kinds of plug-ins that can be begun."""


def new_scenario(name: str, like: str, out: Path) -> None:
    """Write a scenario like another, every setting explained; raise ExperimentError if that is not possible."""
    _write(out, {"": to_toml(replace(load(like), name=_checked(name), origin=f"like {like}"))})


def new_study(name: str, out: Path) -> None:
    """Write a study, every key explained; raise ExperimentError if that is not possible."""
    _write(out, {"": _rendered("study.toml.j2", {"name": _checked(name)})})


def new_example(name: str, robot: str, out: Path) -> None:
    """Write a shipped arm, two of its logs and its true parameters; ExperimentError if one is not there, or `out` is."""
    from idbench.experiments.starters.example import example_files

    _checked(name)
    _require_free(out)
    if robot not in names():
        raise ExperimentError(f"no shipped robot {robot!r}{did_you_mean(robot, names())}; known: {', '.join(names())}")
    _write(out, example_files(robot))


def new_plugin(name: str, kind: str, out: Path) -> None:
    """Write the package of a plug-in that installs and keeps its contract.

    ExperimentError if there is no such kind, the name cannot be one, or there is something of that name already.
    """
    if kind not in KINDS:
        raise ExperimentError(f"no kind of plug-in {kind!r}{did_you_mean(kind, KINDS)}; known: {', '.join(KINDS)}")
    of, module = KINDS[kind], _checked(name).replace("-", "_").lower()
    made = "".join(part.capitalize() for part in re.split(r"[-_]", name))
    words = {"name": name, "module": module, "name_of_class": made, "point": of.point, "what": of.what, "folder": out.name}
    words["use"] = of.use.replace("NAME", name)
    source = files("idbench.experiments.starters").joinpath("plugins", f"{kind}.py").read_text(encoding="utf-8")
    if any(name in table for table in TABLES):
        raise ExperimentError(f"{name!r} is the name of a plug-in already, which would be used instead: choose another")
    hides = re.search(rf"\b(class|import|as) {made}\b|\b{made}\(", source)
    if iskeyword(module) or iskeyword(made) or hides or find_spec(module):
        raise ExperimentError(f"{name!r} is taken, by a module {module} or by a class that {made} would hide: add a word")
    contents = {
        f"{module}.py": re.sub(r"\bStarter\b", made, source),
        f"tests/test_{module}.py": _rendered("test.py.j2", words),
        "pyproject.toml": _rendered("pyproject.toml.j2", words),
        "README.md": _rendered("README.md.j2", words),
    }
    _write(out, contents)


def _checked(name: str) -> str:
    if not NAME.fullmatch(name):
        raise ExperimentError(f"{name!r} cannot be a name: letters, digits, - and _; a letter first, a letter or digit last")
    return name


def _rendered(template: str, words: Mapping[str, str]) -> str:
    text = files("idbench.experiments.starters").joinpath(template).read_text(encoding="utf-8")
    made = Environment(undefined=StrictUndefined, keep_trailing_newline=True, autoescape=False)  # no HTML
    return made.from_string(text).render(words)


def _require_free(out: Path) -> None:
    if out.exists():
        raise ExperimentError(f"{out} exists: choose another name, or --out")


def _write(out: Path, contents: Mapping[str, str]) -> None:
    """Write files into a new folder, or a new file if there is but one without a name."""
    _require_free(out)
    try:
        with hidden_folder(folder_for(out.absolute().parent, "--out")) as hidden:
            for name, text in contents.items():
                path = hidden / out.name / name if name else hidden / out.name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            if (hidden / out.name).is_dir():
                (hidden / out.name).rename(out)  # which fails if there is one with files by now
            else:
                exchange(hidden / out.name, out, force=False)
    except FileExistsError:
        raise ExperimentError(f"{out} exists: choose another name, or --out") from None
    except OSError as error:
        raise ResultsError(f"cannot write {out}: {error.strerror}") from error
