"""Data sets of LeRobot: a folder with meta/info.json, and episodes in Parquet."""

import json
from pathlib import Path

from idbench.identify.errors import LogError

INFO = Path("meta") / "info.json"  # What describes a data set
SUFFIX = ".pos"  # What names of its joints end with


def data_file(path: Path) -> Path:
    """File with the episodes of a data set, or a path that is none; raise LogError if there is no such file, or are several."""
    if not (path.is_dir() and (path / INFO).is_file()):
        return path
    files = sorted((path / "data").rglob("*.parquet"))
    if len(files) != 1:
        names = ", ".join(str(file.relative_to(path)) for file in files[:4]) or "none"
        raise LogError(f"{path} is a data set with {len(files)} files of episodes ({names}): name one of them")
    return files[0]


def names_beside(path: Path) -> dict[str, tuple[str, ...]]:
    """Return the names of the entries of columns, by column, if a file is part of a data set that states them."""
    info = next((parent / INFO for parent in list(path.absolute().parents)[:3] if (parent / INFO).is_file()), None)
    if info is None:
        return {}
    try:
        features = json.loads(info.read_text(encoding="utf-8")).get("features", {})
        named = {name: of["names"] for name, of in features.items() if isinstance(of, dict) and of.get("names")}
        # Earlier versions have a table of lists: {"motors": [...]}.
        lists = {name: next(iter(x.values())) if isinstance(x, dict) else x for name, x in named.items()}
        return {name: tuple(str(one).removesuffix(SUFFIX) for one in x) for name, x in lists.items() if isinstance(x, list)}
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise LogError(f"{info} describes no data set: {error}") from error
