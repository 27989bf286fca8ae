"""Identification while the rows come in: estimates and residuals that grow, for who watches; nothing of it is kept."""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from idbench.experiments.errors import reason, report
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.recording.identification_layer import row_names, send_rows
from idbench.experiments.recording.stream import Stream, part, seconds
from idbench.experiments.text import FORM_WIDTHS, FORMS, GREY
from idbench.identify import Array, Estimate, IdentificationError, MotionLog, TorqueChannel
from idbench.identify.rows.rows import is_long

if TYPE_CHECKING:
    from idbench.experiments.identification.fit import Fit

GROWTH = 1.1
"""How much longer the log must be before it is identified again: so often that the work stays in proportion to the log."""

ESTIMATOR = "WLS"  # Quick, as it is asked again and again

LABEL = "so-far"


class LiveIdentification:
    """What can be said of a log that grows, sampled at `fs` [Hz], shown in a stream; `joints` are parts of paths."""

    def __init__(
        self, stream: Stream, robot_model: RobotModel, chain: str, channel: TorqueChannel, fs: float, joints: Sequence[str]
    ) -> None:
        self._stream = stream
        self._channel = channel
        self._fs = fs
        self._request = Request(robot_model, method=Method.named(chain, ESTIMATOR), name=LABEL)
        self._joints = joints
        self._q = list[Array]()
        self._tau = list[Array]()
        self._identified = 0
        self._shown = dict[str, float]()
        self._broken = False
        self.fit: Fit | None = None

    def grow(self, q: Array, tau: Array) -> bool:
        """Take in positions [rad] and torques [N m], shape (time, joint); return whether the estimates were made anew."""
        self._q.append(q)
        self._tau.append(tau)
        samples = sum(map(len, self._q))
        if self._broken or samples < GROWTH * self._identified:
            return False
        self._identified = samples
        try:
            log = MotionLog(self._fs, np.concatenate(self._q), np.concatenate(self._tau), self._channel)
            self.fit = fit(self._request, Logs((log,)))
            with self._stream.draft():
                for form, estimate in self.fit.estimates.items():
                    self._show(form, estimate, float(log.t[-1]))
        except IdentificationError:  # too short yet, or not yet excited
            return False
        except Exception as error:  # the run is not lost because what is shown of it is
            self._broken = True
            sys.stderr.write(
                f"idbench: nothing more is identified while the robot moves ({reason(error)}; its traceback is in "
                f"{report(error)}); the work goes on\n"
            )
            return False
        return True

    def _show(self, form: str, estimate: Estimate, now: float) -> None:
        at, color = f"identify/{LABEL}/{form}", FORMS.get(form, GREY)
        for name, x, sigma in zip(estimate.names, estimate.X, estimate.standard_errors, strict=True):
            if form not in self._shown:
                self._stream.keep(f"{at}/estimate/{part(name)}", rr.Measurements.from_fields(names=[form], colors=[color]))
            columns = rr.Measurements.columns(values=[x], variances=[sigma**2])
            self._stream.send(f"{at}/estimate/{part(name)}", [seconds(np.array([now]))], columns)
        if is_long(estimate.problem.logs):  # of which no rows are kept
            return
        names = row_names(form, estimate.rows.kinds, self._joints)
        last = self._shown.get(form, -np.inf)
        send_rows(self._stream, at, form, estimate, names, color, FORM_WIDTHS.get(form, 1.5), after=last)
        self._shown[form] = float(estimate.rows.time[estimate.rows.valid].max(initial=last))
