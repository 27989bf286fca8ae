"""The command line loads what a command uses: what asks for nothing else is there at once."""

import pytest

HEAVY = {"numpy", "scipy", "mujoco", "pydantic", "pyarrow", "rerun", "matplotlib", "idbench.identify", "idbench.sim"}


@pytest.mark.parametrize(
    "words", [["--help"], ["identify", "--help"], ["tabel1"], ["run", "--sed", "3"], ["--version"]], ids=" ".join
)
def test_help_and_wrong_words_load_nothing_heavy(start, words):
    code = "import sys; from idbench.experiments.cli import main\n"
    code += f"try: main({words})\nexcept SystemExit: pass\n"
    code += "names = [name.split('.') for name in sys.modules]\n"
    code += "print('loaded', *{'.'.join(name[: 1 + (name[0] == 'idbench')]) for name in names})"
    out, err = start("-c", code).communicate()
    loaded = set(out.splitlines()[-1].split()[1:])
    assert "idbench.experiments" in loaded, err
    assert not loaded & HEAVY


def test_the_list_of_plugins_loads_neither_scipys_parts_nor_figures(start):
    code = "import sys; from idbench.experiments.cli import main\nmain(['list'])\nprint('loaded', *sys.modules)"
    out, _ = start("-c", code).communicate()
    loaded = set(out.splitlines()[-1].split())
    assert not loaded & {"scipy.signal", "scipy.stats", "scipy.optimize", "matplotlib", "rerun", "pyarrow"}
