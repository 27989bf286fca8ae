"""Nonsense is refused and riddles are solved: one line that names the value, what is allowed and the way out."""

import os
import subprocess
import sys

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.identify import TorqueChannel
from idbench.identify.files.log_file import read_log, write_log

DH = 'angles = "rad"\n{gravity}[[joints]]\nname = "a"\n{first}\n[[joints]]\nname = "b"\nalpha = 1.5708\nd = 0.3\n'


@pytest.fixture
def csv(log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_log(log.part(0, 1500), tmp_path / "log.csv")
    return tmp_path / "log.csv"


IDENTIFY = "identify", "log.csv", "--robot", "scara", "--torque", "held", "--torque-delay", "0"


@pytest.mark.parametrize(
    ("gravity", "first", "message"),
    [
        ("", "range = [1, -1]", "joint a: range = [1, -1]: the lowest is not below the highest"),
        ("", "range = [nan, nan]", "joint a: range = nan must be a number"),
        ("", "range = [false, true]", "range = False must be a number"),
        ("", "range = [1]", "range = [1] must be a list of 2 numbers"),
        ("", "d = true", "joint a: d = True must be a number"),
        ("", 'd = "0.3"', "joint a: d = '0.3' must be a number"),
        ("", "armature = 1e300", "must be a number from -1e+06 to 1e+06"),
        ("", "sigma = true", "sigma = True must be 0 (turns) or 1 (slides)"),
        ("gravity = [0, 0, 1e9]\n", "", "gravity = 1000000000.0 must be a number from -1000 to 1000"),
        ("gravity = 9.81\n", "", "gravity = 9.81 must be a list of 3 numbers"),
        ("gravity = [0, 0, nan]\n", "", "gravity = nan must be a number"),
    ],
)
def test_tables_of_joints(gravity, first, message, tmp_path, complaint):
    (tmp_path / "arm.toml").write_text(DH.format(gravity=gravity, first=first))
    assert message in complaint("robot", str(tmp_path / "arm.toml"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--friction standard+cogging", "--friction cogging: give the number of periods in a turn of the joint"),
        ("--add cogging", "--add cogging: give the number of periods"),
        ("--friction stribeck:-1", "'-1' is no vs of stribeck: it must be from"),
        ("--friction stribeck:nan", "it must be from"),
        ("--friction tanh:1e300", "it must be from"),
        ("--friction load:-1", "load has no setting: leave :-1 out"),
        ("--friction stribeck-free:0.1", "stribeck-free is the law of unknown"),
        ("--friction viscous:3", "viscous has no setting"),
        ("--coupling m=joint1", "joint1 alone is a drive of its own"),
        ("--coupling m=0*joint1+joint2", "a factor must be from 1e-06"),
        ("--coupling m=1e300*joint1+joint2", "a factor must be from 1e-06"),
        ("--coupling joint1=joint1+joint2", "that is the name of a joint"),
        ("--coupling m=joint1-joint1", "joint1 is given twice"),
        ("--gravity 0 0 1e9", "must be numbers up to 1000 m/s^2"),
    ],
)
def test_descriptions_of_robots(words, message, complaint):
    assert message in complaint("robot", "scara", *words.split())


@pytest.mark.parametrize(
    ("option", "joint", "geom", "message"),
    [
        ("", "", 'mass="1e300"', "mass of body 'b' is 1e+300, more than 1e+06"),
        ("", 'armature="1e300"', "", "joint j has armature = 1e+300"),
        ("", 'frictionloss="1e300"', "", "joint j has frictionloss = 1e+300"),
        ('<option gravity="0 0 1e9"/>', "", "", "must be numbers up to 1000 m/s^2"),
    ],
)
def test_robots_of_impossible_size(option, joint, geom, message, tmp_path, complaint):
    (tmp_path / "arm.xml").write_text(
        f'<mujoco>{option}<worldbody><body name="b"><joint name="j" {joint}/><geom size="0.1" pos="0.1 0 0" {geom}/></body>'
        "</worldbody></mujoco>"
    )
    assert message in complaint("robot", str(tmp_path / "arm.xml"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("resample log.csv --out r.parquet --fs 0 --torque held", "--fs 0 must be a number above 0"),
        ("resample log.csv --out x.docx --torque held", "--out x.docx: its name must end with .csv or .parquet"),
        ("identify log.csv --torque held --torque-delay 1e9", "must be below 1 s in size; is it in ms or in samples?"),
        ("identify log.csv --torque held --gain 0", "a gain of 0 makes no torque"),
        ("identify log.csv --torque held --gain nan", "a gain of nan makes no torque"),
        ("identify log.csv --torque held --cutoff 0", "--cutoff 0 must be at least 0.01"),
        ("identify log.csv --torque held --cutoff inf", "--cutoff inf must be at least 0.01"),
        ("payload log.csv --unloaded log.parquet --robot scara --torque held --cutoff 0", "--cutoff 0 must be at least 0.01"),
        ("payload log.csv --robot scara --mass 1e300", "--mass 1e+300 must be above 0 and at most 100000 kg"),
        ("payload log.csv --robot scara --mass 1 --at 1e200 0 0", "--at 1e+200: the centre of mass must lie within"),
        ("payload log.csv --robot scara --mass 1 --at 0 0 0 --inertia -1 -1 -1 0 0 0", "is of no body"),
        ("payload --simulate payload --runs 1000000000000", "must be at least 1 and at most 1,000"),
        ("run ideal --port 8080", "--port 8080 is that of the web viewer: add --serve"),
        ("identify log.csv --torque none", "leave --torque out instead"),
        ("table1 --motions 2.5", "give a whole number"),
        ("identify log.csv --json=false", "--json takes no value"),
        ("identify log.csv -v --bogus", "no option --bogus"),
        ("resample log.csv", "resample needs --out"),
        ("identify log.csv --hold", "--hold needs NAME=VALUE"),
        ("run ideal --out None --robot None", "no robot 'None'"),
        ("excite scara --torque-noise 1e300", "must be at least 1e-06 and at most 1e+06 N m"),
        ("excite scara --weigh ZZ2=1e300", "a weight from 1e-6 to 1e6"),
        ("excite scara --velocity nan", "--velocity nan must be a number above 0"),
        ("new plugin class", "'class' is taken"),
    ],
)
def test_options(words, message, csv, complaint):
    write_log(read_log(csv, TorqueChannel("held")).part(0, 1000), csv.with_suffix(".parquet"))
    assert message in complaint(*words.split())


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ("joints = [1, 2]", 'joints = [1, 2] must be names in quotes, such as joints = ["1", "2"]'),
        ('joints = ["a", "a"]', "a is given twice"),
        ("[t]\nfs = 1e308", "[t]: fs = 1e+308 must be between 0.001 and 1e+07 Hz"),
        ("[t]\nfs = -3", "fs = -3 must be between"),
    ],
)
@pytest.mark.parametrize("command", ["log", "identify"])
def test_layouts(layout, message, command, csv, complaint):
    (csv.parent / "log.toml").write_text(f"{layout}\n")
    assert message in complaint(command, "log.csv", *(["--torque", "held"] if command == "identify" else []))


