"""A headless Chromium, driven over its DevTools protocol: real clicks and keys, and every request it makes."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--remote-debugging-port=0",
)
PATIENCE = 30.0  # [s]


class Browser:
    """One page in a browser of its own, with a profile in `folder`; close it, or use it in a with statement."""

    def __init__(self, folder: Path, *, width: int = 1280, height: int = 900, dark: bool = False) -> None:
        assert PROGRAM is not None
        profile = folder / "profile"
        command = [PROGRAM, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with ExitStack() as started:  # which ends the browser again when what follows fails
            started.callback(self._end)
            address = _address(profile / "DevToolsActivePort")
            self._socket = started.enter_context(connect(address, max_size=None, proxy=None))
            self._attach(width, height, dark)
            self._stack = started.pop_all()

    def _attach(self, width: int, height: int, dark: bool) -> None:
        self._count = 0
        self._session: str | None = None
        self.events: list[dict[str, Any]] = []
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.send(f"{domain}.enable")
        self.size(width, height)
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self.send("Emulation.setEmulatedMedia", features=scheme)

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(WebSocketException):  # it may be gone before it answers
            self._session = None
            self.send("Browser.close")
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(5)
        self._stack.close()

    def _end(self) -> None:
        self._process.terminate()
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and return its result; events meanwhile go to `events`."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        self._socket.send(json.dumps(message | ({"sessionId": self._session} if self._session else {})))
        while True:
            answer = json.loads(self._socket.recv(timeout=PATIENCE))
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return answer["result"]
            self.events.append(answer)

    def size(self, width: int, height: int) -> None:
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def open(self, page: Path) -> float:
        """Open a file and return how long it took until it was loaded and first drawn [s]."""
        self.send("Page.navigate", url=page.as_uri())
        self.until("document.readyState === 'complete' && location.protocol === 'file:'")
        drawn = "new Promise((done) => requestAnimationFrame(() => setTimeout(() => done(performance.now()))))"
        return float(self.evaluate(drawn)) / 1000

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, awaited."""
        result = self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def until(self, expression: str) -> None:
        """Wait until a JavaScript expression is true."""
        end = time.monotonic() + PATIENCE
        while not self.evaluate(expression):
            assert time.monotonic() < end, f"never true: {expression}"
            time.sleep(0.02)

    def box(self, selector: str) -> tuple[float, float, float, float]:
        """Return left, top, width and height of an element in the window [pixels]."""
        element = f"document.querySelector({json.dumps(selector)}).getBoundingClientRect()"
        return tuple(self.evaluate(f"(({{left, top, width, height}}) => [left, top, width, height])({element})"))

    def click(self, selector: str, *, across: float = 0.5) -> None:
        """Click with the mouse, `across` of an element's width from its left edge."""
        self.drag(selector, across, across)

    def drag(self, selector: str, start: float, end: float) -> None:
        """Press, move and release the mouse over an element, scrolled into view."""
        self.evaluate(f"document.querySelector({json.dumps(selector)}).scrollIntoView({{block: 'nearest'}})")
        left, top, width, height = self.box(selector)
        common = {"button": "left", "clickCount": 1, "y": top + height / 2}
        x, to = left + start * width, left + end * width
        self.send("Input.dispatchMouseEvent", type="mousePressed", x=x, **common)
        if to != x:
            self.send("Input.dispatchMouseEvent", type="mouseMoved", x=to, buttons=1, **common)
        self.send("Input.dispatchMouseEvent", type="mouseReleased", x=to, **common)

    def press(self, key: str, *, code: int = 0, shift: bool = False) -> None:
        """Press and release a key; `code` is its virtual key code."""
        common = {"key": key, "windowsVirtualKeyCode": code, "modifiers": 8 if shift else 0}
        text = {"text": key} if len(key) == 1 else {}
        self.send("Input.dispatchKeyEvent", type="keyDown", **common, **text)
        self.send("Input.dispatchKeyEvent", type="keyUp", **common)

    def screenshot(self, path: Path, *, whole: bool = False) -> None:
        """Save what is seen, or the whole page, as PNG."""
        data = self.send("Page.captureScreenshot", format="png", captureBeyondViewport=whole)["data"]
        path.write_bytes(base64.b64decode(data))

    def requests(self) -> list[str]:
        """Return the addresses asked for since the start, but for the empty page's."""
        self.evaluate("0")  # takes in what is under way
        sent = [e["params"]["request"]["url"] for e in self.events if e["method"] == "Network.requestWillBeSent"]
        return [url for url in sent if url != "about:blank"]

    def complaints(self) -> list[dict[str, Any]]:
        """Return the console's messages, log entries and uncaught exceptions since the start."""
        self.evaluate("0")
        kinds = {"Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"}
        return [event for event in self.events if event["method"] in kinds]


def _address(file: Path) -> str:
    """Return the address of the protocol's socket as the browser writes it into its profile."""
    end = time.monotonic() + PATIENCE
    while True:
        with suppress(FileNotFoundError, ValueError):
            port, path = file.read_text().split()
            return f"ws://127.0.0.1:{port}{path}"
        assert time.monotonic() < end, "the browser does not start"
        time.sleep(0.05)
