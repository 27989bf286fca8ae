"""What the project says of itself agrees with itself."""

import re
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import version

import pytest


@pytest.fixture(scope="module")
def project(root):
    return tomllib.loads((root / "pyproject.toml").read_text())


def test_one_version(root, project):
    stated = project["project"]["version"]
    assert version("idbench") == stated
    assert f"version: {stated}\n" in (root / "CITATION.cff").read_text()
    assert f"## [{stated}]" in (root / "CHANGELOG.md").read_text()


def test_everything_that_is_needed_is_pinned(project):
    """A new machine installs the versions that the tests passed with."""
    names = [re.match(r"[\w-]+", entry)[0] for entry in project["project"]["dependencies"]]
    more = [*project["dependency-groups"].values(), *project["project"]["optional-dependencies"].values()]
    names += [re.match(r"[\w-]+", entry)[0] for group in more for entry in group if isinstance(entry, str)]
    pinned = {entry.split("==")[0] for entry in project["tool"]["uv"]["constraint-dependencies"]}
    assert set(names) <= pinned


def test_no_registry_and_no_machine_is_named(root):
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=root, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip("not a git checkout")
    pattern = re.compile("|".join(["py" + r"pi\.org", "python" + "hosted", "/ro" + "ot/", "/wo" + "rk/", "/ho" + r"me/\w"]))
    for name in listed.stdout.split():
        path = root / name
        assert name != "uv.lock"
        if path.suffix not in {".png", ".webp", ".rrd", ".parquet"} and path.is_file():
            assert not pattern.search(path.read_text()), name


def test_a_checkout_without_links_is_complete(root, tmp_path):
    """As Git for Windows makes it: links are text files. Without the folders that they name it says what is missing."""
    package = tmp_path / "src" / "idbench"
    package.mkdir(parents=True)
    shutil.copy(root / "src" / "idbench" / "__init__.py", package)
    for name in ("experiments", "identify", "models", "sim"):
        (package / name).write_text(f"../../{name}")
    code = "import idbench, idbench.sim; print(idbench.fit.__module__, idbench.sim.__file__)"

    def imported():
        env = {"PYTHONPATH": str(tmp_path / "src")}
        return subprocess.run([sys.executable, "-c", code], env=env, cwd=tmp_path, capture_output=True, text=True, check=False)

    assert f"there is no folder sim in {package}" in imported().stderr
    for name in ("experiments", "identify", "models", "sim"):
        shutil.copytree(root / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    assert str(tmp_path / "sim") in imported().stdout
