"""The recording of a run is read back and compared with the arrays that went in."""

import itertools

import numpy as np
import pytest
from rerun.chunk import RrdReader

from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.chart import SQUARE
from idbench.experiments.recording.identification_recording import RunRecording
from idbench.experiments.recording.stream import POSES, shown
from idbench.identify import measured_state
from idbench.sim.robot.scene import Mover, shapes
from idbench.sim.scenario.scenario_file import from_dict

TICK = 10_000_000
"""[ns] between samples."""


def expected(run):
    reference, log = run.reference, run.alone()
    return {
        "q/planned": reference.q,
        "q/true": run.q[0],
        "q/measured": log.q,
        "qd/planned": reference.qd,
        "qd/true": run.qd[0],
        "qdd/planned": reference.qdd,
        "error/tracking": reference.q - run.q[0],
        "error/encoder": log.q - run.q[0],
        "torque/command": run.command[0],
        "torque/true": run.tau[0],
        "torque/disturbance": run.tau[0] - run.command[0],
        "torque/log": log.tau,
    }


def test_every_signal_and_every_time_is_exact(recorded):
    run = recorded.ran.run
    for path, values in expected(run).items():
        ns, found = recorded.column(path)
        np.testing.assert_array_equal(ns, np.arange(len(values)) * TICK, err_msg=path)
        np.testing.assert_array_equal(found, values, err_msg=path)


def test_samples_are_numbered(recorded, reading):
    number, _ = reading.column(recorded.folder / "recording.rrd", "q/measured", timeline="sample")
    np.testing.assert_array_equal(number, np.arange(recorded.ran.run.log.samples))


