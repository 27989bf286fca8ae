"""Functions of a robot as a module of Python that needs nothing: of numbers, and of arrays or symbols of other packages."""

import re
from math import isfinite, isnan
from pprint import pformat
from textwrap import fill

from idbench.experiments.exports.code import OPERATIONS, Content, Language, body, template
from idbench.experiments.exports.functions import Function

TAB = 4 * " "  # How lines are indented


def python_text(content: Content) -> str:
    """Return the module."""
    of = content.functions
    language = Language(
        OPERATIONS | {"**": "({} ** {})"},
        _constant,
        lambda step: content.input(step, "p.{}", "p.{}[{}]" if step[1] in of.used else "{}_{}"),
        "    {} = {}",
    )
    used = sorted(of.used)
    fields = [f"    {name}: float  # {unit}" for name, unit in zip(content.names, of.basis.units, strict=True)]
    fields += [f"    {name}: tuple = (0.0,) * {of.n}  # as the log has it" for name in used]
    return template("module.py").substitute(
        name=_quoted(of.tree.name),
        origin=_quoted(content.origin),
        n=of.n,
        joints=pformat(tuple(joint.name for joint in of.tree.joints), width=110),
        fields="\n".join(fields) if fields else "    pass",
        values="\n".join(f"    {name}={_constant(x)}," for name, x in zip(content.names, content.values, strict=True)),
        sigma=_listed([_number(x) for x in content.sigma]),
        **{part: _listed([_number(x) for x in values]) for part, values in content.interval.items()},
        functions="\n\n".join(_defined(content, language, function) for function in of.functions),
    )


def _quoted(text: str) -> str:
    """Return text as it can stand in a docstring."""
    return text.replace("\\", "/").replace('"', "'")


def _listed(words: list[str]) -> str:
    text = f"[{', '.join(words)}]"
    return text if len(text) < 100 else f"[\n{fill(', '.join(words), 120, initial_indent='    ', subsequent_indent='    ')},\n]"


def _constant(x: float) -> str:
    if not isfinite(x):
        return "math.nan" if isnan(x) else "math.inf" if x > 0 else "(-math.inf)"
    return repr(float(x)) if x >= 0 else f"({float(x)!r})"


def _number(x: float) -> str:
    return f"{x:.6g}" if isfinite(x) else "math.nan"


def _defined(content: Content, language: Language, function: Function) -> str:
    lines, results, called = body(language, content.functions.tape, function)
    words = set(re.findall(r"\w+", "\n".join([*lines, *results])))
    given = {name: [f"{name}_{j}" for j in range(content.functions.n)] for name in function.takes}
    unpacked = [
        fill(f"{', '.join(x if x in words else '_' for x in parts)}, = {name}", 120, initial_indent=TAB, subsequent_indent=TAB)
        for name, parts in given.items()
        if words.intersection(parts)
    ]
    unpacked = [line.replace("\n", " \\\n") for line in unpacked]
    functions = [f"    {name} = f.{name}" for name in sorted(called)]
    takes, shape = ", ".join(function.takes), ", ".join(["...", *map(str, function.shape)])
    outer = [
        f"def {function.name}({takes}, p=IDENTIFIED):",
        f'    """Return {function.about}, shape ({shape})."""',
        f"    return _called(_{function.name}, {function.shape!r}, p, ({takes},))",
    ]
    whole = ["[", *(f"{2 * TAB}{x}," for x in results), f"{TAB}]"]
    inner = [f"def _{function.name}(f, p, {takes}):", *functions, *unpacked, *lines, f"{TAB}return {whole[0]}", *whole[1:]]
    return "\n".join([*outer, "", "", *inner, ""])
