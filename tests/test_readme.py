"""The README shows what is true: its code runs and prints what it says, its excerpt is what `table1` prints."""

import re
import subprocess
import sys

import pytest

from experiments.cli import main


@pytest.fixture(scope="module")
def readme(root):
    return (root / "README.md").read_text()


def block(readme, heading, language):
    section = readme.split(heading)[1]
    return re.search(rf"```{language}\n(.*?)```", section, re.DOTALL)[1]


def test_the_excerpt_is_what_table1_prints_and_the_example_prints_its_answer(readme, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["table1"]) == 0
    printed = {line.rstrip() for line in capsys.readouterr().out.splitlines()}
    shown = [line.rstrip() for line in block(readme, "The first simulates", "text").splitlines()]
    assert [line for line in shown if line not in printed] == []
    example, answer = block(readme, "## Identify", "python"), block(readme, "## Identify", "text")
    done = subprocess.run([sys.executable, "-c", example], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == answer


def test_every_file_it_links_to_is_there(root):
    for page in [root / "README.md", *(root / "docs").glob("*.md"), root / "CONTRIBUTING.md"]:
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_every_plugin_is_in_its_table(readme):
    from experiments.plugins import TABLES

    for table in TABLES:
        (row,) = re.findall(rf"^\| `{table.point}` \| (.*?) \|", readme, re.MULTILINE)
        assert set(re.findall(r"`(\w+)`", row)) == set(table), table.point


def test_the_causes_in_the_docs_are_those_computed(root, table1):
    from experiments.causes import causes

    text = (root / "docs" / "table1.md").read_text()
    for name, worst in causes(table1):
        cells = [f"{error:.1g}" for w in worst.values() for error in (w.inertia, w.friction)]
        if name == "all three":
            assert max(map(float, cells)) < 0.00002
        else:
            assert f"| {name} | {' | '.join(cells)} |" in text
