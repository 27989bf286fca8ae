"""What a robot logged: the one thing that a simulator, or a real robot, hands to identification."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, Self, get_args

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import LogError, SettingError, TimeError, require_finite, require_not_negative, require_positive
from idbench.identify.tables import html_table

Meaning = Literal["instantaneous", "held", "averaged"]

UNIFORMITY = 0.01
"""Largest departure of a time step from the mean step, as a share of it, that still counts as uniform sampling."""

FARTHEST, STRONGEST = 1e9, 1e12
"""Positions [rad, m] and torques [N m, N] that no robot logs; squares and products of them would overflow in the end."""


@dataclass(frozen=True)
class TorqueChannel:
    """What the torque samples of a log mean.

    With T = 1/fs, sample k speaks for

    - ``instantaneous``: the torque at the instant t_k + delay;
    - ``held``: the torque that acts, constant, from t_k + delay to t_k + delay + T (a zero-order hold);
    - ``averaged``: the mean of the torque from t_k + delay to t_k + delay + T.

    Raises
    ------
    SettingError
        If the meaning is unknown, the delay is not finite, or the gain is zero or not finite.
    """

    meaning: Meaning
    """See above."""
    delay: float = 0.0
    """[s]. A computing delay makes it positive, a torque that was filtered on its way to the log negative."""
    gain: float | tuple[float, ...] = 1.0
    """Torque over logged value, of all joints or of each; 1 for a log in N m. G_T of the paper's Eq. 13 for a log of current
    references."""
    delay_sigma: float | tuple[float, ...] = field(default=0.0, repr=False)
    """Standard deviation of the error of the delay [s], which all joints share, or of that of each; all logs with the same
    channel have the same error."""
    period: float | None = field(default=None, repr=False)
    """Time [s] over which a torque is held, of a controller that is faster than the log, or averaged; by default the sampling
    period. (Of a slower controller the log has the staircase itself.)"""
    lags: tuple[float, ...] = field(default=(), repr=False)
    """What the torque of each joint is late beyond the delay [s]; by default nothing."""

    def __post_init__(self) -> None:
        if not isinstance(self.meaning, str) or self.meaning not in get_args(Meaning):
            raise SettingError(f"torque meaning {self.meaning!r} is unknown; known: {', '.join(get_args(Meaning))}")
        require_finite(delay=self.delay, **{f"lags[{j}]": lag for j, lag in enumerate(self.lags)})
        for sigma in np.atleast_1d(self.delay_sigma):
            require_not_negative(delay_sigma=float(sigma))
        for name in ("delay_sigma", "lags"):  # a list of a file
            if not isinstance(x := getattr(self, name), float | int):
                object.__setattr__(self, name, tuple(float(each) for each in x))
        if self.period is not None:
            require_positive(period=self.period)
        try:
            gains = np.atleast_1d(np.asarray(self.gain, dtype=np.float64))
        except (TypeError, ValueError) as error:
            raise SettingError(f"torque gain = {self.gain!r} must be a number, or one per joint") from error
        if gains.ndim != 1 or not np.isfinite(gains).all() or (gains == 0).any():
            raise SettingError(f"torque gain = {self.gain} must be finite and not 0")
        object.__setattr__(self, "gain", float(gains[0]) if gains.size == 1 else tuple(float(g) for g in gains))

    def ordered(self, places: Sequence[int]) -> "TorqueChannel":
        """Return the channel of joints in another order."""
        gain, sigma, lags = (
            tuple(x[k] for k in places) if isinstance(x, tuple) and x else x for x in (self.gain, self.delay_sigma, self.lags)
        )
        return replace(self, gain=gain, delay_sigma=sigma, lags=lags if isinstance(lags, tuple) else ())

    @property
    def late(self) -> str:
        """The delay, or that of each joint, in words."""
        return f"{', '.join(f'{1e3 * (self.delay + lag):.4g}' for lag in self.lags or (0.0,))} ms"


@dataclass(frozen=True, eq=False)
class MotionLog:
    """Uniformly sampled positions and torques of n joints; immutable, checked when it is made.

    Leading axes are independent runs, each identified by itself.

    Raises
    ------
    LogError
        If shapes differ, there are no samples or joints, or a value is NaN or infinite.
    SettingError
        If `fs` is not a finite number above zero.
    """

    fs: float
    """Sampling frequency [Hz]."""
    q: Array
    """Joint positions [rad], shape (..., time, joint)."""
    tau: Array
    """Joint torques [N m], or what `torque.gain` turns into them, shape (..., time, joint)."""
    torque: TorqueChannel
    """What a sample of `tau` means."""
    conditions: Mapping[str, Array] = field(default_factory=dict)
    """What else was logged that laws may need: ``temperature`` [deg C]; ``payload``, the share of the payload that is held;
    ``command`` of servos [rad], and ``on``, 1 where their torque is, shape (..., time, joint or 1)."""
    joints: tuple[str, ...] = ()
    """Names of the joints, where they are known."""
    missing: tuple[int, ...] = ()
    """Joints, from 0, whose torques were not logged: whatever `tau` has there, no row is made of it."""
    poses: bool = False
    """Whether each sample is by itself, with nothing between two: a pose at rest, or a state of `motion`."""
    motion: tuple[Array, Array] | None = None
    """Velocities [rad/s] and accelerations [rad/s^2] of samples that are by themselves, shape (..., time, joint) each."""

    def __repr__(self) -> str:
        runs = f"{np.prod(self.q.shape[:-2], dtype=int)} runs of " if self.q.ndim > 2 else ""
        names = f" ({', '.join(self.joints)})" if self.joints else ""
        what = f"{runs}{self.samples} samples of {self.n} joint{'s' if self.n > 1 else ''}{names}"
        late = f", delay {self.torque.late}" if self.torque.delay or self.torque.lags else ""
        return f"MotionLog: {what}, {self.samples / self.fs:.4g} s at {self.fs:.5g} Hz; torque {self.torque.meaning}{late}"

    def _repr_html_(self) -> str:
        names = self.joints or [f"joint {j + 1}" for j in range(self.n)]
        each = zip(names, np.moveaxis(self.q, -1, 0), np.moveaxis(self.tau, -1, 0), strict=True)
        rows = [[name, *(f"{x:.4g}" for x in (q.min(), q.max(), tau.min(), tau.max()))] for name, q, tau in each]
        return html_table(repr(self), ["", "from [rad, m]", "to", "torque from", "to"], rows)

    def __post_init__(self) -> None:
        require_positive(fs=self.fs)
        if not isinstance(self.torque, TorqueChannel):
            raise LogError(f"torque = {self.torque!r} must be a TorqueChannel, such as TorqueChannel('held', delay=0.002)")
        for name in ("q", "tau"):
            object.__setattr__(self, name, frozen(_real(name, getattr(self, name))))
        if self.q.shape != self.tau.shape:
            raise LogError(f"q has shape {self.q.shape} and tau {self.tau.shape}: every sample needs both, of every joint")
        if self.q.ndim < 2 or 0 in self.q.shape:
            raise LogError(f"q has shape {self.q.shape}, not (..., time, joint) with at least one of each")
        for name, values, largest in (("q", self.q, FARTHEST), ("tau", self.tau, STRONGEST)):
            _require_finite(name, values)
            if not np.abs(values).max() < largest:
                raise LogError(
                    f"{name} is {values.flat[np.abs(values).argmax()]:.3g} at some instant, more than {largest:.0e}, which is "
                    "impossible: are columns exchanged, or is this a mark for missing samples?"
                )
        self._require_motion()
        object.__setattr__(self, "conditions", {name: self._condition(name, x) for name, x in self.conditions.items()})
        if len(self.joints) not in (0, self.n):
            raise LogError(f"{len(self.joints)} names for {self.n} joints: {', '.join(self.joints)}")
        object.__setattr__(self, "missing", tuple(sorted({int(j) for j in self.missing})))
        if self.missing and not (self.missing[0] >= 0 and self.missing[-1] < self.n and len(self.missing) < self.n):
            raise LogError(f"missing = {self.missing} must be some of the joints 0 to {self.n - 1}, not all of them")
        if np.size(self.torque.gain) not in (1, self.n):
            raise LogError(f"{np.size(self.torque.gain)} torque gains for {self.n} joints: give one, or one per joint")
        for name in ("lags", "delay_sigma"):
            if isinstance(x := getattr(self.torque, name), tuple) and len(x) not in (0, self.n):
                raise LogError(f"{len(x)} {name} of torques for {self.n} joints")

    def _require_motion(self) -> None:
        for name, values in zip(("qd", "qdd"), self.motion or (), strict=False):
            _require_finite(name, values)
            if values.shape[-2:] != self.q.shape[-2:]:
                raise LogError(f"{name} has shape {values.shape}, q {self.q.shape}: one of each joint at every sample")

    def _condition(self, name: str, values: npt.ArrayLike) -> Array:
        found = frozen(_real(name, values))
        if found.ndim < 2 or found.shape[-2] not in (1, self.samples) or found.shape[-1] not in (1, self.n):
            raise LogError(f"{name} has shape {found.shape}, q {self.q.shape}: give one value per sample, or one per joint")
        _require_finite(name, found)
        return frozen(np.broadcast_to(found, (*found.shape[:-2], self.samples, found.shape[-1])))

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.q.shape[-1]

    @property
    def samples(self) -> int:
        """Number of samples, N."""
        return self.q.shape[-2]

    @property
    def t(self) -> Array:
        """Time of every sample [s], shape (time,), from 0."""
        return np.arange(self.samples) / self.fs

    @property
    def unchanging(self) -> tuple[int, ...]:
        """Joints, from 0, whose torque is the same in all samples: not driven, or not logged though there is a column."""
        return tuple(j for j in range(self.n) if j not in self.missing and not np.ptp(self.tau[..., j], axis=-1).any())

    def part(self, first: int, end: int) -> "MotionLog":
        """Return the samples `first` ... `end` - 1 as a log of its own."""
        q, tau, *others = (x[..., first:end, :] for x in (self.q, self.tau, *self.conditions.values()))
        motion = self.motion and (self.motion[0][..., first:end, :], self.motion[1][..., first:end, :])
        return replace(self, q=q, tau=tau, conditions=dict(zip(self.conditions, others, strict=True)), motion=motion)

    def run(self, i: tuple[int | slice | list[int], ...]) -> "MotionLog":
        """Return one of independent runs, or some of them, as a log of its own."""
        conditions = {name: x[i] if x.ndim > 2 else x for name, x in self.conditions.items()}
        motion = self.motion and (self.motion[0][i], self.motion[1][i]) if self.q.ndim > 2 else self.motion
        return replace(self, q=self.q[i], tau=self.tau[i], conditions=conditions, motion=motion)

    @classmethod
    def at_times(
        cls,
        t: npt.ArrayLike,
        q: npt.ArrayLike,
        tau: npt.ArrayLike,
        torque: TorqueChannel,
        conditions: Mapping[str, Array] | None = None,
        missing: Sequence[int] = (),
    ) -> Self:
        """Make a log from samples at the times `t`, which must be uniform.

        Parameters
        ----------
        t : array_like, shape (time,)
            Sample times [s], increasing, their steps within 1 % of the mean step.
        q, tau, torque, conditions, missing
            As for the class.

        Raises
        ------
        LogError
            If times are missing, decrease, or are not uniform; the worst step is named.

        Examples
        --------
        >>> import numpy as np
        >>> from idbench.identify import MotionLog, TorqueChannel
        >>> q = np.zeros((100, 2))
        >>> log = MotionLog.at_times(np.arange(100) / 250.0, q, q, TorqueChannel("instantaneous"))
        >>> round(log.fs), log.n, log.samples
        (250, 2, 100)
        """
        times, positions = _real("t", t), _real("q", q)
        if positions.ndim < 2:
            raise LogError(f"q has shape {positions.shape}, not (..., time, joint)")
        if times.shape != positions.shape[-2:-1]:
            raise LogError(f"t has shape {times.shape}, q {positions.shape}: one time is needed for each sample of q")
        return cls(sampling_frequency(times), positions, _real("tau", tau), torque, conditions or {}, (), tuple(missing))


def never_logged(logs: Sequence[MotionLog]) -> tuple[int, ...]:
    """Return the joints whose torque no log of several has."""
    return tuple(sorted(set.intersection(*(set(log.missing) for log in logs))))


def sampling_frequency(t: Array) -> float:
    """Return fs [Hz] of the uniform times `t` [s], shape (time,); raise LogError if they are not uniform."""
    _require_finite("t", t[:, None])
    if len(t) < 2:
        raise LogError(f"{len(t)} samples do not give a sampling frequency; at least 2 are needed")
    step = np.diff(t)
    if step.min() <= 0:
        k = int(np.argmin(step))
        raise LogError(f"time does not increase: t = {t[k]:.9g} s is followed by {t[k + 1]:.9g} s at sample {k + 1}")
    mean = (t[-1] - t[0]) / (len(t) - 1)
    k = int(np.argmax(np.abs(step - mean)))
    if abs(step[k] - mean) > UNIFORMITY * mean:
        raise TimeError(
            f"time is not uniform: a step of {step[k]:.6g} s after t = {t[k]:.6g} s, where the mean step is {mean:.6g} s; "
            "resample the log at a fixed frequency first"
        )
    late = t - t[0] - mean * np.arange(len(t))
    if np.abs(late).max() > mean / 2:
        k = int(np.argmax(np.abs(late)))
        raise TimeError(
            f"time drifts: t = {t[k]:.6g} s is {abs(late[k]):.3g} s from where uniform sampling at {1 / mean:.6g} Hz puts "
            "it; resample the log at a fixed frequency first"
        )
    return float(1 / mean)


def _real(name: str, values: npt.ArrayLike) -> Array:
    """Return `values` as an array of floats; raise LogError if they are not real numbers, or some are masked."""
    if isinstance(values, np.ma.MaskedArray) and np.any(values.mask):
        raise LogError(f"{name} is masked at {np.sum(values.mask)} places: cut these samples out, or fill them, first")
    try:
        given = np.asarray(values)
    except ValueError as error:
        raise LogError(f"{name} is not an array: its rows differ in length") from error
    if given.dtype.kind not in "iuf":
        raise LogError(f"{name} must be real numbers in SI units, not {given.dtype}")
    return given.astype(np.float64, copy=False)


def _require_finite(name: str, values: Array) -> None:
    """Raise LogError that names the first value of `values` (..., time, joint) which is NaN or infinite."""
    if np.isfinite(values).all():
        return
    *run, k, j = (int(i) for i in np.argwhere(~np.isfinite(values))[0])
    where = f"sample {k}" + (f" of joint {j + 1}" if values.shape[-1] > 1 else "") + (f" of run {tuple(run)}" if run else "")
    raise LogError(f"{name} is {values[(*run, k, j)]} at {where}; remove or repair such samples first (idbench: --resample)")
