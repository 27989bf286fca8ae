"""Options of the commands: plain dataclasses, each with the name of the function that does its work."""

from experiments.cli.options import (  # noqa: F401  # each registers its commands, in the order of the help
    authors,
    excite,
    identify,
    loads,
    log,
    paper,
    robot,
    run,
    scenario,
    study,
    view,
)
