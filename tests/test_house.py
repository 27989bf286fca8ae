"""What keeps the house as it is: no circle of files, one class of a name, inheritance from abstract classes, fewer lines."""

import ast
import re
import sys
from collections import defaultdict

import pytest

ROOMS = ("models", "sim", "identify", "experiments")

SAME_NAME = {
    "Starter": "templates that users begin with: each is a package of its own when it is written",
}
"""Classes of one name in several files, and why."""

LINES = {".py": 53_287, ".c": 705, ".h": 28, ".txt": 321, ".j2": 278}
"""Lines of Python, of C, and of templates of code and pages."""

BASES = {"Plant", "Table", "Command", "WrittenOptions", "RecordedOptions", "LogRequest", "LoadRequest"}
"""Classes that are used as they are, and inherited from."""


def modules(root):
    """Return the syntax of every module by its name."""
    paths = [path for room in ROOMS for path in (root / room).rglob("*.py")]
    names = {path: "idbench." + path.relative_to(root).with_suffix("").as_posix().replace("/", ".") for path in paths}
    return {name.removesuffix(".__init__"): ast.parse(path.read_text()) for path, name in names.items()}


@pytest.fixture(scope="module")
def syntax(root):
    return modules(root)


def loaded(body):
    """Yield the modules that are imported when a module is: not inside functions, not for types alone."""
    for node in body:
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
            yield node.module
        elif isinstance(node, ast.If) and ast.unparse(node.test) != "TYPE_CHECKING":
            yield from loaded(node.body)


def test_no_circle_of_files(syntax):
    arrows = {name: {other for other in loaded(tree.body) if other in syntax} - {name} for name, tree in syntax.items()}
    sys.setrecursionlimit(10_000)
    done, doing = set(), []

    def visit(name):
        assert name not in doing, " -> ".join([*doing[doing.index(name) :], name])
        if name in done:
            return
        doing.append(name)
        for other in sorted(arrows[name]):
            visit(other)
        done.add(doing.pop())

    # A package's own table imports its files: arrows to it are arrows to what is named.
    tables = {name for name in syntax if any(other.startswith(f"{name}.") for other in syntax)}
    for name in arrows:
        arrows[name] -= {table for table in tables if name.startswith(f"{table}.")}
    for name in syntax:
        visit(name)


def test_one_class_of_a_name(syntax):
    places = defaultdict(list)
    for name, tree in syntax.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(name)
    assert {name for name, where in places.items() if len(where) > 1} == SAME_NAME.keys()


def test_the_house_only_gets_smaller(root):
    """Whoever lowers a number of lines writes it here; nobody raises one."""
    for suffix, most in LINES.items():
        paths = [path for room in ROOMS for path in (root / room).rglob(f"*{suffix}")]
        assert sum(len(path.read_text().splitlines()) for path in paths) <= most, suffix


def test_nothing_inherits_from_what_is_not_abstract(syntax):
    """Errors apart: they are caught by their bases."""
    concrete = {node.name for tree in syntax.values() for node in tree.body if isinstance(node, ast.ClassDef)}
    concrete = {name for name in concrete if not re.match("_?Abstract", name)} - BASES
    for name, tree in syntax.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and not node.name.endswith("Error"):
                bases = {ast.unparse(base).partition("[")[0] for base in node.bases}
                assert not bases & concrete, f"{name}.{node.name} inherits from {bases & concrete}"
