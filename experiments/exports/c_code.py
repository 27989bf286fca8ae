"""Functions of a robot as C99, for a controller: no memory, no globals, no dependencies but the mathematical library."""

import re
from math import isfinite, isnan
from pathlib import Path

from idbench.experiments.exports.code import OPERATIONS, Content, Language, body, identifiers, template
from idbench.experiments.exports.functions import Function

OF_INTERVAL = {
    "half": ("half_width", "half widths of 95 % intervals of the torques [N m]; NAN: not known"),
    "speed": ("fitted_speed", "speeds that 99 % of the fit stayed below [rad/s]"),
    "torque": ("fitted_torque", "torques that 99 % of the fit stayed below [N m]"),
}
"""Parts of an interval -> fields, and what they are."""

OF_C = {
    "where": "({} ? {} : {})",
    "abs": "fabs({})",
    "max": "fmax({}, {})",
    "min": "fmin({}, {})",
    "**": "pow({}, {})",
    "sign": "SIGN({})",
}


def c_texts(content: Content, path: Path) -> dict[str, str]:
    """Return the texts of the file with the functions and of its header, by their endings."""
    name = identifiers([path.stem])[0]
    return {".c": _source(content, name, f"{path.stem}.h"), ".h": _header(content, name)}


def _header(content: Content, name: str) -> str:
    of, upper = content.functions, name.upper()
    used = sorted(of.used)
    fields = [f"    {name}_real {field}; /* {unit} */" for field, unit in zip(content.names, of.basis.units, strict=True)]
    fields += [f"    {name}_real {field}[{of.n}]; /* {about} */" for field, about in OF_INTERVAL.values()]
    fields += [f"    {name}_real {field}[{of.n}]; /* as the log has it: set it */" for field in used]
    groups = [
        *(_number(x) for x in content.values),
        *(f"{{{', '.join(map(_number, content.interval[part]))}}}" for part in OF_INTERVAL),
        *("{0}" for _ in used),
    ]
    declared = "\n".join(f"/* {f.about} */\n{_prototype(f, name)};" for f in of.functions)
    return template("header.h").substitute(
        about=_comment(f"{of.tree.name}: {content.origin}"),
        joints=_comment(", ".join(joint.name for joint in of.tree.joints)),
        upper=upper,
        name=name,
        n=of.n,
        p=len(content.names),
        fields="\n".join(fields),
        values=", \\\n    ".join(groups),
        declared=declared,
        band=f"{content.interval['band'][0]:g}",
    )


def _source(content: Content, name: str, header: str) -> str:
    language = Language(
        OPERATIONS | OF_C,
        lambda x: f"(real){_number(x)}" if x >= 0 else f"((real){_number(x)})",
        lambda step: content.input(step, "p->{}", "p->{}[{}]" if step[1] in content.functions.used else "{}[{}]"),
        "    const real {} = {};",
    )
    written = "\n".join(_defined(content, language, function, name) for function in content.functions.functions)
    about = _comment(f"{content.functions.tree.name}: {content.origin}")
    words = {"about": about, "header": header, "name": name, "functions": written, "n": content.functions.n}
    return template("source.c").substitute(words)


def _prototype(function: Function, name: str, real: str = "") -> str:
    real = real or f"{name}_real"
    takes = "".join(f"const {real} *{argument}, " for argument in function.takes)
    return f"void {name}_{function.name}({takes}const struct {name}_parameters *p, {real} *{function.result})"


def _defined(content: Content, language: Language, function: Function, name: str) -> str:
    lines, results, _ = body(language, content.functions.tape, function)
    whole = "\n".join([*lines, *(f"    {function.result}[{k}] = {x};" for k, x in enumerate(results))])
    unused = [f"    (void){x};" for x in (*function.takes, "p") if not re.search(rf"\b{x}(\[|->)", whole)]
    return "\n".join([_prototype(function, name, "real"), "{", *unused, whole, "}", ""])


def _comment(text: str) -> str:
    return text.replace("*/", "* /").replace("\\", "/")


def _number(x: float) -> str:
    if not isfinite(x):
        return "NAN" if isnan(x) else "INFINITY" if x > 0 else "(-INFINITY)"
    return repr(float(x))
