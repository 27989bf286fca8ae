"""The site in a browser: recordings open in its pages. Chromium runs without a window, and with a rasterizer in software."""

import asyncio
import functools
import http.server
import json
import shutil
import socket
import subprocess
import sys
import threading
import time
import urllib.request

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chromium-browser")
PATIENCE = 180.0
"""Time that a viewer may take to start on a busy machine [s]."""

pytestmark = [pytest.mark.thorough, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")]


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="module")
def page(root, tmp_path_factory):
    """The address of a page with a short recording, beside rerun's viewer, as the site has them."""
    folder = tmp_path_factory.mktemp("site")
    viewer = pytest.importorskip("rerun_notebook").STATIC_DIR
    for place in ("assets", "viewer", "recordings"):
        (folder / place).mkdir()
    shutil.copy(root / "docs" / "assets" / "recording.js", folder / "assets")
    for name in ("widget.js", "re_viewer_bg.wasm"):
        (folder / "viewer" / name).symlink_to(viewer / name)
    code = "from idbench.experiments.cli import entry; entry()"
    for words in (["run", "ideal", "--out", "run"], ["view", "run", "--save", "recordings/short.rrd"]):
        subprocess.run([sys.executable, "-c", code, *words], cwd=folder, check=True, capture_output=True)
    recording = '<div id="short" data-recording="recordings/short.rrd"><p><img alt="a picture"></p></div>'
    (folder / "page.html").write_text(f'<!doctype html>{recording}<script src="assets/recording.js"></script>')
    handler = functools.partial(QuietHandler, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}/page.html#short"
        server.shutdown()


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    """Serves files without a word."""

    def log_message(self, *_):
        pass


async def state_of(port, address):
    """Return what the page says of its viewer, once that is ready or has failed."""
    from tornado.websocket import websocket_connect

    with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
        tab = next(tab for tab in json.load(answer) if tab["type"] == "page")
    browser = await websocket_connect(tab["webSocketDebuggerUrl"], max_message_size=2**26)

    async def call(number, method, **params):
        await browser.write_message(json.dumps({"id": number, "method": method, "params": params}))
        while (found := json.loads(await browser.read_message())).get("id") != number:
            pass
        return found["result"]

    end, number = time.monotonic() + PATIENCE, 2
    expression = "document.querySelector('[data-recording]')?.dataset.state ?? ''"
    try:
        await call(1, "Page.navigate", url=address)
        while time.monotonic() < end:
            state = (await call(number, "Runtime.evaluate", expression=expression))["result"].get("value")
            if state:
                return state
            number += 1
            await asyncio.sleep(0.5)
        return "late"
    finally:
        browser.close()  # or it warns when it is collected, in the middle of another test


def test_a_recording_opens_in_the_page(page, tmp_path):
    pytest.importorskip("tornado")
    port = free_port()
    options = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run"]
    command = [CHROMIUM, *options, f"--remote-debugging-port={port}", f"--user-data-dir={tmp_path}", "about:blank"]
    browser = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for _ in range(100):
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/json").close()
                break
            except OSError:
                time.sleep(0.2)
        assert asyncio.run(state_of(port, page)) == "ready"
    finally:
        browser.terminate()
        browser.wait(20)
