"""The command line loads what a command uses: what asks for nothing else is there at once."""

import subprocess
import sys

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


IDENTIFY = "identify ex/log.csv --robot ex/arm.xml --torque held --torque-delay 0 --model explicit"
SLOW = {"scipy.signal", "scipy.stats", "scipy.optimize", "matplotlib", "rerun"}  # Half a second, and a third
MODULES = {
    "list": (915, set()),
    "scenario": (915, set()),
    "scenario servo --out s.toml": (915, set()),
    "study": (1070, set()),
    "device": (1060, set()),
    "robot puma560": (970, set()),
    "log ex/log.csv": (955, set()),
    "new scenario mine": (1035, set()),
    "check --help": (330, set()),
    "view --help": (330, set()),
    "completion bash": (965, set()),
    "resample ex/log.csv --torque held --out even.csv": (965, set()),
    "run ideal --no-rerun": (1100, set()),
    f"{IDENTIFY} --no-rerun": (1090, set()),
    f"{IDENTIFY} --out found": (1735, {"rerun"}),
    "table1 --no-rerun": (1525, {"scipy.signal", "scipy.stats", "scipy.optimize"}),  # Butterworth's filters of chain paper
}
"""Words -> modules that they load at most, a tenth more than now, and what is slow of them."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("light")
    code = "from idbench.experiments.cli import main\nmain(['new', 'example', 'ex'])"
    subprocess.run([sys.executable, "-c", code], cwd=folder, check=True, capture_output=True)
    return folder


@pytest.mark.thorough
@pytest.mark.parametrize("words", MODULES)
def test_commands_load_no_more_than_they_use(start, folder, words):
    code = f"import sys; from idbench.experiments.cli import main\ntry: main({words.split()})\nexcept SystemExit: pass\n"
    out, err = start("-c", f"{code}print('loaded', *sys.modules)", cwd=folder).communicate()
    loaded, (most, slow) = set(out.splitlines()[-1].split()), MODULES[words]
    assert "loaded" in loaded, err
    assert loaded & SLOW == slow
    assert len(loaded) < most
