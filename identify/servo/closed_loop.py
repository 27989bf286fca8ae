"""Servos in closed loop, simulated from commands alone: many runs and many sets of parameters at once."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, final

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.errors import SettingError, require_positive
from idbench.identify.servo.run import ServoRun

if TYPE_CHECKING:
    from idbench.identify.servo.servo_step import ServoLaw

PUBLISHED: dict[str, tuple[float, float, int]] = {
    "STS3215": (0.166, 0.97, 4096),
    "MX-64": (0.158, 0.9625, 4096),
    "MX-106": (0.158, 0.9625, 4096),
    "XL-320": (0.0505, 1.0, 1024),
    "XL330": (4096 / (2 * np.pi * 256 * 885), 1.0, 4096),
}
"""Duty per unit of kp and rad, largest duty and counts a turn, as published with BAM (arXiv 2410.08650, measured with an
oscilloscope) and for the STS3215 at GitHub kscalelabs/sysid."""


@final
@dataclass(frozen=True)
class Servo:
    """What is known of a servo: its firmware, its supply, its encoder.

    Raises
    ------
    SettingError
        If a value is out of its range.
    """

    gain: float
    """Duty per unit of the firmware's kp and rad of position error."""
    kp: float = 1.0
    """Firmware gain of the logs, unless they state another."""
    supply: float = 1.0
    """V [V]. At 1, a is the torque at full duty."""
    duty_limit: float = 1.0
    """Largest duty."""
    counts: int = 4096
    """Counts of the encoder a turn."""

    def __post_init__(self) -> None:
        require_positive(gain=self.gain, kp=self.kp, supply=self.supply, duty_limit=self.duty_limit, counts=self.counts)
        if self.duty_limit > 1:
            raise SettingError(f"duty_limit = {self.duty_limit:g} must be at most 1, the whole supply")

    @property
    def step(self) -> float:
        """Angle of one count [rad]."""
        return 2 * np.pi / self.counts


IN_COUNTS = 0.1
"""How far from a whole count a position may be written, as a share of it, and still be one."""

WAY = 6
"""Ranges of its motion that a joint may cross in a step: beyond, it is lost, and numbers would overflow."""


