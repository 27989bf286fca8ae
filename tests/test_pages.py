"""The pages: their tables are those of the results, their sentences can be read, their code runs."""

import ast
import json
import re
import subprocess
import sys
from dataclasses import replace

import pytest

from idbench.identify.files.log_file import write_log
from idbench.sim.engine import simulate
from idbench.sim.scenario.scenario_file import load


@pytest.fixture(scope="module")
def tables(root):
    sys.path.insert(0, str(root / "docs" / "build"))
    try:
        import tables
    finally:
        sys.path.pop(0)
    return tables


def test_tables_are_made_of_the_results(root, tables):
    assert {"benchmark.md", "results-estimators.md", "answers.md"} <= set(tables.PAGES)
    for page in tables.PAGES:
        text = (root / "docs" / page).read_text()
        assert tables.filled(text) == text, f"{page}: uv run python docs/build/tables.py"


@pytest.fixture(scope="module")
def logs(tmp_path_factory, table1):
    """A folder with the logs that the pages name."""
    folder = tmp_path_factory.mktemp("pages")
    for place in ("runs/table1", "runs/arm-puma560"):
        (folder / place).mkdir(parents=True)
    write_log(table1.log, folder / "runs/table1/log.parquet")
    write_log(simulate(load("quantization")).alone(), folder / "log.csv")
    arm = replace(load("arm"), robot="puma560", fs=250.0)
    short = replace(arm, trajectory=replace(arm.trajectory, moves=12))
    write_log(simulate(short).alone(), folder / "runs/arm-puma560/log.parquet")
    return folder


@pytest.mark.thorough
@pytest.mark.parametrize("page", ["python.md", "noise.md", "plugins.md", "loads.md"])
def test_the_code_of_a_page_runs(root, logs, page):
    for code in re.findall(r"```python\n(.*?)```", (root / "docs" / page).read_text(), re.DOTALL):
        done = subprocess.run([sys.executable, "-c", code], cwd=logs, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_diagrams_are_those_of_their_script(root):
    sys.path.insert(0, str(root / "docs" / "build"))
    try:
        from diagrams import DIAGRAMS
    finally:
        sys.path.pop(0)
    for name, diagram in DIAGRAMS.items():
        assert (root / "docs" / f"{name}.svg").read_text() == diagram.svg(), "uv run python docs/build/diagrams.py"
        assert all({start, end} <= set(diagram.boxes) for start, end, _ in diagram.arrows)


def test_notebooks_are_those_of_their_scripts(root):
    """What the site runs are the scripts; the notebooks beside them hold the same cells, without outputs."""
    scripts = sorted((root / "docs" / "notebooks").glob("*.py"))
    assert len(scripts) == 6
    for script in scripts:
        cells = json.loads(script.with_suffix(".ipynb").read_text())["cells"]
        code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
        assert all(not cell.get("outputs") for cell in cells)
        source = script.read_text()
        assert all(piece in source for piece in code), "uv run --group docs python docs/build/notebooks.py"
        texts = [node for node in ast.parse(source).body if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)]
        assert len(cells) - len(code) == len(texts), script.name


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["comparison", "first_fit", "half_an_hour", "own_estimator", "own_law", "your_arm"])
def test_a_notebook_runs_from_top_to_bottom(root, tmp_path, name):
    source = (root / "docs" / "notebooks" / f"{name}.py").read_text()
    code = source.split("from idbench.experiments.recording.notebook")[0]  # a viewer is for notebooks alone
    (tmp_path / "cells.py").write_text(code)  # a law is written from its source, which is in a file
    done = subprocess.run([sys.executable, "cells.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
