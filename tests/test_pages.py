"""The pages: their tables are those of the results, their sentences can be read, their code runs."""

import re
import sys

import pytest


@pytest.fixture(scope="module")
def tables(root):
    sys.path.insert(0, str(root / "docs" / "build"))
    try:
        import tables
    finally:
        sys.path.pop(0)
    return tables


@pytest.mark.parametrize("page", ["answers.md", "noise.md"])
def test_tables_are_made_of_the_results(root, tables, page):
    text = (root / "docs" / page).read_text()
    assert tables.MARK.search(text)
    assert tables.filled(text) == text, "uv run python docs/build/tables.py"


def pages(root):
    return [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").glob("*.md"))]


def prose(text):
    """Return the paragraphs and items of a page, without code, tables and headings."""
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    blocks = re.split(r"\n\s*\n|\n(?=\s*(?:- |\d+\. ))", text)
    return [" ".join(b.split()) for b in blocks if b.strip() and not re.match(r"\s*(\||#|!\[|<|    )", b)]


def test_sentences_are_short_and_paragraphs_no_walls(root):
    """Twenty words a sentence on every page, in the mean; none of more than fifty; paragraphs of five lines."""
    for path in pages(root):
        paragraphs = prose(path.read_text())
        sentences = [s for p in paragraphs for s in re.split(r"(?<=[.:;?!])\s+", p) if len(s.split()) > 2]
        lengths = [len(s.split()) for s in sentences]
        assert sum(lengths) / len(lengths) <= 20, path.name
        assert max(lengths) <= 50, f"{path.name}: {max(sentences, key=lambda s: len(s.split()))}"
        longest = max(paragraphs, key=len)
        assert len(longest) <= 5 * 128, f"{path.name}: {longest}"
