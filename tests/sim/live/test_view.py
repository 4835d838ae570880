"""The live view in a notebook: its output without a front end, and the widget in a running JupyterLab."""

import base64
import contextlib
import json
import math
import os
import shutil
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path as FilePath
from typing import Any

import pytest
from helpers import beside, until

from grader import KIT
from sim.live import Live

TEXTS = beside(__file__)


def test_the_output_is_a_picture_of_the_current_state_and_a_text_that_never_changes(live: Live) -> None:
    before, _ = live._repr_mimebundle_()
    live.run(2.0)
    after, metadata = live._repr_mimebundle_()
    assert before.keys() == {"text/plain", "image/png"}
    assert base64.b64decode(after["image/png"]).startswith(b"\x89PNG")
    assert before["text/plain"] == after["text/plain"] == "Live view of 'room'"
    assert metadata["image/png"]["alt"] == "room at 2.00 s"


@pytest.mark.slow  # a kernel and nbconvert
def test_a_notebook_without_a_front_end_runs_and_stores_a_picture_of_the_end(tmp_path: FilePath) -> None:
    """As nbconvert and nbval run it: no exception, no output, no widget in the stored notebook."""
    pytest.importorskip("nbval", reason="no nbval: pip install -e '.[dev]' to run notebooks")
    nbformat = pytest.importorskip("nbformat", reason="no nbformat: pip install -e '.[dev]' to run notebooks")
    sources = [
        "from sim import Simulator, load_world\nfrom sim.live import Live\n"
        "live = Live(Simulator(load_world('office')))",
        "live",
        "live.run(20.0)\nprint(live.simulator.time)",
        "live.stop()",
    ]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(s) for s in sources])
    nbformat.write(notebook, tmp_path / "live.ipynb")
    environment = {**os.environ, "PYTHONPATH": str(KIT), "IPYTHONDIR": str(tmp_path), "JUPYTER_NO_CONFIG": "1"}
    execute = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--inplace", "live.ipynb"]
    subprocess.run(execute, cwd=tmp_path, env=environment, capture_output=True, check=True, timeout=300)
    done = nbformat.read(tmp_path / "live.ipynb", as_version=4)
    assert [[o.output_type for o in cell.outputs] for cell in done.cells] == [[], ["display_data"], ["stream"], []]
    (shown,) = done.cells[1].outputs
    assert shown.data.keys() == {"image/png", "text/plain"}
    assert shown.metadata["image/png"]["alt"] == "office at 20.00 s"
    assert done.cells[2].outputs[0].text == "20.0\n"
    validate = [sys.executable, "-m", "pytest", "--nbval", "-q", "-p", "no:cacheprovider", "-c", os.devnull]
    judged = subprocess.run(
        [*validate, "live.ipynb"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
    )
    assert "4 passed" in judged.stdout, judged.stdout


# -------------------------------------------------------------------------------------------- in a running JupyterLab

BOUNDS = (-1.4, -2.4, 5.4, 2.4)  # the room and a margin of 0.4 m
PANEL = "[...(window.jupyterapp?.shell.widgets('main') ?? [])].find(w => w.sessionContext)"


class Page:
    """A page of a headless Chromium, through its debugging protocol (websocket-client comes with Jupyter)."""

    def __init__(self, port: int) -> None:
        import websocket

        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=10) as answer:
            pages = json.load(answer)
        target = next(p for p in pages if p["type"] == "page")
        self._socket = websocket.create_connection(target["webSocketDebuggerUrl"], timeout=60, suppress_origin=True)
        self._count = 0

    def close(self) -> None:
        self._socket.close()

    def call(self, method: str, **params: object) -> Any:
        self._count += 1
        self._socket.send(json.dumps({"id": self._count, "method": method, "params": params}))
        while True:
            answer = json.loads(self._socket.recv())
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return answer["result"]

    def ask(self, script: str) -> Any:
        """Return the value of an expression in the page; a promise is awaited."""
        got = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in got, got["exceptionDetails"]
        return got["result"].get("value")

    def wait(self, script: str, seconds: float = 240.0) -> Any:
        """Return the value of an expression as soon as it is true."""
        deadline = time.monotonic() + seconds
        while not (value := self.ask(script)):
            assert time.monotonic() < deadline, f"timed out waiting for {script}\n{self.ask('document.body.innerText')}"
            time.sleep(0.05)
        return value

    def view(self, key: str) -> Any:
        return self.ask(f"document.querySelector('.lv').dataset.{key}")

    def mouse(self, kind: str, x: float, y: float, down: bool = True) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=int(down), clickCount=1)

    def click(self, x: float, y: float) -> None:
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y, down=False)

    def press_button(self, name: str) -> None:
        x, y = self.ask(
            f"(() => {{ const b = [...document.querySelectorAll('.lv button')].find(b => b.textContent === '{name}')"
            ".getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2] })()"
        )
        self.click(x, y)

    def on_map(self, x: float, y: float, bounds: tuple[float, float, float, float]) -> tuple[float, float]:
        """Return the pixel of a position on the map (m); the map is centred and fills one direction."""
        box = self.ask("document.querySelector('.lv-map').getBoundingClientRect().toJSON()")
        x0, y0, x1, y1 = bounds
        scale = min(box["width"] / (x1 - x0), box["height"] / (y1 - y0))
        return (
            box["x"] + box["width"] / 2 + scale * (x - (x0 + x1) / 2),
            box["y"] + box["height"] / 2 - scale * (y - (y0 + y1) / 2),
        )

    def key(self, key: str) -> None:
        code = {" ": 32, "Enter": 13, "ArrowRight": 39, "ArrowUp": 38, "m": 77}[key]
        text = {"text": key} if len(key) == 1 else {"text": "\r"} if key == "Enter" else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code)

    def picture(self, path: FilePath) -> None:
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def kernel(self, code: str, wait: bool = True) -> str:
        """Run code in the notebook's kernel and return its output, which is also stored in `window.said`."""
        answer = self.ask(
            f"""(() => {{
              const kernel = ({PANEL}).sessionContext.session.kernel;
              const future = kernel.requestExecute({{code: {json.dumps(code)}, store_history: false}});
              let said = "";
              window.said = "";
              future.onIOPub = m => {{ said += m.content.text ?? m.content.evalue ?? ""; }};
              const done = future.done.then(() => window.said = said.trim());
              return {"done" if wait else "null"};
            }})()"""
        )
        return answer or ""


