"""A browser for the console's tests: Chromium from PBPP_CHROMIUM or PATH, a server to look at, and what must hold on every page."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import expect

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser, BrowserContext, Page

AXE = Path(__file__).parent / "vendor" / "axe-core" / "axe.min.js"
FIELDS = Path(__file__).parents[2] / "fields"
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
# Software WebGL: the same drawing on every computer, and none needs a graphics card.
SWITCHES = ["--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--ignore-gpu-blocklist"]
WAIT_MS = 60_000  # far longer than anything takes on a computer that does nothing else


def find_chromium() -> str | None:
    """Return the browser to test with."""
    named = os.environ.get("PBPP_CHROMIUM")
    if named:
        return named
    return next((path for path in map(shutil.which, NAMES) if path), None)


def launched(playwright: Any) -> Browser:
    """Start the browser; as root it must do without its sandbox."""
    is_root = hasattr(os, "geteuid") and os.geteuid() == 0
    switches = [*SWITCHES, *(["--no-sandbox"] if is_root else [])]
    return playwright.chromium.launch(executable_path=find_chromium(), args=switches)


@contextmanager
def serving(*options: str, port: int = 0, cwd: Path | None = None) -> Iterator[Served]:
    """Run ``pbpp serve`` until the block ends."""
    server = Served(options, port, cwd)
    try:
        yield server
    finally:
        server.stop()


class Served:
    """A running server: its address, and how to end it."""

    def __init__(self, options: tuple[str, ...], port: int, cwd: Path | None) -> None:
        listen = ["--listen", f"127.0.0.1:{port}"] if port else []
        words = [
            sys.executable,
            "-c",
            "from mavlink_bridge.cli import main; main()",
            "serve",
            *listen,
            *options,
        ]
        self.process = subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=cwd
        )
        self.lines: list[str] = []
        self.url = self._read_address()

    def _read_address(self) -> str:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line)
            found = re.search(r"https?://\S+", line)
            if found:
                return found.group()
        raise AssertionError(f"the server did not start: {''.join(self.lines)}")

    @property
    def port(self) -> int:
        """Where it listens."""
        port = urlsplit(self.url).port
        assert port is not None
        return port

    def stop(self) -> None:
        """End it, and wait until it is gone."""
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        if self.process.stdout is not None:
            self.process.stdout.close()


class Watched:
    """A page, and everything on it that must not be: console errors, and requests that leave this computer."""

    def __init__(self, context: BrowserContext, url: str, *, expected: str = r"(?!)") -> None:
        self.page: Page = context.new_page()
        self.url = url
        self.expected = re.compile(expected)
        self.troubles: list[str] = []
        self.scale: Any = None
        self.page.set_default_timeout(WAIT_MS)
        self.page.on("console", self._hear)
        self.page.on("pageerror", lambda error: self.troubles.append(f"error: {error}"))
        self.page.on("request", self._see)

    def _hear(self, message: Any) -> None:
        text = f"{message.type}: {message.text} {message.location.get('url', '')}"
        if (
            message.type in ("error", "warning")
            and not self._is_the_drivers(text)
            and not self.expected.search(text)
        ):
            self.troubles.append(text)

    @staticmethod
    def _is_the_drivers(text: str) -> bool:
        """What Chromium says of software WebGL, whatever the page does."""
        return "GPU stall due to ReadPixels" in text or "GL Driver Message" in text

    def _see(self, request: Any) -> None:
        if urlsplit(request.url).hostname not in ("127.0.0.1", None):
            self.troubles.append(f"request: {request.url}")

    def open(self, url: str | None = None) -> Page:
        """Go there, and wait for the map."""
        self.page.goto(url or self.url)
        self.page.wait_for_selector('.map-area[data-ready="yes"]')
        return self.page

    def click_map(self, east: float, north: float) -> None:
        """Click the map at shares of its width and height, from its lower left corner."""
        x, y = self.place(east, north)
        self.page.mouse.click(x, y)

    def place(self, east: float, north: float) -> tuple[float, float]:
        """Return where on the screen that is."""
        box = self.page.locator(".map").bounding_box()
        assert box is not None
        return box["x"] + east * box["width"], box["y"] + (1 - north) * box["height"]

    def learn_scale(self) -> None:
        """Draw a polygon and read where it is: from then on `shares` knows where a place is. Leaves nothing behind.

        A target would not do: its profile takes some of the map's height, and the map shows all anew.
        """
        corners = ((0.3, 0.3), (0.7, 0.7), (0.3, 0.7))
        self.page.get_by_role("tab", name="Fence").click()
        expect(self.page.locator("ul.zones li").first).to_be_visible()  # only then the map shows the fence
        self.page.get_by_role("button", name="Draw a polygon").click()
        for corner in corners:
            self.click_map(*corner)
        self.page.keyboard.press("Enter")
        places = []
        for n in (1, 2):
            typed = self.page.get_by_role("textbox", name=f"Corner {n}: latitude, longitude").input_value()
            lat_deg, lon_deg = map(float, typed.split(","))
            places.append((lon_deg, lat_deg))
        self.page.get_by_role("button", name="Back to the vehicle's fence").click()
        self.scale = (corners[0], places[0], [(places[1][i] - places[0][i]) / 0.4 for i in (0, 1)])

    def shares(self, lon_deg: float, lat_deg: float) -> tuple[float, float]:
        """Return where on the map a place is, as shares of its width and height."""
        corner, at, whole = self.scale
        return corner[0] + (lon_deg - at[0]) / whole[0], corner[1] + (lat_deg - at[1]) / whole[1]

    def accessible(self) -> list[str]:
        """Return what axe-core finds: rule and place."""
        self.page.evaluate(AXE.read_text(encoding="utf-8") + "; undefined")
        found = self.page.evaluate(
            "axe.run(document, {resultTypes: ['violations']}).then(r => r.violations.flatMap("
            "v => v.nodes.map(n => `${v.id}: ${n.target.join(' ')}: ${n.failureSummary}`)))"
        )
        return list(found)


def need_browser() -> None:
    """Skip the module in one line where there is no browser; in CI there must be one."""
    if find_chromium() is None:
        if os.environ.get("CI") == "true":
            pytest.fail("no Chromium: set PBPP_CHROMIUM, or put one on PATH", pytrace=False)
        pytest.skip(
            "no Chromium on PATH and no PBPP_CHROMIUM: the page is not tested", allow_module_level=True
        )
