"""A sentence for people that programs act on."""

from typing import Self


class Note(str):
    """A sentence, with what decides about it; no program searches its words."""

    option: str
    """The option of the command line that mends what it says; empty if none was shown to."""
    finding: str
    """What was found, without question and advice; the whole sentence by default."""
    about: str
    """What it is about, for those who print that elsewhere."""

    def __new__(cls, words: str, *, option: str = "", finding: str = "", about: str = "") -> Self:
        """Return the sentence with its marks."""
        made = super().__new__(cls, words)
        made.option = option
        made.finding = finding or words
        made.about = about
        return made


def noted(sentence: str) -> Note:
    """A sentence with its marks; without any if it has none."""
    return sentence if isinstance(sentence, Note) else Note(sentence)
