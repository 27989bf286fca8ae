"""How far the links of a robot stay from each other, and from what stands around them."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import mujoco
import numpy as np
import numpy.typing as npt

from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scene import body_name

ALWAYS = 100  # Random postures: pairs that are too near in all of them are made so, and are left out
SEED = 0  # Of the random postures: the same for everybody
ROOM = 0.02  # Distance [m] beyond the least from which on nearness costs, where a pair can get so far apart
COARSE = 50.0  # Frequency [Hz] at which distances are taken first; between two of its instants, speeds say what can happen


@dataclass(frozen=True)
class Touch:
    """The nearest that two shapes come."""

    distance: float
    """Negative where they overlap [m]."""
    shapes: tuple[str, str]
    """Their names."""
    instant: int
    """Sample."""

    def __str__(self) -> str:
        how = f"are {1000 * self.distance:.0f} mm apart" if self.distance > 0 else "touch"
        return f"{self.shapes[0]} and {self.shapes[1]} {how}"


class Clearance:
    """Distances between the shapes of a robot that could meet, by MuJoCo.

    Of each link the shapes count that are marked for collisions, or all where none is, and of the world whatever is fixed to
    it. Neighbouring links are left out, and pairs that are nearer than `least` [m] at all of many random positions within the
    ranges [rad], shape (joint, 2).
    """

    def __init__(self, robot: Robot, ranges: Array, least: float) -> None:
        self._robot = robot
        self._model = robot.model
        self._data = mujoco.MjData(robot.model)
        self._fromto, self.least = np.zeros(6), least
        asked, of = combinations(self.shapes, 2), robot.model.geom_bodyid.tolist()
        self.pairs = np.array([pair for pair in asked if not self._neighbours(*(of[g] for g in pair))], np.intp).reshape(-1, 2)
        random = np.random.default_rng(SEED).uniform(ranges[:, 0], ranges[:, 1], (ALWAYS, robot.n))
        most = self.distances(random, least + ROOM).max(axis=0, initial=-np.inf)
        always = most < least
        self.left_out = [self.names(pair) for pair in self.pairs[always]]
        self.farthest = most[always]
        self.pairs = self.pairs[~always]
        self._margin = least + np.minimum(ROOM, (most[~always] - least) / 2)

    @cached_property
    def shapes(self) -> npt.NDArray[np.intp]:
        """Numbers of the shapes that count: of each link those marked for collisions, all where none is."""
        m = self._model
        marked = (m.geom_contype != 0) | (m.geom_conaffinity != 0)
        links = m.body_weldid[m.geom_bodyid]
        of_marked = np.isin(links, links[marked]) & (links != 0)
        return np.flatnonzero((marked | ~of_marked) & (m.geom_type != int(mujoco.mjtGeom.mjGEOM_HFIELD)))

    @cached_property
    def bare(self) -> tuple[str, ...]:
        """Names of links that have no shape, and of height fields, whose distances MuJoCo does not tell."""
        m = self._model
        links = set(m.body_weldid[1:].tolist()) - {0} - set(m.body_weldid[m.geom_bodyid[self.shapes]].tolist())
        fields = np.flatnonzero(m.geom_type == int(mujoco.mjtGeom.mjGEOM_HFIELD))
        return (*(body_name(m, link) for link in sorted(links)), *(m.geom(int(g)).name or "a height field" for g in fields))

    @property
    def checks(self) -> bool:
        """Whether there is anything that could meet."""
        return len(self.pairs) > 0

    @cached_property
    def _moves(self) -> npt.NDArray[np.bool_]:
        """Whether each joint moves each body, shape (joint, body)."""
        m, moved = self._model, np.zeros((self._model.njnt, self._model.nbody), dtype=bool)
        for body in range(1, m.nbody):
            moved[:, body] = moved[:, m.body_parentid[body]]
            first = m.body_jntadr[body]
            moved[first : first + m.body_jntnum[body], body] = m.body_jntnum[body] > 0
        return moved

    def _neighbours(self, one: int, two: int) -> bool:
        """True if two bodies belong to one link, or to two with a joint between them; what stands around is nobody's."""
        m = self._model
        if m.body_weldid[one] == m.body_weldid[two]:
            return True
        for a, b in ((one, two), (two, one)):
            link = int(m.body_weldid[b])
            if link and m.body_weldid[m.body_parentid[link]] == m.body_weldid[a]:
                return bool(m.body_weldid[a] or a in self._stand(link))
        return False

    def _stand(self, link: int) -> set[int]:
        """Return the bodies that carry the first link of a chain, but for the world itself."""
        found, body = set[int](), int(self._model.body_parentid[link])
        while body:
            found.add(body)
            body = int(self._model.body_parentid[body])
        return found

    def names(self, pair: npt.NDArray[np.intp]) -> tuple[str, str]:
        """Names of the shapes of a pair."""
        m = self._model
        one, two = (m.geom(int(g)).name or f"a shape of {body_name(m, int(m.geom_bodyid[g]))}" for g in pair)
        return one, two

    def _centres(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Return centres and orientations of all shapes, axes and anchors of joints, shape (time, ..., 3 or 9)."""
        m, d = self._model, self._data
        pos, mat = np.empty((len(q), m.ngeom, 3)), np.empty((len(q), m.ngeom, 9))
        axis, anchor = np.empty((len(q), m.njnt, 3)), np.empty((len(q), m.njnt, 3))
        for k, posture in enumerate(q):
            d.qpos[:] = posture
            mujoco.mj_kinematics(m, d)
            pos[k], mat[k], axis[k], anchor[k] = d.geom_xpos, d.geom_xmat, d.xaxis, d.xanchor
        return pos, mat, axis, anchor

    def _gaps(self, pos: Array, mat: Array) -> Array:
        """Return least distances of pairs, from spheres around their shapes, shape (time, pair)."""
        r, (one, two) = self._model.geom_rbound, self.pairs.T
        apart = np.linalg.norm(pos[:, one] - pos[:, two], axis=-1) - r[one] - r[two]
        for i in np.flatnonzero((r[one] == 0) | (r[two] == 0)):  # planes
            plane, other = (one[i], two[i]) if r[one[i]] == 0 else (two[i], one[i])
            up = mat[:, plane].reshape(-1, 3, 3)[:, :, 2]
            apart[:, i] = np.sum((pos[:, other] - pos[:, plane]) * up, axis=-1) - r[other]
        return apart

    def _place(self, pos: Array, mat: Array) -> None:
        self._data.geom_xpos[:], self._data.geom_xmat[:] = pos, mat

    def _distance(self, pair: npt.NDArray[np.intp], most: float) -> float:
        return float(mujoco.mj_geomDistance(self._model, self._data, int(pair[0]), int(pair[1]), most, self._fromto))

    def distances(self, q: Array, most: float) -> Array:
        """Return distances of pairs [m], shape (time, pair), at positions q, shape (time, joint); `most` or more beyond it."""
        pos, mat, _, _ = self._centres(q)
        found = self._gaps(pos, mat)
        for k in np.flatnonzero((found < most).any(axis=1)):
            self._place(pos[k], mat[k])
            for i in np.flatnonzero(found[k] < most):
                found[k, i] = self._distance(self.pairs[i], max(most, 0.0) + 1.0)
        return found

    def cost(self, q: Array) -> tuple[float, Array]:
        """Cost of nearness at positions q, shape (time, joint), and its gradient.

        The sum of (1 - distance / margin)^2 over instants and pairs that are nearer than a margin beyond the least distance.
        """
        pos, mat, axis, anchor = self._centres(q)
        total, slope = 0.0, np.zeros_like(q)
        near = self._gaps(pos, mat) < self._margin
        hinge = ~self._robot.slides
        for k in np.flatnonzero(near.any(axis=1)):
            self._place(pos[k], mat[k])
            for i in np.flatnonzero(near[k]):
                margin = self._margin[i]
                distance = self._distance(self.pairs[i], margin)
                if distance >= margin or abs(distance) < 1e-9:
                    continue
                ends = self._fromto.reshape(2, 3)
                n = (ends[1] - ends[0]) / distance
                one, two = self._moves[:, self._model.geom_bodyid[self.pairs[i]]].T
                pushed = [np.where(hinge[:, None], np.cross(axis[k], end - anchor[k]), axis[k]) for end in ends]
                use = 1 - distance / margin
                total += use**2
                slope[k] -= 2 * use / margin * ((pushed[1] @ n) * two - (pushed[0] @ n) * one)
        return total, slope

    def nearest(self, q: Array, qd: Array, fs: float) -> Touch | None:
        """Return the pair that comes nearest along a motion, if any comes nearer than it may.

        Instants at which speeds, shape (time, joint), let no pair come so near are passed over.
        """
        if not self.checks:
            return None
        step = max(1, round(fs / COARSE))
        some = np.arange(0, len(q), step)
        reach = self._reach(q[some], np.stack([np.abs(qd[max(0, k - step) : k + step + 1]).max(axis=0) for k in some]))
        close = self.distances(q[some], self.least + float(reach.max()) * step / fs) < self.least + reach * step / fs
        fine = np.unique(np.clip((some[close.any(axis=1)][:, None] + np.arange(-step, step + 1)).ravel(), 0, len(q) - 1))
        found = self.distances(q[fine], self.least)
        if not found.size or found.min() >= self.least:
            return None
        k, i = np.unravel_index(int(found.argmin()), found.shape)
        return Touch(float(found[k, i]), self.names(self.pairs[i]), int(fine[k]))

    def _reach(self, q: Array, speed: Array) -> Array:
        """Largest speed of approach of pairs at positions and speeds, shape (instant, joint), as (instant, pair) [m/s]."""
        pos, _, _, anchor = self._centres(q)
        r, bodies = self._model.geom_rbound, self._model.geom_bodyid
        total = np.zeros((len(q), len(self.pairs)))
        for own, other in ((0, 1), (1, 0)):
            geom, rest = self.pairs[:, own], self.pairs[:, other]
            moved = self._moves[:, bodies[geom]] & ~self._moves[:, bodies[rest]]
            arm = np.linalg.norm(pos[:, None, geom] - anchor[:, :, None], axis=-1) + r[geom]
            lever = np.where(self._robot.slides[:, None], 1.0, arm)
            total += np.einsum("tj,tji,ji->ti", speed, lever, moved.astype(np.float64))
        return total
