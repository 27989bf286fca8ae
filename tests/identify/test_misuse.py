"""Likely slips get one line that says what is needed, not an error from deep inside."""

import numpy as np
import pytest

from idbench.identify import (
    ButterworthPrefilter,
    Chain,
    ExplicitModel,
    IdentificationError,
    IirLowPass,
    LogError,
    ModulatingFunctions,
    MotionLog,
    OrdinaryLeastSquares,
    PowerModel,
    SettingError,
    TorqueChannel,
    Windows,
    idbench_chain,
    identify,
    scara,
)

Q = np.zeros((50, 2))
HELD = TorqueChannel("held")


@pytest.mark.parametrize(
    ("arguments", "needed"),
    [
        (("runs/log.parquet", scara(), PowerModel()), "'runs/log.parquet' is given where a MotionLog"),
        ((None, scara(), PowerModel()), "None is given where a MotionLog"),
        ((MotionLog(100, Q, Q, HELD), scara, PowerModel()), "is given where a Basis, such as"),
        ((MotionLog(100, Q, Q, HELD), scara(), "power"), "'power' is given where a model, such as"),
        ((MotionLog(100, Q, Q, HELD), scara(), PowerModel), "is given where a model, such as"),
        ((MotionLog(100, Q, Q, HELD), scara(), PowerModel(), "paper"), "'paper' is given where a Chain"),
        ((MotionLog(100, Q, Q, HELD), scara(), PowerModel(), idbench_chain), "is given where a Chain"),
        ((MotionLog(100, Q, Q, HELD), scara(), PowerModel(), None, "OLS"), "'OLS' is given where an estimator"),
        ((MotionLog(100, Q, Q, HELD), scara(), PowerModel(), None, OrdinaryLeastSquares), "is given where an estimator"),
    ],
)
def test_names_paths_and_classes_in_place_of_objects(arguments, needed):
    with pytest.raises(IdentificationError, match=needed):
        identify(*arguments)


@pytest.mark.parametrize(
    ("q", "message"),
    [
        ([["a", "b"]] * 50, "q must be real numbers in SI units, not <U1"),
        (Q + 1j, "not complex128"),
        (Q.astype(bool), "not bool"),
        (Q.astype("datetime64[ns]"), "not datetime64"),
        ([[0.0, 1.0], [0.0]], "q is not an array: its rows differ in length"),
    ],
)
def test_values_that_are_no_real_numbers(q, message):
    with pytest.raises(LogError, match=message):
        MotionLog(100, q, Q, HELD)


def test_lists_and_integers_are_taken():
    assert MotionLog(100, [[1, 2], [3, 4]], [[1, 2], [3, 4]], HELD).q.dtype == np.float64


@pytest.mark.parametrize("torque", ["held", None, {"meaning": "held"}])
def test_a_torque_channel_must_be_one(torque):
    with pytest.raises(LogError, match="must be a TorqueChannel, such as"):
        MotionLog(100, Q, Q, torque)


def test_one_joint_needs_its_axis():
    with pytest.raises(LogError, match=r"q has shape \(50,\), not \(..., time, joint\)"):
        MotionLog.at_times(np.arange(50) / 100, Q[:, 0], Q[:, 0], HELD)


def test_a_transposed_log_is_guessed():
    with pytest.raises(LogError, match=r"50 joints, the basis 2; its axes are \(time, joint\), is it transposed\?"):
        identify(MotionLog(100, Q.T, Q.T, HELD), scara(), ExplicitModel())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Chain(*[None] * 5, trim=np.nan), "trim = nan must be"),
        (lambda: Chain(*[None] * 5, trim=-1.0), r"trim = -1\.0 must be"),
        (lambda: ButterworthPrefilter(order=0), "order = 0 must be a whole number, at least 1"),
        (lambda: ButterworthPrefilter(order=4.5), r"order = 4\.5 must be a whole number"),
        (lambda: ButterworthPrefilter("8 Hz"), "cutoff = '8 Hz' must be a finite number"),
        (lambda: IirLowPass(order=0), "order = 0 must be a whole number, at least 1"),
        (lambda: ModulatingFunctions(degree=np.nan), "degree = nan must be a whole number"),
        (lambda: MotionLog("100", Q, Q, HELD), "fs = '100' must be a finite number"),
    ],
)
def test_settings_that_are_no_numbers(make, message):
    with pytest.raises(SettingError, match=message):
        make()


@pytest.mark.parametrize(
    ("log", "chain"),
    [
        (MotionLog(100, Q, Q, HELD), Chain(**{**vars(idbench_chain()), "operator": Windows(1e5)})),
        (MotionLog(100, Q, Q, TorqueChannel("held", delay=1e6)), idbench_chain()),
        (MotionLog(100, Q, Q, TorqueChannel("averaged", delay=-1e6)), idbench_chain()),
    ],
)
def test_absurd_lengths_are_refused_before_memory_is_asked_for(log, chain):
    with pytest.raises(LogError, match="the log has 50 samples"):
        identify(log, scara(), ExplicitModel(), chain)
