"""The console's page in a real browser, without a vehicle: plan, no route, fence, files, phone, no WebGL, who needs what.

On every page there is no console error, no request leaves the computer, and axe-core finds nothing.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from console.browser_kit import FIELDS, WAIT_MS, Served, Watched, need_browser, serving
from console.tiny_map import write_map
from PIL import Image

need_browser()

from playwright.sync_api import Browser, Page, expect  # noqa: E402 - only where there is a browser

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = pytest.mark.timeout(240, func_only=True)  # waiting for the browser is not counted

expect.set_options(timeout=WAIT_MS)
START = "40.0712247,-105.2302031"
TARGET = "40.0723079, -105.2285800"


@pytest.fixture(scope="module")
def maze() -> Iterator[Served]:
    with serving("--fence", str(FIELDS / "maze-fence.waypoints"), "--start", START) as server:
        yield server


@pytest.fixture
def watched(browser: Browser, maze: Served) -> Iterator[Watched]:
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    seen = Watched(context, maze.url)
    seen.open()
    yield seen
    assert seen.troubles == []
    context.close()


def set_target(page: Page, place: str = TARGET) -> None:
    """Type a target, as somebody does who cannot see the map."""
    page.get_by_label("New target: latitude, longitude").fill(place)
    page.get_by_label("New target: latitude, longitude").press("Enter")


def legs(page: Page) -> list[str]:
    """Return the verdicts of the leg table."""
    return [text.split(" ", 1)[1] for text in page.locator("table.legs td.verdict").all_inner_texts()]


def test_a_click_is_planned_and_a_dragged_way_point_is_judged_at_once(watched: Watched) -> None:
    page = watched.page
    watched.click_map(0.72, 0.7)
    expect(page.locator(".headline")).to_have_text("✓ 2.50 m promised")
    assert set(legs(page)) == {"keeps it"}
    rows = page.locator("table.legs tbody tr")

    # Table and map show the same leg.
    rows.nth(1).hover()
    expect(rows.nth(1)).to_have_class("leg keeps hovered")
    handle = page.get_by_role("button", name="Waypoint 1.")
    box = handle.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x - 40, y + 51)
    expect(rows.nth(0)).to_have_class("leg keeps hovered")

    # The view as a picture.
    with page.expect_download() as download:
        page.get_by_role("button", name="Save a picture (PNG)").click()
    with Image.open(download.value.path()) as picture:
        assert len(picture.convert("RGB").getcolors(1 << 24)) > 50

    # Into the wall and back.
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 8, y + 40, steps=4)
    expect(page.locator(".headline")).to_contain_text(re.compile("keep the clearance"))
    page.mouse.up()
    assert "TOO NEAR" in legs(page)
    page.get_by_role("button", name="Repair around the fence").click()
    expect(page.locator(".headline")).to_contain_text("✓")
    page.locator("body").press("Control+z")
    expect(page.locator(".headline")).to_contain_text(re.compile("keep the clearance"))
    page.locator("body").press("Control+z")
    expect(page.locator(".headline")).to_have_text("✓ 2.50 m promised")
    page.locator("body").press("Control+y")
    expect(page.locator(".headline")).to_contain_text(re.compile("keep the clearance"))
    assert watched.accessible() == []


def test_no_route_is_explained_and_the_widest_is_taken_by_a_button(watched: Watched) -> None:
    page = watched.page
    set_target(page, "40.071248, -105.229073")
    expect(page.locator(".headline")).to_have_text("✓ 2.50 m promised")
    widest = page.get_by_role("button", name="widest possible: ")
    expect(widest).to_be_visible()
    page.get_by_role("spinbutton", name="Clearance to keep while driving, metres").fill("8")
    page.keyboard.press("Enter")
    expect(page.locator(".headline")).to_have_text("✗ No route")
    expect(page.locator("#outcome .card.bad")).to_contain_text("along straight legs the widest keeps")
    expect(page.locator("#outcome .card.bad")).to_contain_text("In the way")
    assert watched.accessible() == []
    page.get_by_role("button", name="Plan the widest route").click()
    expect(page.locator(".headline")).to_contain_text("m promised")
    expect(widest).to_have_attribute("aria-pressed", "true")
    expect(page.locator(".headline")).to_contain_text("m promised")


def test_targets_are_added_ordered_moved_and_removed_by_keys_alone(watched: Watched) -> None:
    page = watched.page
    page.get_by_label("adds a target").check()
    page.locator(".map canvas").focus()
    page.keyboard.press("t")
    set_target(page)
    expect(page.get_by_role("textbox", name="Target 2,")).to_have_value("40.0723079, -105.2285800")
    first = page.get_by_role("textbox", name="Target 1,").input_value()
    page.get_by_role("button", name="Target 2 earlier").press("Enter")
    expect(page.get_by_role("textbox", name="Target 2,")).to_have_value(first)
    expect(page.locator(".headline")).to_contain_text("✓")

    # A handle on the map is a button: arrows move it by a quarter of a metre.
    page.get_by_role("button", name="target 2.").focus()
    page.keyboard.press("ArrowUp")
    expect(page.get_by_role("textbox", name="Target 2,")).not_to_have_value(first)
    page.keyboard.press("Delete")
    expect(page.get_by_role("textbox", name="Target 2,")).to_have_count(0)
    page.get_by_role("tab", name="Plan").focus()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_role("tab", name="Drive")).to_be_focused()


def test_a_fence_is_drawn_typed_edited_and_undone(watched: Watched) -> None:
    page = watched.page
    set_target(page)
    expect(page.locator(".headline")).to_have_text("✓ 2.50 m promised")
    before = page.locator(".big").inner_text()
    page.get_by_role("tab", name="Fence").click()
    page.get_by_role("button", name="Draw a polygon").click()
    for east, north in ((0.4, 0.55), (0.5, 0.55), (0.5, 0.4), (0.42, 0.4), (0.4, 0.55)):
        watched.click_map(east, north)
    expect(page.locator("ol.plain > li")).to_have_count(10)
    page.get_by_role("button", name="Draw a circle").click()
    watched.click_map(0.3, 0.3)
    watched.click_map(0.32, 0.3)
    expect(page.locator("ol.plain > li")).to_have_count(11)
    page.get_by_text("Type a zone").click()
    page.get_by_label("A corner a line").fill("40.0716, -105.2299\n40.0716, -105.2298\n40.0717, -105.2298")
    page.get_by_role("button", name="Add the zone").click()
    expect(page.locator("ol.plain > li")).to_have_count(12)
    expect(page.get_by_text("Drawn here; plans already go around it.")).to_be_visible()

    # Its corners are buttons on the map, too.
    page.get_by_role("button", name=re.compile(r"^Corner 1\.")).focus()
    page.keyboard.press("Shift+ArrowUp")
    expect(page.get_by_role("textbox", name="Corner 1:")).to_have_value("40.0716225, -105.2299000")
    assert watched.accessible() == []
    page.get_by_role("tab", name="Plan").click()
    # Another plan, or none: where the clicks fall depends on how the map fits its window.
    expect(page.get_by_role("tabpanel", name="Plan")).not_to_contain_text(before)
    for _ in range(4):
        page.locator("body").press("Control+z")
    expect(page.locator(".big")).to_have_text(before)


def drop(page: Page, name: str, text: str) -> None:
    """Drop a file onto the page."""
    page.evaluate(
        """([name, text]) => {
          const data = new DataTransfer();
          data.items.add(new File([text], name));
          for (const type of ["dragenter", "dragover", "drop"])
            document.body.dispatchEvent(new DragEvent(type, {bubbles: true, cancelable: true, dataTransfer: data}));
        }""",
        [name, text],
    )


def test_dropped_files_are_opened_and_saved_in_other_formats(watched: Watched) -> None:
    page = watched.page
    mission = (FIELDS / "yard-mission.waypoints").read_text(encoding="utf-8")
    fence = (FIELDS / "yard-fence.waypoints").read_text(encoding="utf-8")
    drop(page, "yard-fence.waypoints", fence)
    expect(page.get_by_text("Opened yard-fence.waypoints: a fence of")).to_be_visible()
    drop(page, "yard.waypoints", mission)
    expect(page.get_by_text("Checked: yard.waypoints")).to_be_visible()
    assert legs(page)
    page.get_by_role("tab", name="Files").click()
    saved = {}
    for suffix in (".plan", ".kml"):
        page.get_by_label("What", exact=True).select_option("fence")
        page.get_by_label("Format").select_option(suffix)
        with page.expect_download() as download:
            page.get_by_role("button", name="Save the file").click()
        saved[suffix] = download.value.path().read_text(encoding="utf-8")
        assert download.value.suggested_filename.endswith(suffix)
    assert watched.accessible() == []
    # A name is a text, whatever it says.
    drop(page, "<img src=x onerror=alert(1)>.waypoints", fence)
    expect(page.get_by_text("Opened <img src=x onerror=alert(1)>.waypoints: a fence of")).to_be_visible()
    assert page.locator("img").count() == 0
    for suffix, text in saved.items():
        drop(page, f"again{suffix}", text)
        expect(page.get_by_text(f"Opened again{suffix}: a fence of")).to_be_visible()


WRONG = r"status of 4\d\d"

DROP = """async (files) => {
  const data = new DataTransfer();
  for (const [name, text, bytes] of files) data.items.add(new File([bytes ? new Uint8Array(bytes) : text], name));
  document.body.dispatchEvent(new DragEvent("drop", {bubbles: true, cancelable: true, dataTransfer: data}));
}"""


def test_wrong_and_hostile_files_are_told_and_two_at_once_are_both_opened(
    browser: Browser, maze: Served
) -> None:
    seen = Watched(browser.new_context(viewport={"width": 1280, "height": 800}), maze.url, expected=WRONG)
    page = seen.open()
    told = page.locator(".toast")
    sent: list[str] = []
    page.on("request", lambda one: sent.append(one.url) if "/api/import" in one.url else None)
    for name, text, size, said in (
        ("photo.jpg", "\xff\xd8\xff\xe0 JFIF", 0, "photo.jpg"),
        ("empty.plan", "", 0, "empty.plan"),
        ("run.tlog", "\x00\xfd\x09", 0, "run.tlog"),
        ("half.plan", '{"fileType": "Plan"', 0, "half.plan"),
        ("vast.kml", "", 50 * 1024 * 1024, "vast.kml has 50.0 MB"),
        ("\u202enalp.\n" + "a" * 10_000 + ".plan", "{}", 0, "\\u202enalp.\\u000aaaa"),
    ):
        page.evaluate(DROP, [[name, text, size]])
        expect(told.last).to_contain_text(said)
        assert "\u202e" not in told.last.inner_text()
    assert not any("vast" in url for url in sent)
    box = page.locator(".toasts").bounding_box()
    assert box is not None
    assert box["height"] < 700
    while page.get_by_role("alert").get_by_role("button", name="Close").count():
        page.get_by_role("alert").get_by_role("button", name="Close").first.click()
    assert page.get_by_role("tabpanel", name="Plan").inner_text().count("No plan yet") == 1

    # Two at once, a mission first: both are there, and a file with parameters alone changes nothing that is drawn.
    yard = [(FIELDS / f"yard-{one}.waypoints").read_text(encoding="utf-8") for one in ("mission", "fence")]
    page.evaluate(DROP, [["yard-mission.waypoints", yard[0], 0], ["yard-fence.waypoints", yard[1], 0]])
    expect(page.get_by_text("Opened yard-mission.waypoints: a mission of")).to_be_visible()
    expect(page.get_by_text("Opened yard-fence.waypoints: a fence of")).to_be_visible()
    expect(page.get_by_text("Checked: yard-mission.waypoints")).to_be_visible()
    page.evaluate(DROP, [["rover.param", "FENCE_MARGIN,3\nWP_RADIUS,1\n", 0]])
    expect(page.get_by_text("Opened rover.param:")).to_be_visible()
    expect(page.get_by_text("Checked: yard-mission.waypoints")).to_be_visible()
    assert seen.accessible() == []
    assert seen.troubles == []
    page.context.close()


def focused(page: Page) -> str:
    """Return the name of what has the focus."""
    return str(
        page.evaluate(
            "document.activeElement.getAttribute('aria-label') || document.activeElement.textContent"
        )
    )


def test_a_fence_is_drawn_corner_by_corner_with_keys_and_the_focus_is_never_lost(watched: Watched) -> None:
    page = watched.page
    page.get_by_role("tab", name="Fence").press("Enter")
    page.get_by_role("button", name="Edit this fence").press("Enter")
    expect(page.get_by_role("button", name="Back to the vehicle's fence")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Edit this fence")).to_be_focused()
    page.get_by_role("button", name="Draw a polygon").press("Enter")
    canvas = page.locator(".map canvas")
    undo = page.get_by_role("button", name="Undo")
    for key in ("ArrowRight", "ArrowUp", "ArrowLeft"):
        canvas.press("t")
        canvas.press(key)
        page.wait_for_timeout(500)  # the map glides
    canvas.press("t")
    undo.press("Enter")
    expect(page.get_by_text("Undone: corner drawn")).to_be_visible()
    # A look elsewhere in between costs nothing.
    page.get_by_role("tab", name="Events").press("Enter")
    page.get_by_role("tab", name="Fence").press("Enter")
    canvas.press("Enter")
    expect(page.locator("ol.plain > li")).to_have_count(10)
    page.get_by_role("button", name="Corners: 10.").press("Enter")  # it is open: it was drawn just now
    page.get_by_role("button", name="Corners: 10.").press("Enter")
    expect(page.locator("ol.places textbox, ol.places input[aria-label^='Corner']")).to_have_count(3)
    page.get_by_role("button", name="Remove: 10.").press("Enter")
    expect(page.locator("ol.plain > li")).to_have_count(9)
    assert focused(page) != page.locator("body").text_content()

    # The profile is read with arrows.
    page.get_by_role("tab", name="Plan").press("Enter")
    set_target(page)
    expect(page.locator(".headline")).to_contain_text("✓")
    place = page.get_by_role("slider", name="Place along the route")
    for _ in range(3):
        place.press("Shift+ArrowRight")
    expect(place).to_have_attribute("aria-valuetext", re.compile(r"^\d+\.\d m: .* clear, .* m/s predicted$"))
    assert float(place.get_attribute("aria-valuenow") or 0) > 10
    assert watched.accessible() == []


def test_what_must_not_be_overlooked_of_the_rover_stands_on_every_page(watched: Watched) -> None:
    said = watched.page.evaluate(
        """async () => {
          const [{ Store }, { alarms }, { unknown }] = await Promise.all(["store", "top", "live"].map((name) => import(`/page/${name}.js`)));
          const store = new Store(unknown());
          const [, bar] = alarms(store);
          const found = [];
          for (const parts of [{}, { is_left_armed: true }, { is_left_armed: true, breaches: 2 }, {}]) {
            store.set({ drive: { ...unknown().drive, ...parts } });
            await Promise.resolve();
            found.push([bar.hidden, bar.textContent, bar.getAttribute("role"), bar.classList.contains("late")]);
          }
          return found;
        }"""
    )
    assert [one[0] for one in said] == [True, False, False, True]
    assert "ARMED and stands in HOLD" in said[1][1]
    assert said[2][1].startswith("FENCE BREACHED in this drive, 2 times.")
    assert [one[2:] for one in said[1:3]] == [["alert", True], ["alert", False]]


TOUCHED = """() => [...document.querySelectorAll("button, select, input, textarea, summary")].flatMap((one) => {
  const label = ["radio", "checkbox"].includes(one.type) ? one.closest("label") : null;
  const { width, height, left, right } = (label ?? one).getBoundingClientRect();
  const isSeen = one.getClientRects().length > 0 && getComputedStyle(one).visibility === "visible";
  return isSeen && (width < 40 || height < 40 || left < 0 || right > innerWidth) && !one.matches(".handle")
    ? [`${one.getAttribute("aria-label") ?? one.textContent}: ${width} x ${height}, ${left} to ${right}`] : [];
})"""


def test_a_phone_in_the_dark(browser: Browser, maze: Served) -> None:
    context = browser.new_context(
        viewport={"width": 360, "height": 740}, color_scheme="dark", has_touch=True, is_mobile=True
    )
    seen = Watched(context, maze.url)
    page = seen.open()
    x, y = seen.place(0.5, 0.45)
    page.touchscreen.tap(x, y)
    expect(page.locator(".headline")).to_have_text("✓ 2.50 m promised")
    for name in ("Plan", "Drive", "Fence", "Files", "Events"):
        page.get_by_role("tab", name=name).click()
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        assert page.evaluate(TOUCHED) == []  # nothing is smaller than a finger, or cut
        assert seen.accessible() == []
    assert seen.troubles == []
    context.close()


def test_a_map_lies_under_everything_and_comes_from_here(browser: Browser, tmp_path: Path) -> None:
    tiles = tmp_path / "field.pmtiles"
    write_map(tiles, (-105.2294, 40.0719), zooms=(16, 17))
    with serving("--fence", str(FIELDS / "maze-fence.waypoints"), "--map", str(tiles)) as server:
        context = browser.new_context(viewport={"width": 2560, "height": 1440})
        seen = Watched(context, server.url)
        with seen.page.expect_response(
            lambda answer: answer.url.endswith("/map.pmtiles") and answer.status == 206
        ):
            seen.open()
        assert seen.accessible() == []
        assert seen.troubles == []
        context.close()


def test_without_webgl_there_is_the_servers_picture(browser: Browser, maze: Served) -> None:
    context = browser.new_context()
    context.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    seen = Watched(context, maze.url)
    page = seen.page
    page.goto(maze.url)
    set_target(page)
    expect(page.locator(".headline")).to_have_text("✓ 2.50 m promised")
    picture = page.get_by_alt_text("The server's picture")
    expect(picture).not_to_have_js_property("naturalWidth", 0)
    assert seen.accessible() == []
    assert seen.troubles == []
    context.close()