def test_a_layout_that_is_a_folder(csv, complaint):
    (csv.parent / "log.toml").mkdir()
    assert "log.toml is a folder, where a file says what the columns of logs are" in complaint(*IDENTIFY)


def test_a_truth_is_true_or_false(csv, complaint):
    text = (
        'name = "x"\nquestion = "?"\nscenario = "ideal"\nbound = "yes"\n[[axes]]\nfield = "torque.noise"\nvalues = [0.1, 0.2]\n'
    )
    (csv.parent / "x.toml").write_text(text)
    assert "bound = 'yes'" in complaint("study", "x.toml")


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (
            "t,q1,q2,tau1,tau2\ns,rad,rad,Nm,Nm",
            "line 2 holds no numbers but s, rad, rad, Nm, Nm: if these are units",
        ),
        ("t,q1,q_joint2,tau1,tau_joint2", "numbers some joints (q1) and names others (q_joint2, tau_joint2)"),
    ],
)
def test_headers(header, message, csv, complaint):
    csv.write_text("\n".join([header, *csv.read_text().splitlines()[1:]]))
    assert message in complaint(*IDENTIFY)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("identfy", "no command 'identfy' (did you mean 'identify'?)"),
        ("--cutoff 3", "--cutoff: name a command first"),
        ("identify x --cutoff five", "--cutoff five: give a number"),
        (
            "identify x --torque hold",
            "--torque hold: no such choice (did you mean 'held'?); known: averaged, held, inst",
        ),
        ("identify x --gravity 1 2", "--gravity 1 2: give three numbers"),
        ("identify x --cutof 3", "identify has no option --cutof (did you mean '--cutoff'?)"),
        ("search --seed abc", "--seed abc: give a whole number"),
        ("run a b", "run takes no further word 'b'"),
        ("new", "new needs what, name"),
    ],
)
def test_words(words, message, complaint):
    line = complaint(*words.split())
    assert message in line
    assert "None" not in line


