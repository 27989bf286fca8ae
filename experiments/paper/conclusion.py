"""The paper's conclusion, as the study `models` finds it: are the three models equal, and is power the one to take?"""

import json
from importlib.resources import files

from idbench.experiments.program import program
from idbench.experiments.study.ratios import RatioRow, conclusion


def conclusion_line() -> str:
    """Conclusion below the paper's tables, and the command that computes it.

    The ratios of the study `models` over 200 motions ship with the package.
    """
    text = files("idbench.experiments.paper").joinpath("conclusion.json").read_text(encoding="utf-8")
    found: list[RatioRow] = json.loads(text)["ratios"]
    of = f"{min(row['runs'] for row in found)} motions or more; {program()} study models --seeds 200"
    return f"The paper's conclusion, with 95 % confidence intervals ({of}): {conclusion(found)}"
