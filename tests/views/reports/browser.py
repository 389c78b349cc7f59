"""A headless Chromium, driven through a pipe by its DevTools protocol: the tests need no driver and no socket."""

import base64
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

MISSING = "chromium is missing, with which this test opens the page; install it: apt-get install chromium"


class Browser:
    """A page of a browser; `events` collects what it has reported."""

    def __init__(self, reads: int, writes: int) -> None:
        self.reads = reads
        self.writes = writes
        self.rest = b""
        self.count = 0
        self.events: list[dict[str, Any]] = []
        self.session = ""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self.rest:
            if not (block := os.read(self.reads, 1 << 16)):
                raise AssertionError("the browser has ended")
            self.rest += block
        message, _, self.rest = self.rest.partition(b"\0")
        found: dict[str, Any] = json.loads(message)
        return found

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        self.count += 1
        message = {"id": self.count, "method": method, "params": parameters}
        message |= {"sessionId": self.session} if self.session else {}
        os.write(self.writes, json.dumps(message).encode() + b"\0")
        while (answer := self._receive()).get("id") != self.count:
            self.events.append(answer)
        assert "error" not in answer, answer
        result: dict[str, Any] = answer["result"]
        return result

    def open(self, page: Path, width: int, height: int = 900) -> None:
        """Load a page in a window of this width (pixels), to the end."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )
        self.events.clear()
        self.call("Page.navigate", url=page.resolve().as_uri())
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self._receive())

    def run(self, expression: str) -> Any:
        """The value of an expression of JavaScript in the page."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def press(self, key: str) -> None:
        """Press a key and let it go."""
        code = {"Tab": 9, "ArrowRight": 39, "ArrowUp": 38, "End": 35}[key]
        for kind in ("rawKeyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def complaints(self) -> list[Any]:
        """What stands on the console beside notes, and requests that are not for files or for data in them."""
        wrong = []
        for event in self.events:
            method = event.get("method")
            given = event.get("params", {})
            told = method == "Runtime.consoleAPICalled" and given["type"] != "log"
            if told or method in ("Runtime.exceptionThrown", "Log.entryAdded"):
                wrong.append(given)
            elif method == "Network.requestWillBeSent" and given["request"]["url"].split(":")[0] not in (
                "file",
                "data",
            ):
                wrong.append(given["request"]["url"])
        return wrong

    def paper(self) -> bytes:
        """The page printed on A4, as a PDF."""
        size = {"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": True}
        return base64.b64decode(self.call("Page.printToPDF", printBackground=True, **size)["data"])

    def picture(self, path: Path) -> None:
        """A picture of the whole page."""
        found = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(found["data"]))


@contextmanager
def browser() -> Iterator[Browser]:
    """A browser of its own; fails where there is none."""
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert program, MISSING
    their_reads, our_writes = os.pipe()
    our_reads, their_writes = os.pipe()
    with TemporaryDirectory() as profile:
        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"]
        shell = f'exec "$@" 3<&{their_reads} 4>&{their_writes}'
        command = [
            "bash",
            "-c",
            shell,
            "bash",
            program,
            *flags,
            "--remote-debugging-pipe",
            f"--user-data-dir={profile}",
        ]
        process = subprocess.Popen(
            command, pass_fds=(their_reads, their_writes), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(their_reads)
        os.close(their_writes)
        try:
            yield Browser(our_reads, our_writes)
        finally:
            process.terminate()
            process.wait()
            os.close(our_reads)
            os.close(our_writes)
