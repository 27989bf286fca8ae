"""The robots that ship with idbench, as MJCF: one folder a robot."""

from pathlib import Path

FOLDER = Path(__file__).parent


def names() -> tuple[str, ...]:
    """Return the names of the robots."""
    return tuple(sorted(path.parent.name for path in FOLDER.glob("*/*.xml") if path.stem == path.parent.name))


def path(name: str) -> Path:
    """Return the MJCF file of robot `name`.

    Raises
    ------
    KeyError
        If there is no such robot; the message lists the known ones.
    """
    if name not in names():
        raise KeyError(f"no robot {name!r}; known: {', '.join(names())}")
    return FOLDER / name / f"{name}.xml"
