"""Functions of a robot as a module of Python that needs nothing: of numbers, and of arrays or symbols of other packages."""

import re
from math import isfinite, isnan
from pprint import pformat
from textwrap import fill

from idbench.experiments.exports.code import OPERATIONS, Content, Language, body
from idbench.experiments.exports.functions import Function

TAB = 4 * " "  # How lines are indented

HEAD = '''"""{name}: {origin}.

    tau = inverse_dynamics(q, qd, qdd)

takes joints in the order of JOINTS, in rad, rad/s, rad/s^2 and N m (m and N of slides): lists of numbers, arrays of NumPy
of shape (..., {n}), or lists of symbols of CasADi or SymPy. Parameters of links are base parameters: masses and
inertias of single links are no physical ones, their torques are exact. It needs nothing but Python.
"""

import math
import sys
from types import SimpleNamespace
from typing import NamedTuple

JOINTS = {joints}


class Parameters(NamedTuple):
    """Base parameters, with what a log says beside motion and torque."""

{fields}


IDENTIFIED = Parameters(
{values}
)
SIGMA = {sigma}

# Of each joint: half widths of 95 % intervals of the torques up to BAND [Hz]; 99 % of the fit's speeds and torques are smaller.
HALF_WIDTHS = {half}
BAND, = {band}
FITTED_SPEEDS = {speed}
FITTED_TORQUES = {torque}


'''

TAIL = '''
def torque_interval(q, qd, qdd):
    """Return half widths of 95 % intervals of the torques up to BAND [N m], shape (..., {n}); nan where a joint is too fast."""

    def half(f, p, q, qd, qdd):
        each = zip(qd, HALF_WIDTHS, FITTED_SPEEDS)
        return [f.where(f.abs(v) > speed, math.nan, width) for v, width, speed in each]

    return _called(half, ({n},), None, (q, qd, qdd))


def outside_fit(q, qd, qdd, p=IDENTIFIED):
    """Return where a joint is faster, or has a larger torque, than in 99 % of the fit, shape (..., {n})."""
    tau = inverse_dynamics(q, qd, qdd, p)
    if hasattr(qd, "ndim"):
        numpy = sys.modules["numpy"]
        return (abs(qd) > numpy.asarray(FITTED_SPEEDS)) | (abs(tau) > numpy.asarray(FITTED_TORQUES))
    each = zip(qd, tau, FITTED_SPEEDS, FITTED_TORQUES)
    return [abs(v) > speed or abs(x) > torque for v, x, speed, torque in each]


MATHEMATICS = (
    "sin", "cos", "tan", "sinh", "cosh", "tanh", "atan", "asinh", "exp", "expm1", "log", "log1p", "sqrt", "hypot", "copysign",
)
NUMBERS = SimpleNamespace(
    **{x: getattr(math, x) for x in MATHEMATICS}, abs=abs, max=max, min=min,
    sign=lambda x: float(x > 0) - float(x < 0), where=lambda condition, a, b: a if condition else b,
)
NAMES = {
    "abs": ("fabs", "abs", "Abs"), "max": ("fmax", "maximum", "Max"), "min": ("fmin", "minimum", "Min"), "sign": ("sign",),
    "atan": ("atan", "arctan"), "asinh": ("asinh", "arcsinh"), "where": ("if_else", "where"),
}


def _functions_of(values):
    """Return the functions for values: those of the package that symbols among them are from."""
    symbol = next((x for x in values if not isinstance(x, (int, float))), None)
    if symbol is None:
        return NUMBERS
    package = sys.modules[type(symbol).__module__.partition(".")[0]]

    def found(name):
        return next((getattr(package, other) for other in NAMES.get(name, (name,)) if hasattr(package, other)), None)

    return SimpleNamespace(**{name: found(name) for name in vars(NUMBERS)})


def _called(function, shape, p, motion):
    """Return what a function gives: a list for lists, an array for arrays of NumPy, with more axes first."""
    if not hasattr(motion[0], "ndim"):
        return function(_functions_of([x for each in motion for x in each]), p, *motion)
    numpy = sys.modules["numpy"]
    motion = [numpy.asarray(x, dtype=float) for x in motion]
    if motion[0].ndim == 1:
        return numpy.asarray(function(NUMBERS, p, *(x.tolist() for x in motion))).reshape(shape)
    functions = _functions_of([motion[0]])
    values = function(functions, p, *([x[..., j] for j in range(len(JOINTS))] for x in motion))
    zero = 0.0 * sum(x[..., 0] for x in motion)
    return numpy.stack([zero + x for x in values], -1).reshape((*zero.shape, *shape))
'''


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
    head = HEAD.format(
        name=_quoted(of.tree.name),
        origin=_quoted(content.origin),
        n=of.n,
        joints=pformat(tuple(joint.name for joint in of.tree.joints), width=110),
        fields="\n".join(fields) if fields else "    pass",
        values="\n".join(f"    {name}={_constant(x)}," for name, x in zip(content.names, content.values, strict=True)),
        sigma=_listed([_number(x) for x in content.sigma]),
        **{part: _listed([_number(x) for x in values]) for part, values in content.interval.items()},
    )
    functions = "\n\n".join(_defined(content, language, function) for function in of.functions)
    return f"{head}{functions}\n{TAIL.replace('{n}', str(of.n))}"


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
