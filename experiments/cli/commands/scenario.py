"""The command that writes scenarios."""

from idbench.experiments.cli.options.tools import WriteScenario
from idbench.experiments.program import program
from idbench.experiments.results.page import Page
from idbench.experiments.results.writing import require_free, write_text
from idbench.sim.scenario.scenario_file import designed, load, names, to_toml


def write(options: WriteScenario) -> None:
    """Write a scenario out, or list those that ship."""
    page = Page()
    if options.name is None:
        width = max(map(len, names()))
        for known in names():
            page.out(f"{known:{width}}  {load(known).origin}")
        page.out(f"{len(designed())} more for the studies of excitation, such as {designed()[0]}: excited/ROBOT-MOTION")
    elif options.out is None:
        page.out(to_toml(load(options.name)).rstrip("\n"))
    else:
        require_free(options.out, "--out", force=options.force)
        write_text(options.out, to_toml(load(options.name)), "--out", force=options.force)
        page.out(f"written to {options.out}; run it: {program()} run {options.out}")
    page.close()
