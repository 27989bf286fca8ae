"""The command line as a user meets it: answers and files."""

import json
import re
import subprocess

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.cli.app import COMMANDS
from idbench.experiments.cli.command import GROUPS
from idbench.experiments.paper.table1 import SCENARIO
from idbench.experiments.plugin_tables import TABLES
from idbench.experiments.requests.shared import CHAIN, ESTIMATOR
from idbench.experiments.results.writing import NAME as MANIFEST
from idbench.identify import CHAINS, ESTIMATORS, MODELS, identify, scara
from idbench.identify.files.log_file import read_log, write_log
from idbench.sim.scenario.scenario_file import from_dict, load


def test_table1_prints_and_writes_everything(out, capsys):
    assert main(["table1", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert all(f"{name} model" in printed for name in MODELS if name != "explicit+power")
    assert all(text in printed for text in ("The paper's conclusion, with 95 % confidence intervals", "0.649", "3.502"))
    recording = [f"recording.{name}-OLS.rrd" for name in ("idbench", "paper", "paper_masked")] + ["recording.rrd"]
    assert sorted({x.name for x in out.iterdir()} - {MANIFEST}) == ["log.parquet", *recording, "summary.json"]
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["experiment"], summary["seed"], summary["chain"]) == ("table1", 0, "idbench")
    assert summary["models"]["explicit"]["rows"] == 740
    assert from_dict(summary["scenario"]) == load(SCENARIO)
    assert read_log(out / "log.parquet").samples == 4600
    assert list(out.parent.iterdir()) == [out]


@pytest.mark.thorough
def test_table1_repeats_itself(ran):
    a, b = (ran("table1 --seed 5 --out kept").summary for _ in range(2))
    assert a == b
    assert a["seed"] == 5
    assert a["scenario"]["trajectory"]["waypoints"] != list(map(list, load(SCENARIO).trajectory.waypoints))


def test_one_chain_may_be_asked_for(ran):
    printed, _, summary = ran("table1 --out kept --chain paper")
    assert "idbench X" not in printed
    assert summary["chain"] == "paper"
    assert summary["models"]["explicit"]["relative_error_percent"][0] > 0.01
    assert "idbench_chain" not in summary


def test_results_go_through_a_link(tmp_path, capsys):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    assert main(["table1", "--chain", "idbench", "--out", str(tmp_path / "link")]) == 0
    assert len(sorted({x.name for x in (tmp_path / "elsewhere").iterdir()} - {MANIFEST})) == 4


@pytest.mark.thorough
def test_search_writes_a_scenario(tmp_path, ran):
    ran("search --seed 5 --out found.toml")
    found = load(str(tmp_path / "found.toml"))
    assert found.seed == 5
    summary = ran("table1 --scenario found.toml --chain idbench --out kept").summary
    assert from_dict(summary["scenario"]) == found
    assert (tmp_path / "found.toml").read_text() in ran("search --seed 5").out


def test_list_shows_every_plugin_with_a_line(capsys):
    assert main(["list"]) == 0
    printed = capsys.readouterr().out
    for table in TABLES:
        assert all(re.search(rf"^ *{re.escape(name)} +\S", printed, re.MULTILINE) for name in table.builtin)


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("idbench 0.")


def test_a_reader_that_goes_away_is_no_error(tmp_path, start):
    code = "import sys; from idbench.experiments.cli import main; sys.exit(main(['list']))"
    process = start("-c", code, cwd=tmp_path)
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait() == 0


def test_the_last_word_is_that_without_a_name_where_one_is_needed(ran):
    """Options of several words take all that follows; a switch may stand twice."""
    assert ran("robot --add offset two_link").out == ran("robot two_link --add offset").out
    assert main(["list", "--json", "--json"]) == 2
    assert main(["run", "ideal", "-v", "-v", "--no-rerun", "--index", "0"]) == 2  # --index needs --from: words are read


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_complete_every_command_and_its_options(shell, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(re.search(rf"\b{name}\b", script) for name in COMMANDS)
    option = "-l {}" if shell == "fish" else "--{}"
    assert option.format("torque-delay") in script
    assert option.format("armature") in script  # of a group of options, whose name is not typed
    assert not re.search(r"--\w+\.\w", script)


def test_bash_completes_what_is_typed(tmp_path, capsys):
    assert main(["completion", "bash"]) == 0
    (tmp_path / "idbench.bash").write_text(capsys.readouterr().out)
    code = """source idbench.bash; f=$(complete -p idbench | sed 's/.*-F \\([^ ]*\\).*/\\1/')
    for words in "idbench ident" "idbench identify --torque-d" "idbench identify --arma" "idbench identify idb" \\
        "idbench run rip" "idbench study smallest-d" "idbench identify --estimator GL" "idbench run ripple --robot pum"; do
        COMP_WORDS=($words); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); COMP_LINE=$words; COMP_POINT=${#words}
        $f; echo "${#COMPREPLY[@]} ${COMPREPLY[@]}"
    done"""
    done = subprocess.run(["bash", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    words = ["identify", "--torque-delay", "--armature", "idbench.bash", "ripple", "smallest-delay", "GLS", "puma560"]
    assert done.stdout.split() == [word for each in words for word in ("1", each)]


def test_the_commands_are_in_groups(capsys):
    assert main(["--help"]) == 0
    titles = re.findall(r"─ (\w+) ─", capsys.readouterr().out)
    assert titles == [*GROUPS, "Help"]
    assert {command.group for command in COMMANDS.values()} == set(GROUPS)


def test_a_command_that_is_repeated_says_what_changed(log, tmp_path, ran):
    write_log(log.part(0, 2000), tmp_path / "a.csv")
    words = "identify a.csv --robot scara --torque held --model explicit --estimator OLS --no-rerun --out found"
    assert "changed since" not in ran(words, "--torque-delay 0").out
    assert "changed since" not in ran(words, "--torque-delay 0").out  # the same bits
    again = ran(words, "--torque-delay 0.001 --force").out
    assert re.search(r"changed since the last results there: \w+ of the explicit model from \S+ to \S+ .* \(\S+ sigma\)", again)


def test_the_command_lines_defaults_are_those_of_python(log):
    """To the bit: another estimator, or another chain, gives other parameters."""
    model = MODELS.create("explicit")
    named = identify(log, scara(), model, CHAINS.create(CHAIN), ESTIMATORS.create(ESTIMATOR))
    np.testing.assert_array_equal(identify(log, scara(), model).X, named.X)
