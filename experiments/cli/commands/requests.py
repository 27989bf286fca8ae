"""Requests as the options of a command state them."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from idbench.experiments.cli.options.identify import Identify
from idbench.experiments.cli.options.shared import LogOptions
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.chain_settings import chain_of
from idbench.experiments.identification.defaults import CHAIN
from idbench.experiments.identification.load import in_band
from idbench.experiments.identification.reading import ReadOptions
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import SCARA, RobotModel, absolute
from idbench.identify import CHAINS, ESTIMATORS, MODELS
from idbench.identify.signals.masks import NoMask
from idbench.sim.scenario.scenario_file import load


def read_options(options: LogOptions) -> ReadOptions:
    """Return how logs are read."""
    return ReadOptions(options.torque, options.torque_delay, options.unwrap, columns=options.reading)


def request_of(options: Identify, stated: Mapping[str, Any]) -> Request:
    """Return what is asked for, the robot by default that which the folder of a run states."""
    _require_label(options.label)
    robot = stated.get("robot", SCARA) if options.robot is None else absolute(options.robot)
    own = options.log[0] / "scenario.toml"
    loops = options.loop or ([str(own)] if len(options.log) == 1 and own.is_file() else [])
    request = Request(
        RobotModel(robot, options.parameters, options.mounting.mounting),
        tuple(MODELS) if options.model in (None, "all") else (MODELS.load(options.model),),
        CHAINS.load(options.chain),
        options.estimator,
        name=options.label,
        loops=tuple(map(load, loops)),
        start=options.start,
        consistent=options.consistent,
        mask_speed=options.mask_speed,
    )
    if options.loop and "loop" not in request.solver.needs:
        raise ExperimentError(
            f"--loop: {options.estimator} simulates no loop; leave it out, or use --estimator IV, DIDIM, CLIE or CLOE"
        )
    return _with_chain(options, request)


def chooses_band(options: LogOptions) -> bool:
    """Return whether the band is to suit the logs: nothing says it."""
    stated = isinstance(options, Identify) and (options.chain_file is not None or options.chain != CHAIN)
    return options.cutoff is None and not stated


def _with_chain(options: Identify, request: Request) -> Request:
    """Return a request with the chain that options and files state."""
    if options.chain_file is not None and options.cutoff is not None:
        raise ExperimentError("--cutoff and --chain-file both say the band: give one")
    if options.chain_file is not None:
        name, chain = chain_of(options.chain_file)
        return replace(request, chain=name, method=(chain, ESTIMATORS.create(request.estimator)))
    if options.parameters.armature == "none" and options.chain == CHAIN and not options.mask_speed:
        # Behind the gears next to no friction is left that turns with the velocity: nothing to mask.
        request = replace(request, method=(replace(request.processing, mask=NoMask()), request.solver))
    return request if options.cutoff is None else in_band(request, options.cutoff)


def _require_label(label: str) -> None:
    if label and (not re.fullmatch(r"[A-Za-z0-9][\w.-]*", label) or label == "inner"):
        raise ExperimentError(f"--label {label!r} must be of letters, digits, dots, hyphens and underscores, and not 'inner'")
