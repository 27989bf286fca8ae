"""Functions of a robot as C99, for a controller: no memory, no globals, no dependencies but the mathematical library."""

import re
from math import isfinite, isnan
from pathlib import Path

from idbench.experiments.exports.code import OPERATIONS, Content, Language, body, identifiers
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


def _opening(content: Content, upper: str, name: str) -> str:
    """Return the header's beginning: what it is of, and the type of its numbers."""
    of = content.functions
    return f"""/* {_comment(f"{of.tree.name}: {content.origin}")}.

   Joints: {_comment(", ".join(joint.name for joint in of.tree.joints))}.
   Units are rad, rad/s, rad/s^2 and N m (m and N of slides).
   Compile with -D{upper}_REAL=float for single precision, and with -lm.
*/
#ifndef {upper}_H
#define {upper}_H

#include <math.h>

#ifndef {upper}_REAL
#define {upper}_REAL double
#endif

#ifdef __cplusplus
extern "C" {{
#endif

typedef {upper}_REAL {name}_real;

"""


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
    return f"""{_opening(content, upper, name)}#define {upper}_JOINTS {of.n}
#define {upper}_PARAMETERS {len(content.names)}

/* Base parameters: those of links are sums of standard ones, as `idbench robot` prints them. */
struct {name}_parameters {{
{chr(10).join(fields)}
}};

/* As identified: const struct {name}_parameters p = {upper}_IDENTIFIED; */
#define {upper}_IDENTIFIED {{ \\
    {(", " + chr(92) + chr(10) + "    ").join(groups)} \\
}}

{declared}
/* Half widths of 95 % intervals of the torques up to {content.interval["band"][0]:g} Hz [N m], within the speeds of the fit. */
void {name}_torque_interval(const struct {name}_parameters *p, {name}_real *half);
/* Number of joints that are faster, or have a larger torque, than in 99 % of the fit. */
int {name}_outside_fit(const {name}_real *q, const {name}_real *qd, const {name}_real *qdd, const struct {name}_parameters *p);

#ifdef __cplusplus
}}
#endif
#endif
"""


def _source(content: Content, name: str, header: str) -> str:
    language = Language(
        OPERATIONS | OF_C,
        lambda x: f"(real){_number(x)}" if x >= 0 else f"((real){_number(x)})",
        lambda step: content.input(step, "p->{}", "p->{}[{}]" if step[1] in content.functions.used else "{}[{}]"),
        "    const real {} = {};",
    )
    written = "\n".join(_defined(content, language, function, name) for function in content.functions.functions)
    n = content.functions.n
    return f"""/* {_comment(f"{content.functions.tree.name}: {content.origin}")}. */

#include "{header}"
#include <tgmath.h>

typedef {name}_real real;

#define SIGN(x) ((real)(((x) > 0) - ((x) < 0)))

{written}
void {name}_torque_interval(const struct {name}_parameters *p, real *half)
{{
    for (int j = 0; j < {n}; j++) half[j] = p->half_width[j];
}}

int {name}_outside_fit(const real *q, const real *qd, const real *qdd, const struct {name}_parameters *p)
{{
    real tau[{n}];
    int count = 0;
    {name}_inverse_dynamics(q, qd, qdd, p, tau);
    for (int j = 0; j < {n}; j++) count += fabs(qd[j]) > p->fitted_speed[j] || fabs(tau[j]) > p->fitted_torque[j];
    return count;
}}
"""


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
