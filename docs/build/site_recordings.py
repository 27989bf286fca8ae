"""The recordings that open in the page: made once, kept beside the pages, not committed.

A folder docs/build/recordings that is deleted is made anew with the next site; that takes half a minute.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).absolute().parent.parent
FOLDER = DOCS / "build" / "recordings"

RECORDINGS = {
    "delay": ("run delay --out OUT", "identify OUT --torque held --torque-delay 0 --label no-delay"),
    "ripple": ("run ripple --out OUT --inner 10 10.004",),
    "panda": ("run short-panda.toml --out OUT",),
}
"""Commands of idbench for each; OUT is where results go."""


def recordings() -> dict[str, Path]:
    """Return the recordings by their place in the site; make those that are missing."""
    FOLDER.mkdir(exist_ok=True)
    for name in RECORDINGS:
        if not (FOLDER / f"{name}.rrd").is_file():
            _make(name)
    return {f"recordings/{name}.rrd": FOLDER / f"{name}.rrd" for name in RECORDINGS}


def _make(name: str) -> None:
    with tempfile.TemporaryDirectory(prefix="idbench-") as folder:
        (Path(folder) / "short-panda.toml").write_text(_short_panda())
        commands = *RECORDINGS[name], f"view OUT --save {name}.rrd"
        for command in commands:
            _idbench(command.replace("OUT", f"runs/{name}").split(), Path(folder))
        (Path(folder) / f"{name}.rrd").replace(FOLDER / f"{name}.rrd")


def _short_panda() -> str:
    """Return a scenario of twelve moves: a recording that loads in a browser in some seconds."""
    from dataclasses import replace

    from idbench.sim.scenario.scenario_file import load, to_toml

    arm = load("arm")
    return to_toml(replace(arm, name="panda", robot="panda", trajectory=replace(arm.trajectory, moves=12)))


def _idbench(words: list[str], folder: Path) -> None:
    code = "from idbench.experiments.cli import entry; entry()"
    path = os.environ | {"PYTHONPATH": str(DOCS.parent)}
    done = subprocess.run(
        [sys.executable, "-c", code, *words], cwd=folder, env=path, capture_output=True, check=False, text=True
    )
    if done.returncode:
        raise RuntimeError(f"idbench {' '.join(words)}: {done.stderr}")