def written(folder: FilePath, pattern: str, end: str) -> FilePath:
    """Return the file as soon as it exists and contains `end`."""
    until(lambda: any(end in f.read_text() for f in folder.glob(pattern)), 300)
    return next(folder.glob(pattern))


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """Return a browser's page with the notebook open in a running JupyterLab, nothing executed yet."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no chromium: install it (apt install chromium) to test the live view in a browser")
    for module in ("jupyterlab", "anywidget", "websocket"):
        pytest.importorskip(module, reason=f"no {module}: pip install -e '.[notebooks]' to test the live view")
    folder = tmp_path_factory.mktemp("lab")
    cells = [
        {"cell_type": "code", "id": f"cell{i}", "source": s, "metadata": {}, "outputs": [], "execution_count": None}
        for i, s in enumerate((TEXTS["SETUP"].strip(), "live"))
    ]
    kernelspec = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {"cells": cells, "metadata": {"kernelspec": kernelspec}, "nbformat": 4, "nbformat_minor": 5}
    (folder / "live.ipynb").write_text(json.dumps(notebook))
    home = {key: str(folder / "home") for key in ("HOME", "IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR")}
    environment = {**os.environ, **home, "PYTHONPATH": str(KIT), "JUPYTER_RUNTIME_DIR": str(folder / "runtime")}
    server = [sys.executable, "-m", "jupyterlab", "--no-browser", "--ip=127.0.0.1", "--allow-root"]
    server += ["--IdentityProvider.token=", "--ServerApp.port=0", "--LabApp.expose_app_in_browser=True"]
    server.append(f"--ServerApp.root_dir={folder}")
    settings = folder / "home/lab/user-settings/@jupyterlab/apputils-extension/notification.jupyterlab-settings"
    settings.parent.mkdir(parents=True)
    settings.write_text('{"fetchNews": "false", "checkForUpdates": false}')
    chromium = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"]
    chromium += [f"--user-data-dir={folder / 'chromium'}", "--window-size=1100,1000", "--no-first-run", "about:blank"]
    with contextlib.ExitStack() as stack:
        for name, command in (("server", server), ("chromium", chromium)):
            log = stack.enter_context((folder / f"{name}.log").open("w"))
            process = subprocess.Popen(command, stdout=log, stderr=log, env=environment, cwd=folder)
            stack.callback(process.wait, 30)
            stack.callback(process.terminate)
        server_file = written(folder / "runtime", "jpserver-*.json", "}")
        port_file = written(folder / "chromium", "DevToolsActivePort", "/devtools/")
        url = json.loads(server_file.read_text())["url"]
        page = Page(int(port_file.read_text().split()[0]))
        stack.callback(page.close)
        page.call("Page.navigate", url=f"{url}lab/tree/live.ipynb")
        page.wait(f"({PANEL})?.sessionContext.session?.kernel?.status === 'idle'")
        page.ask(f"jupyterapp.shell.activateById(({PANEL}).id)")
        page.ask("jupyterapp.commands.execute('application:toggle-left-area')")
        yield page


@pytest.mark.slow  # JupyterLab in a browser
def test_in_jupyterlab_the_robot_drives_and_obeys(page: Page, tmp_path: FilePath) -> None:
    """One visit: driving, buttons, a click, a drag, the dark theme."""
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait("Number(document.querySelector('.lv')?.dataset.frames) > 5")
    page.ask("document.querySelector('.lv').scrollIntoView()")

    began = [float(page.view(k)) for k in ("time", "frames", "drawn")]
    page.wait(f"Number(document.querySelector('.lv').dataset.time) > {began[0]} + 5")
    ended = [float(page.view(k)) for k in ("time", "frames", "drawn")]
    simulated, frames, drawn = (b - a for a, b in zip(began, ended, strict=True))
    print(f"{frames / simulated:.1f} messages, {drawn / simulated:.1f} pictures per simulated second")
    assert frames / simulated >= 20
    page.picture(tmp_path / "running.png")

    page.press_button("Pause")
    page.wait("document.querySelector('.lv').dataset.status === 'paused'")
    stood = float(page.view("time"))
    page.press_button("Step")
    page.wait(f"Number(document.querySelector('.lv').dataset.time) > {stood}")
    assert float(page.view("time")) == pytest.approx(stood + 0.1)

    page.press_button("Reset")
    page.wait("Number(document.querySelector('.lv').dataset.time) === 0")
    assert page.view("pose") == "0 0 0"

    page.click(*page.on_map(1.0, 1.0, BOUNDS))
    page.wait("document.querySelector('.lv').dataset.goal !== ''")
    x, y = (float(v) for v in page.kernel("print(*goals[-1])").split())
    assert math.hypot(x - 1.0, y - 1.0) < 0.02
    page.press_button("Run")
    page.wait(
        "(() => { const [x, y] = document.querySelector('.lv').dataset.pose.split(' ');"
        " return Math.hypot(x - 1.0, y - 1.0) < 0.1 })()"
    )

    page.mouse("mousePressed", *page.on_map(2.1, 0.0, BOUNDS))
    for i in range(1, 11):
        page.mouse("mouseMoved", *page.on_map(2.1 + 0.1 * i, -0.1 * i, BOUNDS))
        time.sleep(0.03)
    page.picture(tmp_path / "dragging.png")
    page.mouse("mouseReleased", *page.on_map(3.1, -1.0, BOUNDS), down=False)
    where = "print(*next(p for o, p in live.simulator.obstacles if o.name == 'crate'))"
    until(lambda: [float(v) for v in page.kernel(where).split()] == pytest.approx([3.0, -1.0], abs=0.02))

    page.ask("jupyterapp.commands.execute('apputils:change-theme', {theme: 'JupyterLab Dark'})")
    page.wait("document.body.dataset.jpThemeLight === 'false'")
    time.sleep(0.5)
    page.picture(tmp_path / "dark.png")


@pytest.mark.slow  # JupyterLab in a browser
def test_in_jupyterlab_it_can_be_used_without_a_mouse(page: Page) -> None:
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait("document.querySelector('.lv')?.dataset.status === 'running'")
    page.ask("document.querySelector('.lv-map').focus()")
    page.key(" ")
    page.wait("document.querySelector('.lv').dataset.status === 'paused'")
    x, y, _ = (float(v) for v in page.view("pose").split())
    for key in ("ArrowRight", "ArrowRight", "ArrowUp", "Enter"):
        page.key(key)
    page.wait("document.querySelector('.lv').dataset.goal !== ''")
    assert [float(v) for v in page.view("goal").split()] == pytest.approx([x + 0.5, y + 0.25], abs=2e-3)
    assert page.ask("document.querySelectorAll('.jp-Cell').length") == 2  # no shortcut of the notebook was triggered
    unnamed = (
        "[...document.querySelectorAll('.lv button, .lv select, .lv canvas')].filter(e => !e.textContent.trim() && "
    )
    assert page.ask(unnamed + "!e.getAttribute('aria-label')).length") == 0


@pytest.mark.slow  # JupyterLab in a browser
def test_in_jupyterlab_it_runs_beside_a_busy_cell_and_ends_in_a_picture(page: Page) -> None:
    """A student's node may block the kernel; a cell run again replaces its view; stop leaves a picture."""
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait("document.querySelector('.lv')?.dataset.status === 'running'")
    page.kernel("older = live")
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    until(
        lambda: page.kernel("print(older.is_stopped, older._thread.is_alive(), live.is_running)") == "True False True"
    )
    assert page.ask("document.querySelectorAll('.lv').length") == 1

    before = int(page.view("frames"))
    page.kernel("while live.is_running: pass\nprint('paused')", wait=False)
    page.wait(f"Number(document.querySelector('.lv').dataset.frames) >= {before} + 40")
    page.press_button("Pause")
    page.wait("document.querySelector('.lv').dataset.status === 'paused'")
    assert page.wait("window.said") == "paused"

    page.kernel("live.stop()")
    page.wait("!document.querySelector('.lv') && document.images.length === 1")
    data = page.ask(f"Object.keys(({PANEL}).content.widgets[1].model.outputs.get(0).data).sort()")
    assert data == ["image/png", "text/plain"]
    assert page.kernel("import threading; print([t.name for t in threading.enumerate()].count('live view'))") == "0"


