"""Plug-ins of another package: found by their entry points, named in errors, refused when they are not what they promise."""

import re
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from idbench.identify import ESTIMATORS, AbstractEstimator, PluginError
from idbench.identify.plugins import PluginTable


def blocks(root, language):
    """Return the fenced code blocks of the page about plug-ins."""
    return re.findall(rf"```{language}\n(.*?)```", (root / "docs" / "plugins.md").read_text(), re.DOTALL)


def install(folder, module, source, entries):
    """Lay out an installed distribution: a module and its metadata."""
    (folder / f"{module}.py").write_text(source)
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(entries)


def python(code, folder, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(folder))
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, cwd=folder, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def readme_package(tmp_path, root):
    """The package that the page shows, installed where Python finds it."""
    friction, estimator = blocks(root, "python")
    (toml,) = blocks(root, "toml")
    entries = re.sub(r'\[project\.entry-points\."(.*?)"\]', r"[\1]", toml).replace('"', "")
    for source in (friction, estimator):
        assert sum(1 for line in source.splitlines() if line.strip() and "import" not in line) <= 15
    install(tmp_path, "mybench", friction + estimator, entries)
    return tmp_path


def test_the_readmes_package_is_listed(readme_package, monkeypatch):
    listed = python("from idbench.experiments.cli import main; main(['list'])", readme_package, monkeypatch)
    assert re.search(r"drag\s+Drag that grows with the square of the velocity", listed)
    assert re.search(r"plain-TLS\s+Least squares that allows for noise in W", listed)


@pytest.mark.thorough
def test_the_readmes_friction_is_identified_by_all_models_with_its_estimator(readme_package, monkeypatch):
    """A robot with quadratic drag, known to no file of this project, gives its drag back in all three models."""
    out = python(
        """
        import numpy as np
        from idbench.experiments.paper.table1 import SCENARIO, Table1
        from idbench.identify import BLOCKS, ESTIMATORS, MODELS, MotionLog, identify, scara
        from idbench.sim.scenario.scenario_file import load
        table = Table1(load(SCENARIO), ("idbench",))
        log, qd = table.log, table.reference.qd
        dragged = MotionLog(log.fs, log.q, log.tau + [0.03, 0.004] * qd * abs(qd), log.torque)
        basis = scara() + BLOCKS.create("drag")
        for model in ("explicit", "implicit", "power"):
            print(*identify(dragged, basis, MODELS.create(model), estimator=ESTIMATORS.create("plain-TLS")).X[-2:])
        """,
        readme_package,
        monkeypatch,
    )
    np.testing.assert_allclose(np.array(out.split(), float).reshape(3, 2), [[0.03, 0.004]] * 3, rtol=1e-3)


@pytest.mark.thorough
def test_the_readmes_estimator_identifies_every_run_by_itself(readme_package, monkeypatch, truth):
    """A run in a batch is what it is alone; without noise the truth, with noise not what OLS gives."""
    out = python(
        """
        import numpy as np
        from idbench.experiments.paper.table1 import SCENARIO, Table1
        from idbench.identify import ESTIMATORS, ExplicitModel, MotionLog, identify, scara
        from idbench.sim.scenario.scenario_file import load
        log = Table1(load(SCENARIO), ()).log
        noise = np.random.default_rng(1).normal(size=(3, *log.tau.shape)) * [[[0.0]], [[1.0]], [[2.0]]]
        noisy = MotionLog(log.fs, np.broadcast_to(log.q, noise.shape), log.tau + noise, log.torque)
        alone = MotionLog(log.fs, log.q, log.tau + noise[2], log.torque)
        X = identify(noisy, scara(), ExplicitModel(), estimator=ESTIMATORS.create("plain-TLS")).X
        print(*X[0], *(X[2] - identify(alone, scara(), ExplicitModel(), estimator=ESTIMATORS.create("plain-TLS")).X))
        print(*(X[2] - identify(alone, scara(), ExplicitModel(), estimator=ESTIMATORS.create("OLS")).X))
        """,
        readme_package,
        monkeypatch,
    )
    exact, same, other = np.array(out.split(), float).reshape(3, 8)
    np.testing.assert_allclose(exact, truth, rtol=1e-6)
    np.testing.assert_allclose(same, 0.0, atol=1e-12)
    assert np.abs(other).max() > 1e-6


def test_a_table_is_a_mapping():
    assert "OLS" in ESTIMATORS
    assert "nothing" not in ESTIMATORS
    assert ESTIMATORS.get("nothing") is None


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("raise RuntimeError('no licence')\n", r"'own' \(other:Own\) cannot be loaded: RuntimeError: no licence"),
        ("class Own: pass\n", "'own' makes Own, not AbstractEstimator"),
        ("class Own:\n    def __init__(self, x): pass\n", "'own' cannot be made without arguments"),
    ],
    ids=["not loaded", "another kind", "not made"],
)
def test_a_plugin_that_is_not_what_it_promises_is_named_and_listed_with_its_reason(tmp_path, monkeypatch, source, said):
    install(tmp_path, "other", source, "[idbench.estimators]\nown = other:Own\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "other", raising=False)
    table = PluginTable("estimators", AbstractEstimator, {})
    assert list(table) == ["own"]
    with pytest.raises(PluginError, match=said):
        table.create("own")
    assert "cannot be made" in table.summary("own") or "__init__" not in source


def test_names_that_are_taken_are_told(tmp_path, monkeypatch):
    """One named like a built-in is not used, two of one name cannot be told apart."""
    for package, name in (("thief", "OLS"), ("one", "RIDGE"), ("two", "RIDGE")):
        install(tmp_path, package, "class Own: pass\n", f"[idbench.estimators]\n{name} = {package}:Own\n")
    monkeypatch.syspath_prepend(tmp_path)
    table = PluginTable("estimators", AbstractEstimator, {"OLS": ESTIMATORS["OLS"]})
    taken, shared = table.conflicts
    assert taken == "OLS is built in, thief (thief:Own) of the same name is not used: rename it"
    assert shared == "RIDGE is provided by one (one:Own) and two (two:Own): rename or remove all but one"
    with pytest.raises(PluginError, match=r"'RIDGE' is provided by one \(one:Own\) and two \(two:Own\)"):
        table.create("RIDGE")


def test_conflicts_are_listed(tmp_path, monkeypatch):
    install(tmp_path, "thief", "class Own: pass\n", "[idbench.estimators]\nOLS = thief:Own\n")
    listed = python("from idbench.experiments.cli import main; main(['list'])", tmp_path, monkeypatch)
    assert "warning: estimators plug-in OLS is built in, thief (thief:Own) of the same name is not used" in listed
