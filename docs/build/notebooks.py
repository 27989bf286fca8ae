"""Notebooks: written as scripts of cells, run from top to bottom, made into pages.

    uv run --group docs python docs/build/notebooks.py        # writes docs/notebooks/*.ipynb anew, without outputs

A cell of text is a string; all else up to the next one is a cell of code.
"""

import ast
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import nbformat
from nbconvert import MarkdownExporter
from nbconvert.preprocessors import ExecutePreprocessor

FOLDER = Path(__file__).parent.parent / "notebooks"

PATIENCE = 300
"""Time that a cell may take [s]."""


def pages() -> dict[str, str]:
    """Return the pages of all notebooks, by their place in the site, their code run."""
    found = {}
    for script in sorted(FOLDER.glob("*.py")):
        made = executed(notebook(script))
        for cell in made.cells:  # widgets, such as a viewer, are for notebooks alone
            cell["outputs"] = [output for output in cell.get("outputs", []) if _is_text(output)]
        body, _ = MarkdownExporter(exclude_input_prompt=True).from_notebook_node(made)
        name = script.stem.replace("_", "-")
        found[f"notebooks/{name}.md"] = f"{body}\n*This page is the notebook `docs/notebooks/{script.stem}.ipynb`, run.*\n"
    return found


def _is_text(output: nbformat.NotebookNode) -> bool:
    """Return whether an output is printed text, or a table."""
    data = output.get("data", {})
    return bool(output.output_type == "stream" or ("text/html" in data and not any("widget" in kind for kind in data)))


def notebook(script: Path) -> nbformat.NotebookNode:
    """Return the notebook of a script."""
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    made = nbformat.v4.new_notebook(metadata={"kernelspec": kernel})
    made.cells = list(_cells(script.read_text(encoding="utf-8")))
    for number, cell in enumerate(made.cells):
        cell.id = f"cell-{number}"
    return made


def _cells(source: str) -> Iterator[nbformat.NotebookNode]:
    lines, code = source.splitlines(), list[str]()
    position = 0
    for node in ast.parse(source).body:
        is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        if is_text:
            code += lines[position : node.lineno - 1]
            if text := "\n".join(code).strip():
                yield nbformat.v4.new_code_cell(text)
            code = []
            yield nbformat.v4.new_markdown_cell(node.value.value.strip())
        else:
            code += lines[position : node.end_lineno]
        position = node.end_lineno or position
    if text := "\n".join([*code, *lines[position:]]).strip():
        yield nbformat.v4.new_code_cell(text)


def executed(made: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Return a notebook with the outputs of its cells; raise CellExecutionError if one fails."""
    with tempfile.TemporaryDirectory(prefix="idbench-") as folder:
        ExecutePreprocessor(timeout=PATIENCE).preprocess(made, {"metadata": {"path": folder}})
    return made


if __name__ == "__main__":
    for path in sorted(FOLDER.glob("*.py")):
        nbformat.write(notebook(path), path.with_suffix(".ipynb"))
    sys.exit(0)
