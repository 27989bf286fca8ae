"""The pages: their tables are those of the results, their code runs and prints what they say, what they link to is there."""

import ast
import json
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.paper.table1 import causes
from idbench.experiments.plugin_tables import TABLES
from idbench.identify import MODELS, MotionLog, TorqueChannel, identify_each
from idbench.identify.files.log_file import write_log
from idbench.sim.engine import simulate
from idbench.sim.scenario.scenario_file import load


def fenced(root, page, language="python"):
    """Return the code blocks of a page."""
    return re.findall(rf"```{language}\n(.*?)```", (root / page).read_text(), re.DOTALL)


def printed_by(*words, cwd=None):
    """Return what Python prints."""
    done = subprocess.run([sys.executable, *words], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def tables(root):
    sys.path.insert(0, str(root / "docs" / "build"))
    try:
        import tables
    finally:
        sys.path.pop(0)
    return tables


def test_tables_are_made_of_the_results(root, tables):
    assert {"benchmark.md", "estimators.md", "answers.md"} <= set(tables.PAGES)
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
    for code in fenced(root, f"docs/{page}"):
        printed_by("-c", code, cwd=logs)


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
    printed_by("cells.py", cwd=tmp_path)


@pytest.mark.thorough
def test_the_excerpt_is_what_table1_prints_and_the_example_prints_its_answer(root, tmp_path, monkeypatch, capsys):
    def after(heading, language):
        text = (root / "README.md").read_text().partition(heading)[2]
        return re.search(rf"```{language}\n(.*?)```", text, re.DOTALL)[1]

    monkeypatch.chdir(tmp_path)
    assert main(["table1"]) == 0
    printed = {line.rstrip() for line in capsys.readouterr().out.splitlines()}
    shown = [line.rstrip() for line in after("The first simulates", "text").splitlines()]
    assert [line for line in shown if line not in printed] == []
    assert printed_by("-c", after("**Build on it.**", "python")) == after("**Build on it.**", "text")


def test_the_workers_of_slurm_are_jobs_of_eight(root):
    """The script makes a job, here without SLURM and on loopback."""
    (script,) = fenced(root, "docs/studies.md")
    options = '{"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}'
    loopback = f"SLURMCluster(scheduler_options={options}, "
    dry = script.replace("SLURMCluster(", loopback).replace("cluster.scale(jobs=10)", "print(cluster.job_script())")
    dry = dry.replace('input("Enter ends the workers")', "cluster.close()")
    job = printed_by("-c", dry)
    assert "#SBATCH --cpus-per-task=8" in job
    assert "--nworkers 8" in job
    assert "tcp://127.0.0.1" in job


def test_every_file_that_a_page_links_to_is_there(root):
    for page in [root / "README.md", *(root / "docs").glob("*.md"), root / "CONTRIBUTING.md"]:
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
            made_of = page.parent / target.replace("-", "_").replace(".md", ".py")  # pages of notebooks are made of scripts
            assert (page.parent / target).exists() or made_of.exists(), f"{page.name}: {target}"


def test_every_plugin_is_in_its_table(root):
    page = (root / "docs" / "plugins.md").read_text()
    for table in TABLES:
        (row,) = re.findall(rf"^\| `{table.point}` \| (.*?) \|", page, re.MULTILINE)
        assert set(re.findall(r"`([\w+-]+)`", row)) == set(table.builtin), table.point


def test_the_causes_in_the_docs_are_those_computed(root, table1):
    text = (root / "docs" / "appendix.md").read_text()
    for name, worst in causes(table1):
        cells = [f"{error:.1g}" for w in worst.values() for error in (w.inertia, w.friction)]
        if name == "all three":
            assert max(map(float, cells)) < 0.00002
        else:
            assert f"| {name} | {' | '.join(cells)} |" in text


def test_the_pendulum_of_the_docs_is_identified_by_all_models(root):
    """Its torque is written down here once more, by hand."""
    page = {}
    exec(compile(fenced(root, "docs/python.md")[-1], "python.md", "exec"), page)
    t = np.arange(6000) / 100
    q = 0.9 * np.sin(2 * t) + 0.6 * np.sin(3.1 * t)
    qd = 1.8 * np.cos(2 * t) + 1.86 * np.cos(3.1 * t)
    qdd = -3.6 * np.sin(2 * t) - 5.766 * np.sin(3.1 * t)
    tau = 0.8 * qdd + 9.81 * (1.2 * np.cos(q) + 0.1 * np.sin(q)) + 0.3 * qd + 0.5 * np.sign(qd)
    log = MotionLog(100.0, q[:, None], tau[:, None], TorqueChannel("instantaneous"))
    models = {name: MODELS.create(name) for name in MODELS.builtin if name != "explicit+power"}  # which GLS refuses
    for estimate in identify_each(log, page["pendulum"], models).values():
        np.testing.assert_allclose(estimate.X, [0.8, 1.2, -0.1, 0.3, 0.5], rtol=1e-4)
