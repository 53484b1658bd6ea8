"""Take the pictures of the console that the documentation shows, in a real browser: ``make screens`` (about a minute)."""

from __future__ import annotations

import re
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image
from playwright.sync_api import expect, sync_playwright

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "tests" / "mavlink_bridge"))

from console.browser_kit import FIELDS, Watched, launched, serving  # noqa: E402 - from the tests' folder
from console.tiny_map import write_map  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser, Page

FENCE = str(FIELDS / "maze-fence.waypoints")
START = "40.0712247,-105.2302031"
MIDDLE = (-105.2294, 40.0719)
DESKTOP = {"width": 1280, "height": 800}
PHONE = {
    "viewport": {"width": 390, "height": 844},
    "is_mobile": True,
    "has_touch": True,
    "device_scale_factor": 1,
}
WAIT_MS = 60_000


@contextmanager
def page_of(browser: Browser, url: str, **look: object) -> Iterator[Watched]:
    """Open a page; it must be as free of trouble as in the tests."""
    context = browser.new_context(**{"viewport": DESKTOP, **look})
    seen = Watched(context, url)
    seen.open()
    yield seen
    assert seen.troubles == [], seen.troubles
    context.close()


def shoot(page: Page, name: str) -> None:
    """Save what is seen, with few colours: a third of the bytes."""
    page.mouse.move(2, 2)
    page.evaluate(
        "document.activeElement.blur(); document.querySelectorAll('.part').forEach((part) => part.scrollTo(0, 0))"
    )
    page.wait_for_timeout(1500)
    path = HERE / f"{name}.png"
    page.screenshot(path=path)
    Image.open(path).convert("RGB").quantize(160, dither=Image.Dither.NONE).save(path, optimize=True)


def set_target(page: Page, place: str) -> None:
    """Type a target and wait for what comes of it."""
    field = page.get_by_label("New target: latitude, longitude")
    field.fill(place)
    field.press("Enter")
    expect(page.locator(".headline")).to_be_visible()


def plans(browser: Browser, tiles: Path) -> None:
    """Without a vehicle: a plan, why there is none, a waypoint moved by hand, a phone, and a map."""
    with serving("--fence", FENCE, "--start", START) as server:
        with page_of(browser, server.url) as seen:
            set_target(seen.page, "40.071248, -105.229073")
            number = seen.page.get_by_role("spinbutton", name="Clearance to keep while driving, metres")
            number.fill("8")
            number.press("Tab")
            expect(seen.page.locator(".headline")).to_have_text("✗ No route")
            shoot(seen.page, "console-no-route")
        with page_of(browser, server.url) as seen:
            set_target(seen.page, "40.0723079, -105.2285800")
            seen.page.get_by_role("button", name="Waypoint 1.").focus()
            for _ in range(3):
                seen.page.keyboard.press("Shift+ArrowDown")
            expect(seen.page.locator(".headline")).to_contain_text("keep the clearance")
            shoot(seen.page, "console-check")
    with (
        serving("--fence", FENCE, "--start", START, "--map", str(tiles)) as server,
        page_of(browser, server.url) as seen,
    ):
        set_target(seen.page, "40.0723079, -105.2285800")
        shoot(seen.page, "console-map")


def drives(browser: Browser) -> None:
    """With the demonstration's rover: on a desk by day, by night, and on a phone."""
    with serving("--demo") as server, page_of(browser, server.url) as seen:
        page = seen.page
        page.get_by_role("button", name="Take control").click()
        set_target(page, "40.0726316, -105.2290497")
        shoot(page, "console-plan")
        night = Watched(browser.new_context(viewport=DESKTOP, color_scheme="dark"), server.url)
        small = Watched(browser.new_context(**PHONE), server.url)
        for seen_too in (night, small):  # before the drive: opening them takes a while
            seen_too.open()
            seen_too.page.get_by_role("tab", name="Drive").click()
        page.get_by_role("button", name="Upload, verified").click()
        start = page.get_by_role("button", name="Start: press and hold")
        expect(start).to_be_enabled(timeout=WAIT_MS)
        start.focus()
        page.keyboard.down("Enter")
        expect(page.locator(".chip-mode")).to_contain_text("AUTO", timeout=WAIT_MS)
        page.keyboard.up("Enter")
        progress = night.page.locator("#part-drive .facts dd").nth(1)
        expect(progress).to_have_text(
            re.compile(r"^([5-9]\d|1\d\d)\.\d of ")
        )  # under way, whatever the computer does beside
        for seen_too, name in ((night, "console-drive"), (small, "console-phone")):
            shoot(seen_too.page, name)
            assert seen_too.troubles == [], seen_too.troubles
            seen_too.page.context.close()


def replays(browser: Browser) -> None:
    """A log with its timeline."""
    log = str(ROOT / "sitl_logs" / "guided-maze.tlog")
    with serving("--log", log) as server, page_of(browser, server.url) as seen:
        seen.page.get_by_label("Moment of the log").focus()
        seen.page.keyboard.press("End")
        expect(seen.page.locator(".moment")).to_contain_text("1:11 min of 1:11 min")
        seen.page.get_by_role("tab", name="Events").click()
        shoot(seen.page, "console-replay")


def main() -> None:
    """Take all of them."""
    expect.set_options(timeout=WAIT_MS)
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        tiles = Path(folder) / "field.pmtiles"
        write_map(tiles, MIDDLE)
        browser = launched(playwright)
        plans(browser, tiles)
        drives(browser)
        replays(browser)
        browser.close()


if __name__ == "__main__":
    main()
