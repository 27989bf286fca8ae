"""The command that writes scenarios."""

from experiments.cli.bench import WriteScenario
from experiments.cli.page import new_page, show
from experiments.errors import ExperimentError
from experiments.identification.results import write_whole
from sim.scenario.scenario_file import designed, load, names, to_toml


def write(asked: WriteScenario) -> None:
    """Write a scenario out, or list those that ship."""
    page = new_page()
    if asked.name is None:
        for known in names():
            page.out(f"{known:16} {load(known).origin}")
        page.out(f"{len(designed())} more with motions of idbench excite, for its studies: {', '.join(designed())}")
    elif asked.out is None:
        page.out(to_toml(load(asked.name)).rstrip("\n"))
    elif asked.out.exists():
        raise ExperimentError(f"{asked.out} exists: choose another --out")
    else:
        write_whole(asked.out, to_toml(load(asked.name)))
        page.out(f"written to {asked.out}; run it: uv run idbench run {asked.out}")
    show(page)
