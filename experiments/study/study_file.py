"""Studies as TOML."""

from pathlib import Path
from typing import Any

from idbench.experiments.errors import StudyError
from idbench.experiments.study.axis import merge
from idbench.experiments.study.study import Study
from idbench.identify.plugins import did_you_mean
from idbench.sim.errors import ScenarioError
from idbench.sim.scenario.scenario_file import from_dict, load, to_dict
from idbench.sim.settings import fields_of, make, read_toml

FOLDER = Path(__file__).parent.parent / "studies"


def names() -> tuple[str, ...]:
    """Return the names of the studies that ship."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def load_study(name: str) -> Study:
    """Return the study that ships as `name`, or that of a TOML file; StudyError if there is none, or it cannot be run."""
    if not name.endswith(".toml") and name not in names():
        hint = did_you_mean(name, names())
        raise StudyError(f"no study {name!r}{hint}; known: {', '.join(names())}, or give the path of a TOML file (.toml)")
    path = Path(name) if name.endswith(".toml") else FOLDER / f"{name}.toml"
    return study_from(read_toml(path, "study", StudyError), f"study {name}")


def study_from(content: dict[str, Any], what: str) -> Study:
    """Make a study from the keys of a TOML document, its scenario written out in full; raise StudyError."""
    made, known = dict(content), [*fields_of(Study), "settings"]
    try:
        for key in made:
            if key not in known:
                hint = did_you_mean(key, known)
                raise StudyError(f"unknown key {key!r}{hint}; known: {', '.join(known)}")
        if "scenario" not in made:
            raise StudyError("key 'scenario' is missing: the name of a scenario, a file (TOML), or a table")
        made["scenario"] = _scenario(made.get("scenario"), made.pop("settings", {}))
        if not isinstance(made.get("axes", []), (list, tuple)):
            raise StudyError("axes must be tables: write [[axes]], with a field and values, for each")
        for axis in made.get("axes", ()):
            if isinstance(axis, dict) and not isinstance(axis.get("values", []), (list, tuple)):
                raise StudyError(f"axis {axis.get('field')}: values = {axis['values']!r:.60} must be a list, [ ... ]")
        made["axes"] = tuple(made.get("axes", ()))
        study: Study = make(Study, made, "")
    except (ScenarioError, StudyError) as error:
        raise StudyError(f"{what}: {error}") from error
    return study


def _scenario(base: Any, changes: Any) -> dict[str, Any]:
    """Return the scenario `base`, a name or a table, with the settings that a study changes."""
    if not isinstance(base, (str, dict)):
        raise StudyError("key 'scenario' must name a scenario or a file (TOML), or be a table")
    content = to_dict(load(base)) if isinstance(base, str) else base
    if not isinstance(changes, dict):
        raise StudyError(f"settings = {changes!r:.60} must be a table of settings of the scenario")
    return to_dict(from_dict(merge(content, changes)))
