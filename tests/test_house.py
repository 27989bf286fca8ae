"""What keeps the house as it is: no circle of files, one class of a name, fewer and fewer lines, where equations stand."""

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

LINES = 56_500

BASES = {"Plant", "Table", "Steps", "Command", "WrittenOptions", "RecordedOptions", "LogRequest", "LoadRequest"}
"""Classes that are used as they are, and inherited from."""

PLAIN_LOOPS = {
    "ancestors": "walks from a link to the ground",
    "hidden": "takes out one parameter after the other",
    "_of_joint": "walks from jump to jump",
    "_numbered": "tries frequencies one after the other",
    "_multipliers": "yields",
    "_noise": "sums over blocks of rows",
}
"""Functions of `identify` that have a loop without end, or with a number of turns, and no iteration in it."""


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
    """Whoever lowers the number of lines writes it here; nobody raises it."""
    assert sum(len(path.read_text().splitlines()) for room in ROOMS for path in (root / room).rglob("*.py")) <= LINES


def test_nothing_inherits_from_what_is_not_abstract(syntax):
    """Errors apart: they are caught by their bases."""
    concrete = {node.name for tree in syntax.values() for node in tree.body if isinstance(node, ast.ClassDef)}
    concrete = {name for name in concrete if not re.match("_?Abstract", name)} - BASES
    for name, tree in syntax.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and not node.name.endswith("Error"):
                bases = {ast.unparse(base).partition("[")[0] for base in node.bases}
                assert not bases & concrete, f"{name}.{node.name} inherits from {bases & concrete}"


def test_files_can_be_read_at_one_sitting(root):
    for room in ROOMS:
        for path in (root / room).rglob("*.py"):
            assert len(path.read_text().splitlines()) <= 300, path


def test_values_are_assigned_line_by_line(syntax):
    """Three values at once only where one call gives them."""
    for name, tree in syntax.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple):
                assert len(node.targets[0].elts) < 3, f"{name}, line {node.lineno}"


def test_what_iterates_names_its_equation(syntax):
    """The next iterate as a function of the last: a reader of the loop knows what it converges to."""
    for name, tree in syntax.items():
        if not name.startswith("idbench.identify"):
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and node.name not in PLAIN_LOOPS and any(map(_iterates, ast.walk(node))):
                text = ast.get_docstring(node) or ""
                assert re.search(r" [=<>] |Eq\. ", text), f"{name}.{node.name} iterates: its docstring has no equation"


def _iterates(node):
    counted = isinstance(node, ast.For) and ast.unparse(node.target) == "_" and ast.unparse(node.iter).startswith("range(")
    return isinstance(node, ast.While) or counted


def test_names_of_parameters_are_made_in_one_place(syntax):
    """`named(letters, joint)`; nobody else counts joints from 1 in a parameter's name."""
    for name, tree in syntax.items():
        if name.endswith("basis.parameter") or not name.startswith(("idbench.sim", "idbench.identify.basis")):
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr):
                text = ast.unparse(node)
                assert not re.fullmatch(r"f['\"](\{[^{}]+\}|[A-Z]\w*)\{j \+ 1\}['\"]", text), (
                    f"{name}, line {node.lineno}: {text}"
                )


def test_numbers_say_what_they_are(root):
    """A number at module level has a text below it, or a comment: what it limits, its unit, where it is from."""
    for room in ROOMS:
        for path in (root / room).rglob("*.py"):
            text = path.read_text()
            lines, body = text.splitlines(), ast.parse(text).body
            for node, below in zip(body, [*body[1:], None], strict=True):
                if not isinstance(node, ast.Assign) or not _has_number(node) or "Annotated" in ast.unparse(node):
                    continue
                described = isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
                beside = any("#" in line for line in lines[node.lineno - 2 : node.end_lineno])
                if not (described or beside or "sets" in path.parts or ast.unparse(node.targets[0]).startswith(("_", "("))):
                    raise AssertionError(f"{path.name}, line {node.lineno}: what is {ast.unparse(node.targets[0])}?")


def _has_number(node):
    return any(isinstance(each, ast.Constant) and type(each.value) in (int, float) for each in ast.walk(node.value))
