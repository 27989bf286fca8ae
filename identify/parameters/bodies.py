"""Bodies that exist: positive pseudo-inertias of links, positive armatures and frictions, and a distance between them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import NOT_NEGATIVE, Parameter
from idbench.identify.data.kinematics import INERTIAL
from idbench.identify.errors import IdentificationError
from idbench.identify.iterate import iterate


def _pseudo_inertia(values: Sequence[float]) -> Array:
    xx, xy, xz, yy, yz, zz, *first, mass = values
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    S = np.empty((4, 4))
    S[:3, :3] = np.trace(inertia) / 2 * np.eye(3) - inertia
    S[:3, 3] = S[3, :3] = first
    S[3, 3] = mass
    return S


PSEUDO = np.array([_pseudo_inertia(e) for e in np.eye(len(INERTIAL)).tolist()])
"""What each inertial parameter adds to a pseudo-inertia, shape (10, 4, 4)."""


def pseudo_inertia(values: Array) -> Array:
    """Return the pseudo-inertias of links' XX XY XZ YY YZ ZZ MX MY MZ M of shape (..., 10), shape (..., 4, 4)."""
    return np.tensordot(values, PSEUDO, 1)


def inertial(S: Array) -> Array:
    """Return XX XY XZ YY YZ ZZ MX MY MZ M of a pseudo-inertia, shape (10,)."""
    second = S[:3, :3]
    inertia = np.trace(second) * np.eye(3) - second
    return np.array([*inertia[np.triu_indices(3)], *S[:3, 3], S[3, 3]])


def exist(parameters: Sequence[Parameter], values: Array) -> bool:
    """True if all links of a robot are physically consistent, and no armature or friction is below zero."""
    links: dict[tuple[int | None, str], dict[str, float]] = {}
    for parameter, value in zip(parameters, values.tolist(), strict=True):
        if parameter.symbol in INERTIAL:
            links.setdefault((parameter.joint, parameter.drive), {})[parameter.symbol] = value
        elif parameter.kind in NOT_NEGATIVE and value < 0:
            return False
    own = np.array([[link.get(x, 0.0) for x in INERTIAL] for link in links.values() if len(link) == len(INERTIAL)])
    S = pseudo_inertia(own)
    least = LEAST * np.trace(S, axis1=-2, axis2=-1)
    return not len(own) or bool((np.linalg.eigvalsh(S) > least[:, None]).all())


FLAT = 1e-6  # Share of the largest eigenvalue below which the least says that a body is flat

SMALL = 0.01
"""Share of the robot's mean mass below which a given body says nothing of the real one, and one of that share of the mean body
takes its place: a file may have a flange of a milligram where a tool of a kilogram is."""

UNKNOWN = 1e-6  # Weight of what the given model lacks: a rotor without evidence has its root, .001, of the link's inertia

LEAST = 1e-8  # Share of the trace of a link's pseudo-inertia that its least eigenvalue is raised to


class Divergence(NamedTuple):
    """A distance and its derivatives."""

    value: float
    """Sum over bodies."""
    gradient: Array
    """Shape (p,)."""
    root: Array
    """L^-T with L L' the Hessian, shape (p, p)."""


