"""Make the pictures in these pages, from scenarios that ship and from kept figures.

    uv run python docs/pictures.py [NAME ...] [--logs FOLDER]

Every picture is a recording opened in rerun's own viewer, without a window; on a machine without a graphics card that needs a
software Vulkan driver, such as Debian's mesa-vulkan-drivers. Names are those of CHARTS, PAGES, PICTURES and, with a folder of
real logs, REAL; all by default.
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import warnings
from argparse import ArgumentParser
from collections.abc import Iterator
from contextlib import chdir, contextmanager
from dataclasses import dataclass
from importlib import import_module
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image

from idbench.experiments.cli import main as idbench

warnings.filterwarnings("ignore")  # the viewer's client is declared unstable; our pin holds it

DOCS = Path(__file__).absolute().parent


@dataclass(frozen=True)
class Picture:
    """A picture: what is run, and what is looked at.

    Parameters
    ----------
    commands : tuple of str
        Of idbench; OUT is where results go.
    tab : str
        What is in front.
    at : float
        Where on the time of the recording it is looked at, as a share.
    """

    commands: tuple[str, ...]
    tab: str = ""
    at: float = 0.3


@dataclass(frozen=True)
class Movie(Picture):
    """A moving picture: from one share of the time to another, in so many frames."""

    until: float = 0.4
    frames: int = 36


DELAY = ("run delay --out OUT", "identify OUT --torque held --torque-delay 0 --label no-delay")
COGGING = ("run ripple --out OUT --inner 10 10.004",)
GAIN = ("run gain --out OUT",)
KNOWN = "--robot pendulum --servo bench/servo.toml --friction coulomb"
SERVO = ("run servo --out bench --no-rerun", f"servo bench/log.parquet {KNOWN} --out OUT")

BAR = 0.04
"""Height of the viewer's own bar, as a share of a picture."""

PICTURES = {
    "delay": Movie(DELAY, "", 0.3, until=0.42),
    "recording-overview": Picture(("run quantization --out OUT",)),
    "recording-filters": Picture(("run quantization --out OUT",), "filters"),
    "recording-delay": Picture(DELAY),
    "recording-delay-friction": Picture(DELAY, "friction"),
    "recording-cogging": Picture(COGGING, "friction"),
    "recording-drive": Picture(COGGING, "drive"),
    "recording-gain": Picture(GAIN),
    "recording-gain-parameters": Picture(GAIN, "parameters"),
    "recording-saturation": Picture(("run saturation --out OUT",), "parameters"),
    "any-arm": Picture(("run arm --out OUT",), "", 0.4),
    "table1": Picture(("table1 --out OUT",), "", 0.6),
    "recording-compare": Picture(("run quantization --out OUT/quantization", "run ripple --out OUT/ripple"), "compare"),
    "recording-excited": Picture(("excite panda --out OUT --force",), "", 0.55),
    "recording-servo": Picture(SERVO),
    "recording-study": Picture(("study encoder --out OUT",), "study"),
}

REPORTS = ("excite", "study")
"""Commands whose report is a picture, too."""

PAGES = {
    "report": (
        "new example demo",
        "identify demo/log.csv --robot demo/arm.xml --torque held --torque-delay estimate --validate demo/second.csv "
        "--no-rerun --out OUT",
    ),
}
"""Pages that are photographed, and the commands that write them."""


CHARTS = {
    "conclusion": "conclusion_tables.picture",
    "benchmark": "benchmark_tables.picture",
    "estimators": "estimator_tables.picture",
    "faults": "fault_tables.picture",
    "smallest": "answers_tables.draw_smallest",
    "moves": "answers_tables.draw_moves",
    "table1-motions": "answers_tables.draw_motions",
}
"""Pictures that are drawn from the figures in docs/results, and what draws them in docs/build."""

REAL = {
    "real-log": ("log train.csv --write --force --picture real-log.png",),
    "real-report": (
        "identify train.csv --robot ur10e.urdf --resample --add offset --torque-delay estimate --validate ptp.csv --no-rerun "
        "--out real-report",
    ),
    "friction": (
        "identify train.csv --robot ur10e.urdf --resample --friction auto --torque-delay estimate --validate ptp.csv "
        "--no-rerun --out friction",
    ),
}
"""Pictures of the log of docs/real-robots.md, which is not ours: made from a folder with the files of that page."""

