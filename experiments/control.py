"""Control characters: names of files and joints come from others, and a terminal would obey them."""

CONTROL = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t"}
"""Control characters, and what is printed in their place."""


LONGEST = 160
"""Characters of a name that are shown."""


def shortened(name: object) -> str:
    """Return a name, its middle left out if it is very long."""
    text = str(name)
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]}...{text[-LONGEST // 4 :]} ({len(text)} characters)"


def visible(text: str) -> str:
    """Return text without control characters, which a terminal would obey."""
    return text.translate(CONTROL)
