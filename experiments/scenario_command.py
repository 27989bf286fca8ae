"""The command that writes scenarios."""

from pathlib import Path
from typing import Annotated

import tyro

from experiments.app import app
from experiments.errors import ExperimentError
from experiments.page import new_page, show
from experiments.results import write_whole
from sim.scenario_file import load, names, to_toml

File = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]


@app.command(name="scenario")
def scenario(name: tyro.conf.Positional[Annotated[str | None, tyro.conf.arg(metavar="NAME")]] = None, out: File = None) -> None:
    """Write a scenario out to start from, every setting explained; without a name, list those that ship.

    Args:
        name: Name of a scenario, or a file.
        out: File (TOML) to write; printed if none is given.
    """
    page = new_page()
    if name is None:
        for known in names():
            page.out(f"{known:16} {load(known).origin}")
    elif out is None:
        page.out(to_toml(load(name)).rstrip("\n"))
    elif out.exists():
        raise ExperimentError(f"{out} exists: choose another --out")
    else:
        write_whole(out, to_toml(load(name)))
        page.out(f"written to {out}; run it: uv run idbench run {out}")
    show(page)
