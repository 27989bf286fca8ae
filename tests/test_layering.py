"""The arrows between the packages: who may import whom, and which libraries each may use."""

import ast
import sys

import pytest

OURS = {"models", "sim", "identify", "experiments"}

CONTRACT = {
    "idbench.identify.basis",
    "idbench.identify.basis.friction.shape",
    "idbench.identify.basis.block",
    "idbench.identify.data.motion_log",
    "idbench.identify.data.kinematics",
    "idbench.identify.plugins",
    "idbench.identify.errors",
    "idbench.identify.blame",
    "idbench.identify.compiled",
}
"""What `sim` may know of `identify`: contract types, laws of friction, plug-in tables, and whose mistake it is."""

ALLOWED = {
    "models": set(),
    "identify": {"identify", "numpy", "scipy"},
    "sim": {"sim", "models", "numpy", "mujoco", "ruckig", "pydantic"},
    "experiments": {"experiments", "sim", "identify", "models", "numpy", "rerun", "rerun_cli", "rich"},
}

ALLOWED_IN = {
    "experiments/cli/parser.py": {"cyclopts"},
    "identify/files/arrow.py": {"pyarrow"},
    "identify/files/log_file.py": {"pyarrow"},
    "identify/files/ros_bag.py": {"rosbags"},
    "identify/telling.py": {"threadpoolctl"},
    "sim/scenario/scenario_file.py": {"tomli_w"},
    "sim/trajectories/recorded.py": {"scipy"},
    "experiments/recording/stream.py": {"pyarrow"},
    "experiments/recording/comparison_recording.py": {"pyarrow"},
    "experiments/recording/compared.py": {"scipy"},
    "experiments/starters/starters.py": {"jinja2"},
    "experiments/study/study.py": {"pydantic"},
    "experiments/requests/table.py": {"pydantic"},
    "experiments/exports/ranges.py": {"tomli_w"},
    "experiments/servo/identification.py": {"tomli_w"},
    "experiments/study/store.py": {"pyarrow", "tomli_w"},
    "experiments/study/job.py": {"threadpoolctl"},
    "experiments/study/cluster.py": {"dask", "distributed", "threadpoolctl"},
    "experiments/study/statistics.py": {"scipy"},
    "experiments/reports/log_picture.py": {"matplotlib", "scipy"},
    "experiments/study/figures.py": {"matplotlib"},
    "experiments/paper/motions.py": {"matplotlib"},
    "experiments/study/study_results.py": {"tomli_w"},
    "experiments/reports/excite.py": {"matplotlib"},
    "experiments/reports/drawn.py": {"matplotlib"},
    "experiments/reports/figures.py": {"jinja2"},
}
"""Libraries that one file alone may use."""


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield from (f"idbench.{alias.name}" for alias in node.names) if node.module == "idbench" else (node.module,)


@pytest.mark.parametrize("package", ALLOWED)
def test_arrows(package, root):
    files = sorted((root / package).rglob("*.py"))
    assert files
    for path in files:
        name = path.relative_to(root).as_posix()
        for module in imports(path):
            top = module.split(".")[1 if module.startswith("idbench.") else 0]
            if package == "sim" and top == "identify":
                assert module in CONTRACT, f"{name} imports {module}"
            elif top in OURS or top not in sys.stdlib_module_names:
                assert top in ALLOWED[package] | ALLOWED_IN.get(name, set()), f"{name} imports {module}"


def test_the_command_line_is_known_to_itself_alone(root):
    """Jobs, studies and sets of logs call functions: nobody writes a command that is parsed."""
    for path in (path for folder in OURS for path in (root / folder).rglob("*.py")):
        if not path.is_relative_to(root / "experiments" / "cli"):
            assert not any(module.startswith("idbench.experiments.cli") for module in imports(path)), path


def test_nobody_is_imported_under_two_names(root):
    """`idbench.sim` and `sim` would be two modules, with two classes of each name."""
    places = [root / folder for folder in (*OURS, "tests", "docs", "src")]
    for path in (path for place in places for path in place.rglob("*.py")):
        assert not {module.split(".")[0] for module in imports(path)} & OURS, path


def test_models_hold_no_dynamics(root):
    """Models are MJCF and the few lines that find it."""
    assert [path.name for path in (root / "models").rglob("*.py")] == ["__init__.py"]
