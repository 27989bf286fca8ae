"""The identified inverse dynamics as a Python function that needs NumPy alone."""

from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from pprint import pformat

from idbench.experiments.exports.friction_terms import lines_of
from idbench.experiments.exports.standard import require_known, standard_of
from idbench.experiments.identification.fit import Fit
from idbench.identify.data.kinematics import INERTIAL, Joint


def python_text(fit: Fit, model: str, target: Path) -> str:
    """Return the module: recursive Newton and Euler, with the parameters of a model's estimate.

    Raises
    ------
    ExperimentError
        If the estimate has a law of friction that the function does not have.
    """
    require_known(fit.robot_model, target)
    tree, values = fit.robot_model.tree, standard_of(fit, model)
    n = tree.n
    each = {x: [values.get(f"{x}{j + 1}", 0.0) for j in range(n)] for x in ("Ia", "Fv", "Fs", "off")}
    text = files("idbench.experiments.exports").joinpath("inverse_dynamics.py.txt").read_text(encoding="utf-8")
    words = {
        "{laws}": "".join(f"    {line}\n" for line in lines_of(fit, values)),
        "{name}": tree.name,
        "{version}": version("idbench"),
        "{logs}": ", ".join(fit.logs.names) or "a log",
        "{n}": str(n),
        "{joints}": pformat(tuple(joint.name for joint in tree.joints), width=110),
        "{model!r}": repr(model),
        "{estimator!r}": repr(fit.request.estimator),
        "{gravity}": repr([float(x) for x in tree.gravity]),
        "{tree}": pformat([_joint(joint) for joint in tree.joints], width=110),
        "{links}": pformat([[values.get(f"{x}{j + 1}", 0.0) for x in INERTIAL] for j in range(n)], width=110),
        **{f"{{{x}}}": repr(of) for x, of in each.items()},
    }
    for mark, word in words.items():
        text = text.replace(mark, word)
    return text


def _joint(joint: Joint) -> tuple[object, ...]:
    """Return a joint as the function has it."""
    lists = (joint.position, joint.rotation, joint.axis, joint.anchor)
    return (joint.parent, joint.kind == "slide", *(x.tolist() for x in lists), float(joint.zero))
