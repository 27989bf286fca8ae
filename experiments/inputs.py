"""The files that a request names."""

from pathlib import Path
from typing import Any

from idbench.experiments.identification.job import robot_of
from idbench.experiments.identification.reading import file_of
from idbench.experiments.requests import jobs
from idbench.experiments.requests.words import request_keys, word_of
from idbench.sim.robot.robot import Robot


def files_of(asked: Any) -> tuple[Path, ...]:
    """The files that are read, by the marks of the request: nothing may be written over them."""
    found = dict[Path, None]()
    for place, hint in request_keys(jobs.request_type(asked)).values():
        what, value = word_of(hint).file, asked
        for name in place:
            value = getattr(value, name)
        for each in value if isinstance(value, tuple) else (value,):
            if what and each and (what != "name" or Path(each).suffix):
                path = Robot.path(each) if what == "robot" else file_of(each) if what == "log" else Path(each)
                found[path.absolute()] = None
    if isinstance(asked, jobs.IdentifyRequest):  # that of the run, where none is named
        found[Robot.path(robot_of(asked).name).absolute()] = None
    return tuple(found)