@final
class ServoLoop:
    """Runs of one kind of servo, to be simulated with any parameters (see `idbench.identify.servo.servo_step`).

    Parameters
    ----------
    servo : Servo
        What is known.
    runs : sequence of ServoRun
        What was logged.
    step : float
        Longest step [s].
    count : float
        Angle to whose multiples positions at rest are rounded [rad], as the servo reports them; 0: none are (see `count_of`).
    """

    def __init__(self, servo: Servo, runs: Sequence[ServoRun], step: float, count: float = 0.0) -> None:
        self.servo = servo
        self.runs = tuple(runs)
        self.count = count
        typical = float(np.median([run.T for run in self.runs]))
        self.h = typical / np.ceil(typical / step - 1e-9)
        self.samples = max(len(run.t) for run in self.runs)
        self.q = np.stack([_padded(run.clean, self.samples) for run in self.runs])
        self.kept = np.stack([_padded(run.read_well, self.samples, False) for run in self.runs])
        self._begin = [(float(np.median(run.clean[:3])), _speed(run)) for run in self.runs]
        commands = np.concatenate([run.command for run in self.runs])
        self._fastest = WAY * (float(np.ptp(self.q[self.kept])) + float(np.ptp(commands)) + 1e-6) / self.h
        self._tracks = [self._track(run) for run in self.runs]
        self._places = [self._place(run) for run in self.runs]

    def simulate(self, p: Mapping[str, npt.ArrayLike], ahead: npt.ArrayLike = 0.0) -> Array:
        """Return positions at the samples of the log [rad], shape (lane, run, sample), for a value of each parameter a lane.

        `ahead`, shape (lane, run) or less, is where runs begin, beyond the position that was measured [rad].
        """
        from idbench.identify.servo.servo_step import ServoLaw  # its compiler takes longer than many a command

        lanes = max(np.size(x) for x in p.values())
        every = {name: np.broadcast_to(np.asarray(x, dtype=np.float64), (lanes,)).tolist() for name, x in p.items()}
        laws = [ServoLaw(**{name: x[lane] for name, x in every.items()}) for lane in range(lanes)]
        begins = np.broadcast_to(np.asarray(ahead, dtype=np.float64), (lanes, len(self.runs)))
        out = np.empty((lanes, *self.q.shape))
        with ThreadPoolExecutor(os.cpu_count()) as pool:  # compiled code runs beside Python
            list(pool.map(lambda k: self._simulate_run(k, laws, begins[:, k].tolist(), out[:, k]), range(len(self.runs))))
        return out

    def _simulate_run(self, k: int, laws: "Sequence[ServoLaw]", ahead: Sequence[float], out: Array) -> None:
        """Write the positions of a run into `out`, shape (lane, sample)."""
        from idbench.identify.servo.servo_step import Firmware, at_samples, motion

        servo = self.servo
        (before, share) = self._places[k]
        (q, speed) = self._begin[k]
        firmware = Firmware(servo.gain * self.runs[k].kp, servo.duty_limit, servo.step)
        for lane, (law, more) in enumerate(zip(laws, ahead, strict=True)):
            path = motion(law, firmware, self._tracks[k], (q + more, speed), self.h, self._fastest)
            out[lane, : len(before)] = at_samples(path, before, share, self.count)
        out[:, len(before) :] = out[:, len(before) - 1 : len(before)]

    def _place(self, run: ServoRun) -> tuple[npt.NDArray[np.int64], Array]:
        """Return the step before each sample, and by how much of a step the sample is later."""
        x = (run.t - run.t[0]) / self.h
        before = x.astype(np.int64)
        return before, x - before

    def _track(self, run: ServoRun) -> tuple[Array, ...]:
        from idbench.identify.servo.servo_step import Track

        t = np.arange(int(np.ceil((run.t[-1] - run.t[0]) / self.h)) + 2) * self.h
        place = np.maximum(np.searchsorted(run.t - run.t[0], t + 1e-9, side="right") - 1, 0)
        on = run.enabled[place].astype(np.float64)
        voltage = np.full(len(t), self.servo.supply) if run.voltage is None else run.voltage[place]
        load = (np.interp(t, run.t - run.t[0], np.broadcast_to(x, run.t.shape)) for x in vars(run.load).values())
        return Track(run.command[place], _centred(voltage * on), _centred(on), *load)


def count_of(servo: Servo, runs: Sequence[ServoRun]) -> float:
    """Return the angle of a count [rad] if nearly all positions are whole counts, else 0, as where they were filtered.

    A joint stops where the firmware sees the next count. There, errors of rounding are not noise: all have one direction.
    """
    x = np.concatenate([run.q for run in runs]) / servo.step
    return servo.step if np.mean(np.abs(x - np.rint(x)) < IN_COUNTS) > 1 - IN_COUNTS else 0.0


def _padded(x: npt.NDArray[Any], length: int, value: Any = None) -> npt.NDArray[Any]:
    """Return values with the last one, or another value, after their end."""
    return np.concatenate([x, np.full(length - len(x), x[-1] if value is None else value, x.dtype)])


def _centred(x: Array) -> Array:
    """Return the means of held values over the steps about their instants, in which forces act."""
    return np.concatenate([x[:1], (x[1:] + x[:-1]) / 2])


def _speed(run: ServoRun) -> float:
    """Return the speed at the beginning, from the first samples; 0 if they differ by no more than two counts do."""
    slope = np.polyfit(run.t[:7] - run.t[0], run.clean[:7], 1)[0]
    return float(slope) if len(np.unique(run.clean[:7])) > 3 else 0.0
