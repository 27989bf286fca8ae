"""Spectra of the residuals, joint by joint, beside those of the estimated noise."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.identify import MODELS, Array, Instants, instants, noise_spectra, spectrum

RESOLUTION = 0.5
"""Distance of the frequencies [Hz]."""


@dataclass(frozen=True)
class Spectrum:
    """Amplitude densities of a joint, or of a model that has no rows of joints."""

    row: str
    """Name of the joint, or of the model."""
    joint: int | None
    """Number of the joint, from 0; None for the only row of a model."""
    unit: str
    """Of the densities, times √Hz."""
    f: Array
    """Frequencies [Hz], without 0, shape (frequency,)."""
    lines: Mapping[str, Array]
    """Of what each model leaves, and of the noise of torques and of positions, shape (frequency,) each."""


def left_over(fit: Fit) -> dict[str, Instants]:
    """Return the residuals of each model's equations, at every sample of the first log."""
    signals, basis, chain = fit.problem.signals[0], fit.basis, fit.processing
    return {form: instants(signals, basis, MODELS.create(form), chain, e.X) for form, e in fit.estimates.items()}


def of_joints(fit: Fit, left: Mapping[str, Instants]) -> dict[str, Instants]:
    """Return the residuals of models that have a row for each joint."""
    return {form: one for form, one in left.items() if form != "power" and len(one.residual) == fit.basis.n}


def spectra(fit: Fit, left: Mapping[str, Instants]) -> Iterator[Spectrum]:
    """Yield the spectra of all joints, then those of models that have other rows; what is masked counts as like the rest."""
    alone, fs, joined = fit.on(0), fit.logs.fitted[0].fs, of_joints(fit, left)
    noise: dict[str, Array] = {}
    for j, joint in enumerate(fit.robot_model.robot.joints) if joined else ():
        lines = {form: _density(one, j, fs) for form, one in joined.items()}
        f = next(iter(lines.values()))[0]
        if "explicit" in joined and not noise:
            levels = alone.estimates["explicit"].noise_levels
            each = noise_spectra(alone.problem, levels, f)
            noise = dict(zip(("torque noise", "position noise"), each, strict=True))
        shown = {form: density for form, (_, density) in lines.items()} | {kind: each[j] for kind, each in noise.items()}
        yield Spectrum(joint, j, fit.robot_model.units(j)[0], f[1:], {name: density[1:] for name, density in shown.items()})
    for form in (form for form in left if form not in joined):
        f, density = _density(left[form], 0, fs)
        yield Spectrum(form, None, "W", f[1:], {form: density[1:]})


def _density(left: Instants, row: int, fs: float) -> tuple[Array, Array]:
    weight = left.weight[row]
    f, density = spectrum(left.residual[row] * weight, fs, RESOLUTION)
    return f, density / np.sqrt(max(np.mean(weight**2), 1e-12))
