"""The README shows what is true: its code runs and prints what it says, its excerpt is what `table1` prints."""

import re
import subprocess
import sys

import numpy as np
import pytest

import idbench
from idbench.experiments.cli import main
from idbench.identify import MODELS, MotionLog, TorqueChannel, identify_each


@pytest.fixture(scope="module")
def readme(root):
    return (root / "README.md").read_text()


def block(readme, heading, language):
    section = readme.split(heading)[1]
    return re.search(rf"```{language}\n(.*?)```", section, re.DOTALL)[1]


@pytest.mark.thorough
def test_the_excerpt_is_what_table1_prints_and_the_example_prints_its_answer(readme, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["table1"]) == 0
    printed = {line.rstrip() for line in capsys.readouterr().out.splitlines()}
    shown = [line.rstrip() for line in block(readme, "The first simulates", "text").splitlines()]
    assert [line for line in shown if line not in printed] == []
    example, answer = block(readme, "**Build on it.**", "python"), block(readme, "**Build on it.**", "text")
    done = subprocess.run([sys.executable, "-c", example], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == answer


def test_the_workers_of_slurm_are_jobs_of_eight(root):
    """The script makes a job, here without SLURM and on loopback."""
    page = (root / "docs" / "studies.md").read_text()
    (script,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    options = '{"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}'
    loopback = f"SLURMCluster(scheduler_options={options}, "
    dry = script.replace("SLURMCluster(", loopback).replace("cluster.scale(jobs=10)", "print(cluster.job_script())")
    dry = dry.replace('input("Enter ends the workers")', "cluster.close()")
    done = subprocess.run([sys.executable, "-c", dry], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "#SBATCH --cpus-per-task=8" in done.stdout
    assert "--nworkers 8" in done.stdout
    assert "tcp://127.0.0.1" in done.stdout


def test_every_file_it_links_to_is_there(root):
    for page in [root / "README.md", *(root / "docs").glob("*.md"), root / "CONTRIBUTING.md"]:
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
            made_of = page.parent / target.replace("-", "_").replace(".md", ".py")  # pages of notebooks are made of scripts
            assert (page.parent / target).exists() or made_of.exists(), f"{page.name}: {target}"


def test_every_plugin_is_in_its_table(root):
    from idbench.experiments.plugin_tables import TABLES

    page = (root / "docs" / "plugins.md").read_text()
    for table in TABLES:
        (row,) = re.findall(rf"^\| `{table.point}` \| (.*?) \|", page, re.MULTILINE)
        assert set(re.findall(r"`([\w-]+)`", row)) == set(table.builtin), table.point


def test_the_causes_in_the_docs_are_those_computed(root, table1):
    from idbench.experiments.paper.table1 import causes

    text = (root / "docs" / "appendix.md").read_text()
    for name, worst in causes(table1):
        cells = [f"{error:.1g}" for w in worst.values() for error in (w.inertia, w.friction)]
        if name == "all three":
            assert max(map(float, cells)) < 0.00002
        else:
            assert f"| {name} | {' | '.join(cells)} |" in text


def pages(root):
    return re.findall(r"```python\n(.*?)```", (root / "docs" / "python.md").read_text(), re.DOTALL)


@pytest.mark.thorough
def test_the_recipe_for_a_log_in_csv_works(root, tmp_path, table1):
    log = table1.log
    columns = np.column_stack([log.t, log.q, log.tau])
    np.savetxt(tmp_path / "log.csv", columns, delimiter=",", header="t,q1,q2,tau1,tau2", comments="")
    log = idbench.read_log(tmp_path / "log.csv", torque="instantaneous")
    found = repr(idbench.fit(log, "scara", model="explicit")).splitlines()
    printed = {line.split()[0]: float(line.split()[1].partition("(")[0]) for line in found[-8:]}
    np.testing.assert_allclose(list(printed.values()), list(table1.truth.values()), rtol=1e-4)


def test_the_pendulum_of_the_docs_is_identified_by_all_models(root):
    """Its torque is written down here once more, by hand."""
    page = {}
    exec(compile(pages(root)[-1], "python.md", "exec"), page)
    t = np.arange(6000) / 100
    q = 0.9 * np.sin(2 * t) + 0.6 * np.sin(3.1 * t)
    qd = 1.8 * np.cos(2 * t) + 1.86 * np.cos(3.1 * t)
    qdd = -3.6 * np.sin(2 * t) - 5.766 * np.sin(3.1 * t)
    tau = 0.8 * qdd + 9.81 * (1.2 * np.cos(q) + 0.1 * np.sin(q)) + 0.3 * qd + 0.5 * np.sign(qd)
    log = MotionLog(100.0, q[:, None], tau[:, None], TorqueChannel("instantaneous"))
    models = {name: MODELS.create(name) for name in MODELS.builtin}
    for estimate in identify_each(log, page["pendulum"], models).values():
        np.testing.assert_allclose(estimate.X, [0.8, 1.2, -0.1, 0.3, 0.5], rtol=1e-4)


@pytest.mark.thorough
def test_the_example_of_the_virtual_robot_runs(root):
    (example,) = re.findall(r"```python\n(.*?)```", (root / "docs" / "virtual-robot.md").read_text(), re.DOTALL)
    done = subprocess.run([sys.executable, "-c", example], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["explicit", "power"]
