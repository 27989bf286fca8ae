"""Control characters: names of files and joints come from others, and a terminal would obey them."""

CONTROL = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t"}
"""Control characters, and what is printed in their place."""


def visible(text: str) -> str:
    """Return text without control characters, which a terminal would obey."""
    return text.translate(CONTROL)