def test_a_plain_robot_is_asked_for_its_speeds_at_once(tmp_path, complaint, monkeypatch):
    """README's own command on a file of which MJCF says no speeds; the options that are named are enough."""
    monkeypatch.chdir(tmp_path)
    limited = '<joint name="{}" axis="0 0 1" range="-2 2"/>'
    (tmp_path / "arm.xml").write_text(
        '<mujoco><compiler angle="radian" autolimits="true"/><worldbody><body name="a">' + limited.format("one")
        + '<geom size="0.05" pos="0.2 0 0"/><body name="b" pos="0.5 0 0">' + limited.format("two")
        + '<geom size="0.05" pos="0.2 0 0"/></body></body></worldbody></mujoco>'
    )  # fmt: skip
    asked = []
    monkeypatch.setattr("idbench.experiments.identification.robot_model.BaseParameters.of", lambda *args: asked.append(args))
    line = complaint("excite", "arm.xml")
    assert "add --velocity with rad/s of all joints or of each, such as --velocity 1.5" in line
    assert "add --acceleration" in complaint("excite", "arm.xml", "--velocity", "1.5")
    assert not asked  # before the parameters are grouped
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    words = "--velocity", "1.5", "--acceleration", "5", "--duration", "4", "--no-rerun", "--out", "out"
    assert main(["excite", "arm.xml", *words]) == 0


def test_files_go_into_the_folder_that_is_made(idbench, logs, tmp_path):
    words = "--robot", "puma560", "--model", "explicit", "--estimator", "WLS", "--no-rerun"
    code, _, err = idbench(
        "identify", logs / "first.parquet", *words, "--out", "found", "--write", "found/a.json", "found/b.py"
    )
    assert (code, err) == (0, "")
    assert {"a.json", "b.py", "summary.json"} <= {path.name for path in (tmp_path / "found").iterdir()}


def test_an_estimator_that_fails_is_not_a_short_log(monkeypatch, complaint, logs):
    from idbench.identify import ESTIMATORS, AbstractEstimator, Estimate

    class Nanny(AbstractEstimator):
        """Gives NaN."""

        def solve(self, problem):
            return Estimate.judge(problem, np.full(len(problem.names), np.nan), np.eye(len(problem.names)))

    monkeypatch.setitem(ESTIMATORS._builtin, "nanny", Nanny)
    line = complaint("identify", str(logs / "first.parquet"), "--robot", "puma560", "--estimator", "nanny")
    assert "gives NaN or infinity" in line
    assert "the estimator fails here, not the log" in line


def test_control_characters_do_not_reach_the_terminal(tmp_path, capfd):
    """A name that would turn the screen red, and begin a line of its own."""
    text = DH.format(gravity="", first="").replace('name = "a"', 'name = "a\\u001b[31mRED\\u009b"')
    (tmp_path / "arm.toml").write_text(text)
    main(["robot", str(tmp_path / "arm.toml")])
    main(["robot", str(tmp_path / "no\x1b[31m\nsuch.toml")])
    out, err = capfd.readouterr()
    assert "\x1b" not in out + err
    assert "\x9b" not in out + err
    assert len(err.splitlines()) <= 1 + out.count("\x00")


