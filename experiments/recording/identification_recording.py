"""The recordings of a run and of a log: a base, a layer inside the loop, and a layer for each identification."""

import hashlib
from pathlib import Path

from idbench.experiments.errors import ResultsError
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.identification.scenario_run import ScenarioRun
from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.folder import BASE, INNER, files, known, layer_file, rearranged
from idbench.experiments.recording.identification_layer import Layer, LiveIdentification
from idbench.experiments.recording.lanes import ROLES, about
from idbench.experiments.recording.motion_layer import Base
from idbench.experiments.recording.stream import Stream, parts
from idbench.experiments.requests.shared import CHAIN
from idbench.identify import measured_state
from idbench.identify.rows.rows import is_long
from idbench.sim.engine.run import Run
from idbench.sim.engine.watch import Watch
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import to_toml

UNWATCHED = 10.0  # Length of the stretches of a run that nobody watches [s]: what is not recorded yet takes memory


class RunRecording:
    """The recording of a scenario, which grows while it is simulated.

    In `window` [s] signals inside the loop are shown at their full rate; `robot_model` is what is identified of the robot while
    it moves, for who watches; all of it by default.
    """

    def __init__(
        self,
        scenario: Scenario,
        audience: Audience | None = None,
        window: tuple[float, float] | None = None,
        robot_model: RobotModel | None = None,
    ) -> None:
        self._audience, written = audience, to_toml(scenario)
        robot, fs = scenario.real_robot, scenario.fs
        planned = scenario.trajectory.sample(robot, fs)
        self.base = Base(recording_id(scenario.name, written.encode()), robot, fs, tuple(ROLES), planned.qd, audience)
        self.base.stream.describe(scenario=written, seed=str(scenario.seed), fs_hz=f"{scenario.fs:g}")
        if audience:  # so that the view holds the whole motion from the beginning
            self.base.arm.trace(planned.q)
            joints = parts(robot.joints)
            robot_model = RobotModel(scenario.robot) if robot_model is None else robot_model
            self.base.live = LiveIdentification(self.base.stream, robot_model, CHAIN, scenario.channel, scenario.fs, joints)
        self.watch = Watch(self.base.stretch, audience.every if audience else UNWATCHED, window)

    def end(self, run: Run) -> list[tuple[str, Stream]]:
        """Add what only the end of a simulation tells; return the streams by the name of their file."""
        self.base.arm.trace(run.q[0])
        return [(BASE, self.base.stream), *([(INNER, self.base.inner)] if self.base.inner else [])]

    def finish(self, ran: ScenarioRun, head: str = "") -> list[tuple[str, Stream]]:
        """Add what only the end of a run gives, and the identification; return the streams by the name of their file.

        `head` says what it comes to, as in all functions here.
        """
        streams = self.end(ran.run)
        if ran.rejection is not None:
            self.base.also("torque/rejection", ran.rejection.rejected)
        self.base.finish(about(ran.scenario.name, ran.scenario.origin))
        if is_long([ran.run.alone()]):  # of which no rows are kept
            return streams
        there = set().union(*(stream.paths for _, stream in streams))
        return [*streams, Layer(self.base.stream.name, ran.fit, ran.run.robots[0].joints, there, self._audience).send(head)]


def record_log(fit: Fit, head: str = "", audience: Audience | None = None) -> list[tuple[str, Stream]]:
    """Return the streams of an identified log's recording, by the name of their file."""
    log, robot = fit.logs.fitted[0], fit.robot_model.robot
    qd = measured_state(log, fit.processing).qd.T
    base = Base(recording_id("log", log.q.tobytes() + log.tau.tobytes()), robot, log.fs, ("measured",), qd, audience)
    channel = log.torque
    base.stream.describe(fs_hz=f"{log.fs:g}", torque=channel.meaning, torque_delay_s=f"{channel.delay:g}")
    base.replay(log, {}, qd)
    base.arm.trace(log.q)
    base.finish(about("log", "", ("measured",)))
    return [(BASE, base.stream), Layer(base.stream.name, fit, robot.joints, base.stream.paths, audience).send(head)]


def add_layer(folder: Path, fit: Fit, head: str = "", audience: Audience | None = None) -> list[tuple[str, Stream]]:
    """Return the streams of the layers of the recording in a results folder, that of an identification first.

    The layers that are there already come anew with it, to lay out the new one beside them.

    Raises
    ------
    ResultsError
        If there is no recording, or it cannot be read or written.
    """
    others = [path for path in files(folder) if path.name != layer_file(fit.request.label)]
    if not (folder / BASE).is_file():
        raise ResultsError(f"there is no {BASE} in {folder} to add a layer to: give --out for a recording of its own")
    name, there = known(others)
    if audience:
        whole = Stream(name, audience)
        for path in reversed(others):
            whole.copy(path)
        whole.close()
    made = Layer(name, fit, fit.robot_model.robot.joints, there, audience).send(head)
    return [made, *rearranged(others, made[1])]


def recording_id(name: str, content: bytes) -> str:
    """Return a name and what distinguishes its content from others: recordings of one id are shown as one."""
    return f"{name}-{hashlib.sha256(content).hexdigest()[:10]}"
