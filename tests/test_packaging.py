"""What the project says of itself agrees with itself."""

import re
import subprocess
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
