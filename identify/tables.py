"""Tables of what is shown in a Python session: as text, and in a notebook."""

from collections.abc import Sequence
from html import escape
from math import floor, log10

SMALLEST = -3
"""Powers of ten below this are written as such."""

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

    Examples
    --------
    >>> concise(0.48878, 0.0033), concise(-0.3, 1.2), concise(12345.6, 230.0), concise(1.234e-7, 4.5e-9)
    ('0.4888(33)', '-0.3(1.2)', '12350(230)', '1.234(45)e-07')
    """
    if not (sigma > 0 and abs(x) < 1e300 and sigma < 1e300):
        return f"{x:.5g}"
    last = floor(log10(sigma)) - 1
    if (digits := round(sigma / 10.0**last)) == 100:
        digits, last = 10, last + 1
    power = floor(log10(max(abs(x), sigma)))
    power = power if power < SMALLEST else 0
    decimals = max(power - last, 0)
    error = f"{digits * 10.0 ** (last - power):.{decimals}f}" if last - power >= -1 else f"{digits}"
    mantissa = round(x / 10.0**last) * 10.0 ** (last - power)
    return f"{mantissa:.{decimals}f}({error})" + (f"e{power:+03d}" if power else "")
