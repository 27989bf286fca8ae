"""Tables of what is shown in a Python session: as text, and in a notebook."""

from collections.abc import Sequence
from decimal import Decimal
from html import escape
from math import floor, isfinite, log10

SMALLEST, LARGEST = -3, 6  # Powers of ten beyond these are written as such
DIGITS = 1e-13  # Standard errors over values from here on are rounding

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


def concise(x: float, sigma: float) -> str:
    """Return a value with its standard error in the last digits, to the second digit of the error (GUM, section 7.2.2).

    A value whose error is not known has a question mark; one without an error stands alone.

    Examples
    --------
    >>> concise(0.48878, 0.0033), concise(-0.3, 1.2), concise(12345.6, 230.0), concise(1.234e-7, 4.5e-9)
    ('0.4888(33)', '-0.3(1.2)', '12350(230)', '1.234(45)e-07')
    """
    if not (isfinite(x) and isfinite(sigma)):
        return f"{x:.5g}(?)"
    if sigma <= max(DIGITS * abs(x), 1e-300):
        return f"{x:.6g}"
    last = floor(log10(sigma)) - 1
    if (digits := round(sigma / 10.0**last)) == 100:
        digits, last = 10, last + 1
    rounded = round(x / 10.0**last)
    power = max(len(str(abs(rounded))), len(str(digits))) - 1 + last
    power = 0 if SMALLEST <= power <= LARGEST else power
    places = power - last
    error = Decimal(digits).scaleb(-places if places < 2 else 0)
    value = Decimal(rounded).scaleb(-places)
    return f"{value:.{max(places, 0)}f}({error:f})" + (f"e{power:+03d}" if power else "")