def test_the_true_acceleration_is_the_mean_between_samples(recorded):
    run = recorded.ran.run
    ns, found = recorded.column("qdd/true")
    np.testing.assert_array_equal(ns, np.arange(run.log.samples - 1) * TICK + TICK // 2)
    np.testing.assert_array_equal(found, np.diff(run.qd[0], axis=0) * run.log.fs)


@pytest.mark.parametrize("role", ["true", "planned", "measured"])
def test_the_arms_move_as_mujoco_moves_them(recorded, role):
    run = recorded.ran.run
    q = {"true": run.q[0], "planned": run.reference.q, "measured": run.log.q[0]}[role]
    moving, kept = Mover(run.robots[0]).at(q), shown(0, len(q), run.log.fs, POSES)
    for body in ("link1", "link2"):
        _, position = recorded.column(f"world/{role}/{body}", "Transform3D:translation")
        _, quaternion = recorded.column(f"world/{role}/{body}", "Transform3D:quaternion")
        np.testing.assert_allclose(position, moving.positions[body][kept], atol=1e-6)  # rerun keeps 32 bits of a pose
        np.testing.assert_allclose(quaternion, moving.quaternions[body][kept], atol=1e-6)


def test_every_shape_is_drawn_once_solid_and_twice_as_wires(recorded, reading):
    there, robot = reading.entities(recorded.folder / "recording.rrd"), recorded.ran.run.robots[0]
    for shape in shapes(robot):
        assert f"world/true/{shape.body}/{shape.name}" in there
        wires = {f"world/{role}/{shape.body}/{shape.name}" in there for role in ("planned", "measured")}
        assert wires == {shape.body != "base"}  # what no joint moves cannot be elsewhere


def test_states_are_those_of_the_velocity(recorded):
    """Played back, each lane says at every sample what the true velocity does."""
    qd = recorded.ran.run.qd[0]
    for j in range(2):
        ns, states = recorded.column(f"state/joint{j + 1}", "StateChange:state")
        at = np.searchsorted(ns, np.arange(len(qd)) * TICK, side="right") - 1
        played, speed = np.array(states)[at], np.abs(qd[:, j])
        assert set(played) == {"rests", "reverses", "moves"}
        slow = 0.05 * np.sqrt(np.mean(speed**2))  # to a fifth: of the planned motion
        assert (speed[played == "moves"] > 0.8 * slow).all()
        assert (speed[played == "rests"] <= 0.012 * slow).all()
        assert (np.diff(at) <= 1).all()
        assert all(a != b for a, b in itertools.pairwise(states))


def test_the_drive_is_recorded_at_the_samples_and_inside_the_loop_at_its_own_rate(recorded, reading):
    """The window is that which was asked for, PWM period by PWM period; means over samples are means of the periods."""
    ns, current = recorded.column("inner/current", file="recording.inner.rrd")
    np.testing.assert_array_equal(ns, 4_000_000_000 + np.arange(100) * 1_000_000)
    _, mean = recorded.column("drive/current")
    np.testing.assert_allclose(mean[400:410], current.reshape(10, 10, 2).mean(axis=1), rtol=1e-12)
    assert not {path for path in reading.entities(recorded.folder / "recording.rrd") if path.startswith("inner")}


def test_measured_predicted_and_residual_are_those_of_the_estimate(recorded):
    for form, rows in {"explicit": ("joint1", "joint2"), "implicit": ("joint1", "joint2"), "power": ("power",)}.items():
        estimate = recorded.ran.fit.estimates[form]
        parts = {"measured": estimate.rows.Y, "predicted": estimate.predicted, "residual": estimate.residual}
        for group, row in enumerate(rows):
            mine = (estimate.rows.group == group) & estimate.rows.valid
            for kind, values in parts.items():
                ns, found = layer(recorded, f"{form}/{kind}/{row}")
                np.testing.assert_array_equal(found[:, 0], values[mine])
                np.testing.assert_allclose(ns, estimate.rows.time[mine] * 1e9, atol=1)


def layer(recorded, path, component="Scalars:scalars"):
    return recorded.column(f"identify/idbench-GLS/{path}", component, "recording.idbench-GLS.rrd")


def test_running_estimates_end_at_the_estimate_with_its_sigma(recorded):
    for form, estimate in recorded.ran.fit.estimates.items():
        for p, name in enumerate(estimate.names):
            _, X = layer(recorded, f"{form}/estimate/{name}", "Measurements:values")
            _, variance = layer(recorded, f"{form}/estimate/{name}", "Measurements:variances")
            # The factor takes in rows in another order than the estimate did: rounding, times the condition of W squared.
            np.testing.assert_allclose(X[-1], estimate.X[p], rtol=1e-8)
            np.testing.assert_allclose(variance[-1] ** 0.5, estimate.standard_errors[p], rtol=1e-6)


def test_velocities_are_shown_as_measured_and_as_the_rows_see_them(recorded):
    found, log = recorded.ran.fit, recorded.ran.run.alone()
    rows = found.processing.grid(log)
    ns, measured = layer(recorded, "qd/measured")
    np.testing.assert_array_equal(measured, measured_state(log, found.processing).qd.T[ns // TICK])
    ns, seen = layer(recorded, "qd/filtered")
    np.testing.assert_array_equal(ns // TICK, np.arange(log.samples)[rows.samples])
    true = recorded.ran.run.qd[0][rows.samples]
    assert np.abs(seen - true).max() < 0.2 * np.abs(true).max()  # moves of 1.3 s pass a filter of 5 Hz, but for their edges


def static(recorded, path, component):
    store = RrdReader(recorded.folder / "recording.idbench-GLS.rrd").store()
    (chunk,) = [c for c in store.stream().filter(content=f"identify/idbench-GLS/{path}").to_chunks() if c.is_static]
    return chunk.to_record_batch().column(component).to_pylist()[0]


def test_the_table_and_the_chart_of_parameters_tell_the_errors(recorded):
    """In the chart a mark is as far to the right as its error is large in % of the value, and on the side of its sign."""
    found, names = recorded.ran.fit, recorded.ran.fit.basis.names
    table = static(recorded, "report", "TextDocument:text")[0]
    truth = np.array(list(found.truth.values()))
    for (name, true), unit in zip(found.truth.items(), found.basis.units, strict=True):
        assert f"{name} | {unit} | {true:g} |" in table
    labels = static(recorded, "parameters/00/all/ticks_y", "LineStrips2D:labels")
    assert [label.rstrip("?") for label in labels] == list(names)
    for form, estimate in found.estimates.items():
        strips = static(recorded, f"parameters/00/all/marks/{form}", "LineStrips2D:strips")
        x = np.array([(min(p[0] for p in strip) + max(p[0] for p in strip)) / 2 for strip in strips])
        error = (estimate.X - truth) / np.abs(truth)
        inside = np.abs(x - SQUARE / 2) < SQUARE / 2 - 1e-6
        np.testing.assert_allclose(np.corrcoef(x[inside], error[inside])[0, 1], 1.0, atol=1e-6)
        assert ((x > SQUARE / 2) == (error > 0)).all()


def test_friction_and_residuals_are_charted_for_each_joint(recorded, reading):
    """The estimated law goes through the dots; the residual's mean is that of the dots' bins."""
    there = reading.entities(recorded.folder / "recording.idbench-GLS.rrd")
    for joint in ("joint1", "joint2"):
        for kind, lines in (("friction", ("explicit", "implicit", "true")), ("over_velocity", ("mean_explicit",))):
            assert {f"identify/idbench-GLS/{kind}/{joint}/lines/{line}" for line in lines} <= there
        law = np.array(static(recorded, f"friction/{joint}/lines/true", "LineStrips2D:strips")[0])
        assert (np.diff(law[:, 0]) >= 0).all()
        assert (np.diff(law[:, 1]) <= 1e-6).all()  # friction grows with velocity, and y points down
    assert not any("/friction/power" in path for path in there)


def test_a_recording_is_a_base_and_layers_of_one_id_each_with_one_layout(recorded, reading):
    ids = set()
    for name, layouts in (("recording.rrd", 1), ("recording.inner.rrd", 0), ("recording.idbench-GLS.rrd", 1)):
        reader = RrdReader(recorded.folder / name)
        ids |= {(e.application_id, e.recording_id) for e in reader.recordings()}
        assert len(reader.blueprints()) == layouts
        reading.verify(recorded.folder / name)
    ((application, recording),) = ids
    assert application == "idbench"
    assert recording.startswith("short-")


@pytest.mark.thorough
def test_watching_changes_no_bit_of_the_run_nor_of_the_recording(recorded, reading, tmp_path):
    """Sent in stretches of half a second, what is read back is the same."""
    audience = Audience("rerun+http://127.0.0.1:9/proxy")
    audience.watching = False  # it has gone, but stretches are as short as if it were there
    again = reading.Recorded(tmp_path, audience)
    assert sum(c.num_rows > 0 for c in chunks(again, "q/true")) > 5
    for name in ("q", "qd", "tau", "command"):
        np.testing.assert_array_equal(getattr(again.ran.run, name), getattr(recorded.ran.run, name))
    assert reading.entities(tmp_path / "recording.rrd") == reading.entities(recorded.folder / "recording.rrd")
    for path in (*expected(recorded.ran.run), "qdd/true", "drive/voltage", "drive/duty"):
        for mine, theirs in zip(again.column(path), recorded.column(path), strict=True):
            np.testing.assert_array_equal(mine, theirs, err_msg=path)
    assert again.column("state/joint1", "StateChange:state")[1] == recorded.column("state/joint1", "StateChange:state")[1]


def chunks(recorded, entity):
    stream = RrdReader(recorded.folder / "recording.rrd").stream()
    return stream.filter(content=entity, has_timeline="sim_time").to_chunks()


def test_the_same_scenario_has_the_same_id_and_another_seed_another(recorded, reading):
    ids = [RunRecording(from_dict(reading.SCENARIO | {"seed": seed})).base.stream.name for seed in (0, 0, 1)]
    assert ids[0] == ids[1] == recorded.streams[0][1].name
    assert ids[2] != ids[0]


def test_fast_logs_are_thinned_out_to_what_can_be_seen():
    """62.5 points a second at least, of any rate, wherever a stretch begins; all of them at up to twice that."""
    for fs in (50.0, 100.0, 249.0, 250.0, 500.0, 1000.0, 5000.0):
        whole = shown(0, 10_000, fs)
        assert whole.sum() >= min(fs, 62.5) / fs * 10_000
        assert whole.all() == (fs < 125)
        np.testing.assert_array_equal(np.concatenate([shown(0, 333, fs), shown(333, 9667, fs)]), whole)