SECTIONS = {"friction": "friction"}
"""Sections of a page, below its title, that are photographed in the place of its beginning."""


def real(names: list[str], logs: Path) -> None:
    """Run what the page of the real robot runs, in a copy of the folder of its files, and photograph it."""
    for name in names:
        later = ["log.toml"] if name == "real-log" else []  # the page writes it afterwards
        unread = shutil.ignore_patterns("*.png", *later)
        with tempfile.TemporaryDirectory(prefix="idbench-") as folder, chdir(folder):
            shutil.copytree(logs, folder, ignore=unread, dirs_exist_ok=True)
            for command in REAL[name]:
                if idbench(command.split()):
                    sys.exit(f"{command} failed")
            if "--picture" in REAL[name][-1]:
                shutil.copy(f"{name}.png", DOCS / f"{name}.png")
            else:
                page = Path(name) / "report.html"
                photograph(_section(page, SECTIONS[name]) if name in SECTIONS else page, DOCS / f"{name}.png")


def _section(page: Path, name: str) -> Path:
    """Write title and one section of a page as a page of its own."""
    text, found = page.read_text(), page.with_name(f"{name}.html")
    begin = text.index(f'<h2 id="{name}">')
    found.write_text(text[: text.index("</h1>")] + "</h1>" + text[begin : text.index("<h2", begin + 1)])
    return found


def charts(names: list[str]) -> None:
    """Draw pictures from kept figures."""
    sys.path.insert(0, str(DOCS / "build"))
    for name in names:
        module, function = CHARTS[name].split(".")
        getattr(import_module(module), function)(DOCS / f"{name}.png")
        print(f"{name}: drawn from docs/results")


def pages(names: list[str]) -> None:
    """Run what writes a page, and photograph it."""
    for name in names:
        with tempfile.TemporaryDirectory(prefix="idbench-") as folder, chdir(folder):
            for command in PAGES[name]:
                if idbench(command.replace("OUT", name).split()):
                    sys.exit(f"{command} failed")
            photograph(Path(name) / "report.html", DOCS / f"{name}.png")


def make(names: list[str]) -> None:
    """Run what is to be seen, each once, and take the pictures."""
    with tempfile.TemporaryDirectory(prefix="idbench-") as folder, chdir(folder):
        done: dict[tuple[str, ...], Path] = {}
        for name in names:
            picture = PICTURES[name]
            if picture.commands not in done:
                out = done[picture.commands] = Path("runs") / called(name, picture)
                for command in picture.commands:
                    if idbench(command.replace("OUT", str(out)).split()):
                        sys.exit(f"{command} failed")
            with viewer(Path(folder)) as client:  # one a picture: a viewer keeps the layout that it opens first
                take(client, done[picture.commands], picture, DOCS / name)
            page = DOCS / f"{picture.commands[-1].split()[0]}.png"
            if (report := done[picture.commands] / "report.html").is_file() and page.stem in REPORTS:
                photograph(report, page)


def called(name: str, picture: Picture) -> str:
    """Return what the folder of a picture is called: as the command would by itself, since what is shown names it."""
    command, first = picture.commands[0].split()[:2]
    if len({line.split()[1] for line in picture.commands if "OUT/" in line}) > 1:
        return name
    return command if first.startswith("--") else first


def take(client, out: Path, picture: Picture, path: Path) -> None:  # type: ignore[no-untyped-def]
    """Open a recording and write what is seen, once it has stopped changing."""
    one = out / f"{path.name}.rrd"
    folders = [str(out)] if (out / "summary.json").is_file() else sorted(str(run) for run in out.iterdir() if run.is_dir())
    if idbench(["view", *folders, "--tab", picture.tab, "--save", str(one)]):
        sys.exit(f"{one} cannot be written")
    client.open([str(one.absolute())])
    while (state := client.get_state()).loading or not state.recordings:
        time.sleep(0.2)
    (shown,) = state.recordings
    client.set_location(shown.location)
    span = next(((line.start, line.end) for line in shown.timelines if line.name == "sim_time"), None)  # a study has none
    if isinstance(picture, Movie):
        assert span is not None
        shares = np.linspace(picture.at, picture.until, picture.frames)
        frames = [_still(client, span, share, 15 if share == picture.at else 1) for share in shares]
        small = [frame.resize((1120, round(1120 * frame.height / frame.width))) for frame in frames]
        small[0].save(path.with_suffix(".webp"), save_all=True, append_images=small[1:], duration=120, loop=0, quality=60)
    else:
        image = _still(client, span, picture.at, 15)
        image.quantize(256, kmeans=1).save(path.with_suffix(".png"), optimize=True)
    complaints = [f"{view.name}: {report.summary}" for view in client.get_state().views for report in view.reports]
    print(f"{path.name}: {', '.join(complaints) or 'no complaints'}")


