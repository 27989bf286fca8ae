"""Reports of servos and payloads: verdict, parameters, pictures; one HTML file that needs no other."""

from importlib.metadata import version

from idbench.experiments.document import Document
from idbench.experiments.reports.figures import rendered


def page_of(document: Document, command: str) -> str:
    """The page of a result, with the command that makes it again."""
    shown = {"document": document, "figures": document.figures(), "command": command, "version": version("idbench")}
    return rendered("idbench.experiments.reports", "plain.html.j2", title=document.title, **shown)