class Bodies:
    """Standard parameters, and how far others are from them.

    For the pseudo-inertias P of links, and P0 of the given ones, the log-determinant divergence

        d = tr(P0^-1 P) - ln det(P0^-1 P) - 4

    (T. Lee, P. M. Wensing and F. C. Park, "Geometric robot dynamic identification: a convex programming approach", IEEE T-RO 36
    (2020) 348-365): it depends on no frame, is half the square of relative changes where they are small, and infinite where no
    body is. Armatures and frictions, which are not negative, count as matrices of one row. For others, and the parameters of a
    link of which one is held, it is 1/2 ((x - x0) / size)^2. Given values and sizes are of the standard parameters, shape (p,).
    Those that are `absent` from the given model are free but for `UNKNOWN`: they take what bodies near the given ones cannot.
    """

    def __init__(self, parameters: Sequence[Parameter], given: Array, size: Array, absent: Array | None = None) -> None:
        place = {(p.symbol, p.joint): i for i, p in enumerate(parameters)}
        whole = [p.joint for p in parameters if p.kind == "mass" and all((x, p.joint) in place for x in INERTIAL)]
        links = sorted(joint for joint in whole if joint is not None)
        self.links = [[place[x, joint] for x in INERTIAL] for joint in links]
        in_links = {i for link in self.links for i in link}
        alone = [i for i in range(len(parameters)) if i not in in_links]
        self._signed = np.array([i for i in alone if parameters[i].kind in NOT_NEGATIVE], dtype=np.intp)
        self._free = np.array([i for i in alone if parameters[i].kind not in NOT_NEGATIVE], dtype=np.intp)
        thick = [_thick(pseudo_inertia(given[link]), j + 1) for j, link in zip(links, self.links, strict=True)]
        mean = _mean(thick)
        inertias = [_at_least(S, SMALL * mean) if S[3, 3] < SMALL * mean[3, 3] else S for S in thick]
        self._inverses = np.linalg.inv(np.reshape(inertias, (-1, 4, 4)))
        self._places = np.reshape(np.array(self.links, dtype=np.intp), (-1, len(INERTIAL)))
        weight = np.ones(len(given)) if absent is None else np.where(absent, UNKNOWN, 1.0)
        self.given, self._size, self._weight = given.copy(), size / np.sqrt(weight), weight[self._signed]
        for link, S in zip(self.links, inertias, strict=True):
            self.given[link] = inertial(S)
        self.given[self._signed] = np.maximum(given[self._signed], size[self._signed])

    def with_extent(self, x: Array) -> Array:
        """Return parameters of links with some extent in every direction, as simulators ask: `LEAST` of the trace."""
        thick = x.copy()
        for link in self.links:
            values, axes = np.linalg.eigh(S := pseudo_inertia(x[link]))
            if values[0] < (least := LEAST * np.trace(S)):
                thick[link] = inertial((axes * np.maximum(values, least)) @ axes.T)
        return thick

    def room(self, x: Array, step: Array) -> float:
        """Largest multiple of a step from x that stays physically consistent."""
        inner = np.linalg.inv(np.linalg.cholesky(pseudo_inertia(x[self._places])))
        changes = inner @ pseudo_inertia(step[self._places]) @ np.swapaxes(inner, 1, 2)
        shares = np.append(np.linalg.eigvalsh(changes), step[self._signed] / x[self._signed])
        return -1 / least if (least := float(np.min(shares, initial=0.0))) < 0 else np.inf

    def divergence(self, x: Array) -> Divergence | None:
        """Return the distance of x from the given parameters; None where no bodies have them."""
        gradient, root = np.zeros(len(x)), np.zeros((len(x), len(x)))
        P = pseudo_inertia(x[self._places])
        try:
            inner = np.linalg.inv(np.linalg.cholesky(P))
        except np.linalg.LinAlgError:
            return None
        ratios = self._inverses @ P
        value = float(np.sum(np.trace(ratios, axis1=1, axis2=2) - np.linalg.slogdet(ratios)[1] - P.shape[-1]))
        units = inner[:, None] @ PSEUDO @ np.swapaxes(inner, 1, 2)[:, None]
        own = np.tensordot(self._inverses, PSEUDO, ((1, 2), (1, 2))) - np.trace(units, axis1=2, axis2=3)
        roots = np.linalg.inv(np.linalg.qr(np.swapaxes(units.reshape(len(P), len(INERTIAL), 16), 1, 2), mode="r"))
        gradient[self._places] = own
        root[self._places[:, :, None], self._places[:, None, :]] = roots
        ratio, free = x[self._signed] / self.given[self._signed], (x - self.given)[self._free] / self._size[self._free]
        if (ratio <= 0).any():
            return None
        there, weight = self._weight > UNKNOWN, self._weight
        value += float(np.sum(weight * (there * (ratio - 1) - np.log(ratio))) + np.sum(free**2) / 2)
        gradient[self._signed] = weight * (there - 1 / ratio) / self.given[self._signed]
        root[self._signed, self._signed] = x[self._signed] / np.sqrt(weight)
        gradient[self._free] = free / self._size[self._free]
        root[self._free, self._free] = self._size[self._free]
        return Divergence(value, gradient, root)


FASTER = 10.0  # What the weight is divided by from stage to stage: each begins near its end
STEPS = 100  # Newton steps of a stage at most; some five are usual

