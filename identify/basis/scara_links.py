"""The planar two-joint SCARA in closed form, with the columns of the paper's section 7.1."""

from dataclasses import dataclass
from typing import final

from identify.arrays import Columns
from identify.basis.basis import Basis
from identify.basis.block import AbstractConservativeBlock
from identify.basis.friction.coulomb import CoulombFriction
from identify.basis.friction.viscous import ViscousFriction
from identify.basis.parameter import Parameter
from identify.errors import SettingError
from identify.signals.state import State


@final
@dataclass(frozen=True)
class ScaraLinks(AbstractConservativeBlock):
    """Links of a planar two-joint arm: ZZR1, ZZ2, LMX2, LMY2.

    ZZR1 = ZZ1 + Ia1 + L^2 M2 (both about joint 1), ZZ2 about joint 2, LMX2 = L MX2 and LMY2 = L MY2. The axes are
    parallel to gravity, so no parameter of it appears. The energy of ZZ2 is 1/2 (qd1 + qd2)^2; the paper prints
    1/2 (qd1^2 + qd2^2), which neither Eq. 10 nor its own explicit columns agree with.
    """

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return the four inertial parameters; raise SettingError unless n = 2."""
        if n != 2:
            raise SettingError(f"the SCARA links describe 2 joints, not {n}")
        links = {"ZZR1": 0, "ZZ2": 1, "LMX2": 1, "LMY2": 1}
        return tuple(Parameter(name, joint, "inertia", "kg m^2") for name, joint in links.items())

    def explicit(self, state: State) -> Columns:
        """Return D (Eq. 5, 6)."""
        c2, s2 = state.cos_sin(1)
        qd1, qd2 = state.qd[..., 0, :], state.qd[..., 1, :]
        qdd1, qdd2 = state.qdd[..., 0, :], state.qdd[..., 1, :]
        qdd12, a = qdd1 + qdd2, 2 * qdd1 + qdd2
        b, qd1_squared = qd2 * (2 * qd1 + qd2), qd1 * qd1
        return {
            (0, "ZZR1"): qdd1,
            (0, "ZZ2"): qdd12,
            (1, "ZZ2"): qdd12,
            (0, "LMX2"): a * c2 - b * s2,
            (1, "LMX2"): qdd1 * c2 + qd1_squared * s2,
            (0, "LMY2"): -a * s2 - b * c2,
            (1, "LMY2"): qd1_squared * c2 - qdd1 * s2,
        }

    def momentum(self, state: State) -> Columns:
        """Return M_i(q) qd (Eq. 9)."""
        c2, s2 = state.cos_sin(1)
        qd1, qd2 = state.qd[..., 0, :], state.qd[..., 1, :]
        qd12, a = qd1 + qd2, 2 * qd1 + qd2
        return {
            (0, "ZZR1"): qd1,
            (0, "ZZ2"): qd12,
            (1, "ZZ2"): qd12,
            (0, "LMX2"): a * c2,
            (1, "LMX2"): qd1 * c2,
            (0, "LMY2"): -a * s2,
            (1, "LMY2"): -qd1 * s2,
        }

    def remainder(self, state: State) -> Columns:
        """Return R_i(q, qd) = -dE_i/dq (Eq. 8, 9): only joint 2, on whose angle the inertia depends, has one."""
        c2, s2 = state.cos_sin(1)
        b = state.qd[..., 0, :] * (state.qd[..., 0, :] + state.qd[..., 1, :])
        return {(1, "LMX2"): b * s2, (1, "LMY2"): b * c2}

    def energy(self, state: State) -> Columns:
        """Return h_i(q, qd) (Eq. 10), with the corrected h_4."""
        c2, s2 = state.cos_sin(1)
        qd1 = state.qd[..., 0, :]
        qd12 = qd1 + state.qd[..., 1, :]
        b = qd1 * qd12
        return {
            (0, "ZZR1"): 0.5 * qd1 * qd1,
            (0, "ZZ2"): 0.5 * qd12 * qd12,
            (0, "LMX2"): b * c2,
            (0, "LMY2"): -b * s2,
        }


def scara() -> Basis:
    """Return the paper's SCARA: X = ZZR1 Fv1 Fs1 ZZ2 LMX2 LMY2 Fv2 Fs2."""
    order = ("ZZR1", "Fv1", "Fs1", "ZZ2", "LMX2", "LMY2", "Fv2", "Fs2")
    return Basis(2, (ScaraLinks(), ViscousFriction(), CoulombFriction()), order)