def _still(client, span: tuple[int, int] | None, share: float, patience: float) -> Image.Image:  # type: ignore[no-untyped-def]
    """Return what is seen at a share of the time, once it rests: axes fit themselves over some frames, and notices fade."""
    if span:
        now = np.timedelta64(span[0] + int(share * (span[1] - span[0])), "ns")
        client.set_time("sim_time", duration=now, play_state="paused")
    start, last, image = time.monotonic(), b"", client.take_screenshot(max_size=1600)
    while time.monotonic() - start < patience and (image != last or time.monotonic() - start < patience / 4):
        time.sleep(min(0.5, patience / 4))
        last, image = image, client.take_screenshot(max_size=1600)
    return _cropped(Image.open(BytesIO(image)).convert("RGB"))


def _cropped(image: Image.Image) -> Image.Image:
    """Return a picture without the viewer's own bar, which speaks of the machine."""
    return image.crop((0, round(BAR * image.height), image.width, image.height))


def photograph(page: Path, path: Path) -> None:
    """Write the first screen of an HTML page, if there is a browser that can (Debian's chromium)."""
    if not (browser := shutil.which("chromium")):
        print(f"{path.name}: there is no chromium, the old one stays")
        return
    words = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--window-size=1200,900",
        "--hide-scrollbars",
        f"--screenshot={path}",
        page.absolute().as_uri(),
    ]
    subprocess.run([browser, *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    Image.open(path).convert("RGB").quantize(256, kmeans=1).save(path, optimize=True)
    print(f"{path.name}: the first screen of {page.name}")


@contextmanager
def viewer(folder: Path) -> Iterator[object]:
    """Give a viewer without a window."""
    import rerun_cli
    from rerun.experimental import ViewerClient

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [Path(rerun_cli.__file__).parent / "rerun", "--headless", "--bind", "127.0.0.1", "--port", f"{port}"]
    quiet, environment = subprocess.DEVNULL, os.environ | {"WGPU_BACKEND": "vulkan", "XDG_RUNTIME_DIR": str(folder)}
    options = ["--window-size", "1600x900", "--hide-welcome-screen"]
    process = subprocess.Popen([*command, *options], stdout=quiet, stderr=quiet, env=environment)
    try:
        for _ in range(200):
            time.sleep(0.2)
            try:
                client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
                client.get_state()
            except Exception:  # whatever it is that is not ready yet
                continue
            yield client
            return
        sys.exit("the viewer does not start: is there a Vulkan driver, such as mesa-vulkan-drivers?")
    finally:
        process.terminate()
        process.wait(10)


if __name__ == "__main__":
    parser = ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--logs", type=Path)
    asked = parser.parse_args()
    every = (*CHARTS, *PAGES, *PICTURES, *REAL)
    wanted = asked.names or list(every[: len(every) - (0 if asked.logs else len(REAL))])
    if unknown := [name for name in wanted if name not in every]:
        sys.exit(f"no picture {unknown[0]!r}; known: {', '.join(every)}")
    if not asked.logs and (without := [name for name in wanted if name in REAL]):
        sys.exit(f"{without[0]} needs --logs FOLDER, with train.csv, ptp.csv, log.toml and ur10e.urdf of docs/real-robots.md")
    real([name for name in wanted if name in REAL], asked.logs and asked.logs.absolute())
    charts([name for name in wanted if name in CHARTS])
    pages([name for name in wanted if name in PAGES])
    make([name for name in wanted if name in PICTURES])