@pytest.mark.slow  # JupyterLab in a browser
def test_in_jupyterlab_a_view_whose_kernel_was_restarted_says_to_run_its_cell_again(page: Page) -> None:
    """It stood still as if it ran, and after a reload of the page it was "model not found"."""
    said = "document.querySelector('.lv-note')?.textContent.endsWith('run this cell again.')"
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait("document.querySelector('.lv')?.dataset.status === 'running'")
    page.ask(f"({PANEL}).context.save()")
    page.ask(f"({PANEL}).sessionContext.session.kernel.restart()")
    page.wait(said)
    page.ask("window.old = true")
    page.call("Page.reload")
    page.wait(f"!window.old && ({PANEL})?.sessionContext.session?.kernel?.status === 'idle'")
    page.ask(f"jupyterapp.shell.activateById(({PANEL}).id)")
    page.wait(said)


@pytest.mark.slow  # JupyterLab in a browser
def test_in_jupyterlab_closing_the_notebook_stops_the_robot(page: Page) -> None:
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait("document.querySelector('.lv')?.dataset.status === 'running'")
    page.ask(f"({PANEL}).context.save()")
    page.ask(f"window.kernel = ({PANEL}).sessionContext.session.kernel.clone(); ({PANEL}).close()")
    page.wait(f"!({PANEL})")
    assert not page.ask("[...document.querySelectorAll('.lv')].length")
    ask = """(async () => {
        const future = window.kernel.requestExecute({code: "print(live.is_running)"});
        let said = "";
        future.onIOPub = m => { said += m.content.text ?? ""; };
        await future.done;
        return said.trim() })()"""
    until(lambda: page.ask(ask) == "False", 60)