@pytest.mark.thorough
@pytest.mark.parametrize("encoding", ["cp1252", "latin-1", "ascii"])
def test_other_encodings_of_the_terminal(encoding, start):
    process = start(
        "-c",
        "from idbench.experiments.cli import entry; entry()",
        "robot",
        "scara",
        env=os.environ | {"PYTHONIOENCODING": encoding},
    )
    out, err = process.communicate()
    assert process.returncode == 0, err
    assert "joint1" in out


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes there alone")
def test_names_of_files_that_are_no_utf8(csv):
    name = os.fsencode(csv.parent) + b"/l\xfcg.csv"
    with open(name, "wb") as file:  # noqa: PTH123
        file.write(csv.read_bytes())
    words = [
        b"identify",
        name,
        b"--torque",
        b"held",
        b"--torque-delay",
        b"0",
        b"--model",
        b"explicit",
        b"--no-rerun",
        b"--out",
        b"o",
    ]
    code = "from idbench.experiments.cli import entry; entry()"
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert b"l\\xfcg.csv" in done.stdout
    assert b"l\\udcfcg.csv" in (csv.parent / "o" / "report.html").read_bytes()


@pytest.mark.parametrize(
    "words",
    [
        "log {}.csv", "identify {}.csv", "resample {}.csv --out x.csv", "scenario ideal --out {}.toml", "study --resume {}",
        "view {}", "export {}", "new study {}", "run ideal --out {}", "identify log.csv --torque held --write {}.json",
    ],
)  # fmt: skip
def test_names_of_300_letters(words, csv, complaint):
    line = complaint(*words.format("a" * 300).split())
    assert "too long" in line or "cannot" in line or "there is no" in line
    assert len(line) < 500


def test_a_pipe_is_not_waited_for(csv, complaint):
    os.mkfifo(csv.parent / "pipe.csv")
    assert "is a pipe: a log is read more than once" in complaint("log", "pipe.csv")


def test_a_small_file_that_unpacks_to_more_than_there_is(tmp_path, complaint, monkeypatch):
    np.savez_compressed(tmp_path / "big.npz", t=np.zeros(200_000), q1=np.zeros(200_000), tau1=np.zeros(200_000))
    monkeypatch.setattr("idbench.identify.files.table.memory", lambda: 1e-3)
    assert "3 arrays of 0.0048 GB: reading them takes 0.0144 GB" in complaint("log", str(tmp_path / "big.npz"))


def test_a_long_log_of_zeros_takes_no_time_for_each_of_its_rows(log):
    """Once the median of all steps was computed for each of them."""
    from idbench.identify.data.clock import LogClock
    from idbench.identify.data.log_columns import LogColumns

    n, calls = 20_000, []
    clock = LogClock.of(LogColumns(np.arange(n) / 1000.0, np.zeros((n, 2)), np.zeros((n, 2)), None))
    original = np.median
    try:
        np.median = lambda *args, **options: calls.append(1) or original(*args, **options)
        assert clock.filled == 0
    finally:
        np.median = original
    assert len(calls) < 10


def test_little_memory_is_told(start):
    code = "import resource; resource.setrlimit(resource.RLIMIT_AS, (10**9, 10**9))\n"
    code += "from idbench.experiments.cli import entry; entry()"
    process = start("-c", code, "list")
    _, err = process.communicate()
    assert process.returncode == 2
    assert "this process may have 1 GB of address space (ulimit -v), idbench needs 1.5 GB" in err


def test_progress_is_told_by_model_and_estimator(csv, monkeypatch, capfd):
    """A line for each stage where there is no terminal, at most every so often; none on standard output."""
    monkeypatch.setattr("idbench.experiments.results.page.EVERY", 0.002)
    assert main([*IDENTIFY, "--estimator", "GLS", "--no-rerun"]) == 0
    out, err = capfd.readouterr()
    assert "identifying: " in err
    assert "model, GLS (" in err
    assert "identifying: " not in out
