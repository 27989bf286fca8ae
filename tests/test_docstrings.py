"""Examples in docstrings run, and print what they say."""

import doctest
from importlib import import_module

import pytest

EXAMPLES = {
    "idbench.identify.data.motion_log": "MotionLog.at_times",
    "idbench.identify.files.log_file": "read_log",
    "idbench.identify.basis.tree_links": "tree_basis",
    "idbench.identify.parameters.base_parameters": "scara",
    "idbench.identify.estimators.identification": "identify",
    "idbench.sim.robot.robot": "Robot.load",
    "idbench.sim.robot.tree": "kinematic_tree",
    "idbench.sim.scenario.scenario_file": "load",
    "idbench.sim.engine.run": "Run.truth",
    "idbench.sim.engine.simulation": "simulate",
}
"""What people call from Python, by its module."""


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_run(name):
    module = import_module(name)
    finder, runner = doctest.DocTestFinder(exclude_empty=True), doctest.DocTestRunner()
    tests = [test for test in finder.find(module) if test.examples]
    assert any(test.name.endswith(EXAMPLES[name]) for test in tests)
    for test in tests:
        runner.run(test)
    assert runner.summarize(verbose=False).failed == 0
