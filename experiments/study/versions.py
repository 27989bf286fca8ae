"""The versions on which the bits of a result depend."""

from functools import cache
from importlib.metadata import PackageNotFoundError, version

from idbench.experiments.errors import StudyError

MADE_BY = ("idbench", "mujoco", "numpy", "scipy", "ruckig")


@cache
def versions() -> dict[str, str]:
    """Return the versions of the packages on which the bits of a result depend."""
    return {name: _version(name) for name in MADE_BY}


def require_versions(theirs: dict[str, str], whose: str) -> None:
    """Raise StudyError if the versions of another place are not those of this process."""
    other = [f"{name} {theirs.get(name)} (here {here})" for name, here in versions().items() if theirs.get(name) != here]
    if other:
        raise StudyError(f"{whose} has {', '.join(other)}: the same study needs the same versions everywhere")


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"