CENTRED, CLOSE = 0.1, 1e-8
"""Newton decrement, over the weight, at which a stage and the last one are done: d is self-concordant."""

SHARE = 0.9
"""Share of the way to the border of what bodies can have that a step goes at most: far too thin ones are slow to grow again."""

LEAST_STEP = 1e-10  # Share of a step below which nothing is gained but rounding
ROUNDING = 1e-13  # Share of the objective by which it may rise: rounding


def nearest(A: Array, b: Array, bodies: Bodies, weight: float) -> Array:
    """Return x = argmin 1/2 |A x - b|^2 + weight d(x), shape (p,), by damped Newton steps that stay inside.

    With H = L L' the Hessian of d, g its gradient, and A L^-T = U S V', the step is

        L^-T V (S U'(b - A x) - weight V' L^-1 g) / (S^2 + weight)

    so that however well A knows some directions, and badly others, none is lost by rounding. The weight comes down in stages to
    its value, 1/s^2 where relative changes of s are expected. Rows A, shape (r, p), and what they measure, b, shape (r,), are
    in units of its standard deviation.
    """
    begin, x = bodies.divergence(bodies.given), bodies.given
    assert begin is not None
    stage = max(weight, float(np.linalg.norm(A @ begin.root, 2)) ** 2)
    while True:
        x = _centred(A, b, bodies, stage, x, CLOSE if stage <= weight else CENTRED)
        if stage <= weight:
            return x
        stage = max(weight, stage / FASTER)


def _centred(A: Array, b: Array, bodies: Bodies, weight: float, x: Array, close: float) -> Array:
    """Return x(k+1) = x(k) + t step, until a step makes the objective less by less than `close` times the weight."""

    def at(x: Array) -> tuple[float, Divergence] | None:
        found = bodies.divergence(x)
        return None if found is None else (float(np.sum((A @ x - b) ** 2)) / 2 + weight * found.value, found)

    def newton(here: tuple[Array, tuple[float, Divergence]]) -> tuple[tuple[Array, tuple[float, Divergence]], bool]:
        x, (value, d) = here
        U, S, V = np.linalg.svd(A @ d.root)
        S = np.pad(S, (0, len(V) - len(S)))
        slope = S * np.pad(U.T @ (b - A @ x), (0, max(0, len(V) - len(U))))[: len(V)] - weight * (V @ (d.root.T @ d.gradient))
        step = d.root @ (V.T @ (slope / (S**2 + weight)))
        decrement = float(np.sum(slope**2 / (S**2 + weight)))
        if decrement <= close * weight:
            return here, True
        t = min(1.0, SHARE * bodies.room(x, step))
        while (new := at(x + t * step)) is None or new[0] > value - 1e-4 * t * decrement + ROUNDING * value:
            t /= 2
            if t < LEAST_STEP:
                return here, True
        return (x + t * step, new), False

    begin = at(x)
    assert begin is not None
    return iterate(newton, (x, begin), STEPS)[0][0]


def _thick(S: Array, number: int) -> Array:
    """Return the pseudo-inertia of a link, that of a plate or a rod with some thickness; raise if there is no such body."""
    lowest, largest = np.linalg.eigvalsh(S)[[0, -1]]
    if lowest < -FLAT * largest or largest <= 0:
        raise IdentificationError(
            f"link {number} of the given model is not physically consistent: its pseudo-inertia is not positive (is the centre "
            "of mass outside of the body that the inertia describes?); correct the file first"
        )
    return S + FLAT * largest * np.eye(4) if lowest < FLAT * largest else S


def _mean(inertias: Sequence[Array]) -> Array:
    """Return the pseudo-inertia of a ball of the bodies' mean mass whose second moments are theirs on average."""
    if not inertias:
        return np.eye(4)
    mass = float(np.mean([S[3, 3] for S in inertias]))
    moment = float(np.mean([np.trace(S[:3, :3]) for S in inertias])) / 3
    return np.diag([moment, moment, moment, mass])


def _at_least(S: Array, least: Array) -> Array:
    """Return a pseudo-inertia that is nowhere less than another: what is, in the axes that both share, is raised to it."""
    root = np.sqrt(np.diagonal(least))
    values, axes = np.linalg.eigh(S / np.outer(root, root))
    return S if values[0] >= 1 else (axes * np.maximum(values, 1.0)) @ axes.T * np.outer(root, root)
