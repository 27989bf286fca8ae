"""Laws of friction beyond viscous and Coulomb friction, as lines of a controller's function."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.identify import AbstractBlock, ShapedFriction
from idbench.identify.basis import LoadFriction
from idbench.identify.basis.of_joints import inner_of

TERMS: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "Fva": ("np.abs(qd)", {}),
    "Fst": ("np.exp(-((np.abs(qd) / {vs}) ** {exponent})) * np.sign(qd)", {"vs": "vs", "exponent": "ds"}),
    "Fp": ("np.abs(qd) ** {exponent} * np.sign(qd)", {"exponent": "ap"}),
    "Ft": ("np.tanh(qd / {vt})", {"vt": "vt"}),
    "Fat": ("2 / np.pi * np.arctan(qd / {vat})", {"vat": "vat"}),
    "Fl": ("np.abs(load) * np.sign(qd)", {}),
}
"""Letters of a law -> its torque of a unit parameter, and the letters of its settings."""


def lines_of(fit: Fit, values: Mapping[str, float]) -> list[str]:
    """Return the lines that add the laws to `tau`, whose torque without friction is `load`."""
    n, lines = fit.basis.n, list[str]()
    for block in fit.basis.blocks:
        law = _law(block)
        letters = getattr(law, "symbol", "Fl" if isinstance(law, LoadFriction) else "")
        if letters not in TERMS or not any(f"{letters}{j + 1}" in values for j in range(n)):
            continue
        text, settings = TERMS[letters]
        each = {name: [values.get(f"{x}{j + 1}", _fixed(law, name)) for j in range(n)] for name, x in settings.items()}
        torque = text.format(**{name: _array(x) for name, x in each.items()})
        lines.append(f"tau = tau + {_array([values.get(f'{letters}{j + 1}', 0.0) for j in range(n)])} * {torque}")
    return lines


def _law(block: AbstractBlock) -> Any:
    """Return the law of a block, of some joints, with unknown shapes or without."""
    inner = inner_of(block)
    return inner.law if isinstance(inner, ShapedFriction) else inner


def _fixed(law: Any, setting: str) -> float:
    """Return what a setting is where it is no parameter."""
    return float(np.max(getattr(law, setting)))


def _array(values: list[float]) -> str:
    return f"np.array({[float(f'{x:.12g}') for x in values]})"
