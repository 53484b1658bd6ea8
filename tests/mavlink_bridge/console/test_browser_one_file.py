"""Pages in one file in a real browser, opened from the disk: a plan's, a check's, a log's; no server, no request, no console error."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pytest
from console.browser_kit import FIELDS, WAIT_MS, Watched, need_browser
from PIL import Image
from typer.testing import CliRunner

need_browser()

from playwright.sync_api import BrowserContext, expect  # noqa: E402 - only where there is a browser

from mavlink_bridge.cli.app import app  # noqa: E402 - as above

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.timeout(240, func_only=True)  # waiting for the browser is not counted

expect.set_options(timeout=WAIT_MS)
YARD = ("--fence", FIELDS / "yard-fence.waypoints")
PLAN = (
    "plan",
    "--fence",
    FIELDS / "maze-fence.waypoints",
    "--start",
    "40.071374,-105.22993",
    "--target",
    "40.0726316,-105.2290497",
)
CHECK = ("check", "--mission", FIELDS / "yard-mission.waypoints", *YARD)
LOG = ("log", FIELDS.parents[1] / "sitl_logs" / "mission-yard.tlog")


class Still(Watched):
    """A page from the disk: it may read its own file and what is in it, and nothing else."""

    def __init__(self, context: BrowserContext, file: Path, scheme: str = "light") -> None:
        self.scheme = scheme
        super().__init__(context, file.as_uri())

    def _see(self, request) -> None:
        if request.url != self.url and urlsplit(request.url).scheme not in ("blob", "data"):
            self.troubles.append(f"request: {request.url}")


@pytest.fixture(params=[(1280, 800, "light"), (360, 740, "dark")], ids=["desktop", "phone"])
def opened(request, browser, tmp_path):
    width, height, scheme = request.param
    contexts = []

    def draw(*words) -> Still:
        file = tmp_path / "x.html"
        result = CliRunner().invoke(app, [*map(str, words), "--plot", str(file)])
        assert file.is_file(), result.output
        context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
        contexts.append(context)
        seen = Still(context, file, scheme)
        seen.open()
        contexts.append(seen)
        assert seen.page.evaluate("document.documentElement.scrollWidth") <= width
        return seen

    yield draw
    for one in contexts:
        if isinstance(one, Still):
            assert one.accessible() == []
            assert one.troubles == []
            assert one.page.get_by_role("button", name="HOLD").count() == 0
            assert one.page.locator("input[type=file], textarea, input[type=text]").count() == 0
    for one in contexts:
        if isinstance(one, BrowserContext):
            one.close()


COLOURS = {
    "light": {
        "route": "005ea8",
        "fence": "8a5a00",
        "exclusion": "7a1f1f",
        "broken": "b3001b",
        "rover": "0b57d0",
    },
    "dark": {
        "route": "62b5ff",
        "fence": "f0b440",
        "exclusion": "ff9a8f",
        "broken": "ff7b72",
        "rover": "8ec5ff",
    },
}


def pixels(seen: Still) -> dict[str, int]:
    """Return how many pixels of the map have the colour of what is to be seen there, once it is drawn: on a busy computer that takes its time."""
    counted: list[dict[str, int]] = []
    while len(counted) < 60 and not (
        len(counted) > 1 and counted[-1] == counted[-2] and any(counted[-1].values())
    ):
        seen.page.wait_for_timeout(300)  # the last labels
        picture = Image.open(BytesIO(seen.page.locator(".map").screenshot())).convert("RGB")
        counts = {f"{r:02x}{g:02x}{b:02x}": count for count, (r, g, b) in picture.getcolors(1 << 24)}
        counted.append({name: counts.get(colour, 0) for name, colour in COLOURS[seen.scheme].items()})
    return counted[-1]


def test_a_plan(opened):
    seen = opened(*PLAN, "--clearance", "2.5")
    page = seen.page
    expect(page).to_have_title("218.2 m, about 114 s – PBPP Rover")
    expect(page.locator(".headline")).to_have_text("✓ 2.50 m promised")
    expect(page.locator("table.legs tbody tr")).to_have_count(5)
    expect(page.get_by_text("A page in one file: nothing on it is live.")).to_be_visible()
    assert [one.inner_text() for one in page.get_by_role("tab").all()] == ["Plan", "Fence"]
    seen_there = pixels(seen)
    assert min(seen_there[name] for name in ("route", "fence", "exclusion")) > 150, seen_there
    assert seen_there["broken"] < 20
    page.locator("table.legs tbody tr").nth(1).hover()
    expect(page.locator("tr.hovered")).to_have_count(1)
    page.get_by_role("tab", name="Fence").click()
    expect(page.get_by_text("exclusion circle 1", exact=False).first).to_be_visible()
    page.locator(".map").click(position={"x": 150, "y": 200})
    page.keyboard.press("t")
    page.get_by_role("tab", name="Plan").click()
    expect(page.locator("table.legs tbody tr")).to_have_count(5)  # no target was set


def test_a_check(opened):
    seen = opened(*CHECK)
    expect(seen.page.locator(".headline")).to_have_text("✗ 1 leg does not keep the clearance")
    seen_there = pixels(seen)
    assert min(seen_there[name] for name in ("broken", "fence", "exclusion")) > 150, seen_there


def test_a_log_is_played_from_the_file(opened):
    seen = opened(*LOG)
    page = seen.page
    expect(page.get_by_text("Breach 1: left the fence at 55.5 s", exact=False)).to_be_visible()
    seen_there = pixels(seen)
    assert min(seen_there[name] for name in ("rover", "fence", "route")) > 100, seen_there
    expect(page.locator(".chip-mode .chip-value")).to_have_text("HOLD")
    scrub = page.get_by_label("Moment of the log")
    scrub.press("Home")
    expect(page.locator(".chip-mode .chip-value")).to_have_text("–")
    page.get_by_label("Speed of the replay").or_(page.locator(".timeline select")).first.select_option("60")
    page.get_by_role("button", name="Play").click()
    expect(page.locator(".chip-mode .chip-value")).to_have_text("HOLD")
    page.get_by_role("tab", name="Events").click()
    assert page.locator(".event").count() > 3


def test_without_webgl_the_tables_are_there(browser, tmp_path):
    file = tmp_path / "x.html"
    CliRunner().invoke(app, [*map(str, PLAN), "--plot", str(file)])
    context = browser.new_context()
    context.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    seen = Still(context, file)
    seen.page.goto(seen.url)
    expect(seen.page.get_by_text("This browser has no WebGL", exact=False)).to_be_visible()
    expect(seen.page.locator("table.legs tbody tr")).to_have_count(5)
    assert seen.troubles == []
    context.close()
