"""Tables of what is shown in a Python session: as text, and in a notebook."""

from collections.abc import Sequence
from html import escape
from math import isnan

Rows = Sequence[Sequence[str]]


def text_table(title: str, heads: Sequence[str], rows: Rows) -> str:
    """Return a table as aligned text: names to the left, numbers to the right."""
    every = [list(heads), *map(list, rows)]
    widths = [max(len(row[k]) for row in every) for k in range(len(heads))]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(x.rjust(w) for x, w in zip(row[1:], widths[1:], strict=True))]) for row in every
    ]
    return "\n".join([title, *(line.rstrip() for line in lines)])


def html_table(title: str, heads: Sequence[str], rows: Rows) -> str:
    """Return a table as HTML, as notebooks show it."""
    head = "".join(f"<th>{escape(x)}</th>" for x in heads)
    body = "".join(f"<tr><th>{escape(row[0])}</th>{''.join(f'<td>{escape(x)}</td>' for x in row[1:])}</tr>" for row in rows)
    return f"<div>{escape(title)}</div><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def significant(x: float, sigma: float) -> tuple[str, str]:
    """Return a value and its standard error, both to the second digit of the error."""
    if not (sigma > 0 and abs(x) < 1e300 and sigma < 1e300):
        return f"{x:.5g}", "" if isnan(sigma) else f"{sigma:.2g}"
    digits = max(2, len(f"{abs(x) / sigma:.0f}") + 1)
    return f"{x:.{min(digits, 12)}g}", f"{sigma:.2g}"
