"""What the program is called where it runs: in a clone `uv run idbench`, installed `idbench`."""

import sys
from functools import cache
from pathlib import Path


@cache
def program() -> str:
    """Command that runs it: environments of a clone lie beside its pyproject.toml."""
    try:
        cloned = 'name = "idbench"' in (Path(sys.prefix).parent / "pyproject.toml").read_text(encoding="utf-8")
    except (OSError, ValueError):  # ValueError: of another project, in another encoding
        cloned = False
    return "uv run idbench" if cloned else "idbench"
