"""The console's page in a real browser, with a rover: upload, start, HOLD, go on, arrive; a foreign fence; link and server cut; two pages; a replay.

The rovers are simulated, as the demonstration's; faster than real time, where nothing else is said.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from console.browser_kit import FIELDS, WAIT_MS, Watched, need_browser, serving

need_browser()

from playwright.sync_api import Browser, Page, expect  # noqa: E402 - only where there is a browser

pytestmark = pytest.mark.timeout(240, func_only=True)  # waiting for the browser is not counted
expect.set_options(timeout=WAIT_MS)

LOG = Path(__file__).parents[3] / "sitl_logs" / "guided-maze.tlog"
FAR = "40.0718468, -105.2284819"
HEADLINE = ".headline"


def open_page(browser: Browser, url: str, *, expected: str = r"(?!)") -> Watched:
    """Open a page of its own."""
    seen = Watched(browser.new_context(viewport={"width": 1280, "height": 800}), url, expected=expected)
    seen.open()
    return seen


def close(*pages: Watched) -> None:
    """Look at what must not have been, and close."""
    for seen in pages:
        assert seen.troubles == []
        seen.page.context.close()


def set_target(page: Page, place: str) -> None:
    """Type a target."""
    page.get_by_label("New target: latitude, longitude").fill(place)
    page.get_by_label("New target: latitude, longitude").press("Enter")
    expect(page.locator(HEADLINE)).to_contain_text("m promised")


def press_start(page: Page) -> None:
    """Press Start for as long as it takes, with a key."""
    start = page.get_by_role("button", name="Start: press and hold")
    expect(start).to_be_enabled()
    start.focus()
    page.keyboard.down("Enter")
    expect(page.locator(".chip-mode")).to_contain_text("AUTO")
    page.keyboard.up("Enter")


def state(page: Page) -> str:
    """Return the director's state in words, as the page shows it."""
    return page.locator("#part-drive .facts dd").first.inner_text()


TUTORIAL = Path(__file__).parents[3] / "docs" / "tutorials" / "first-drive.md"


def take_control(seen: Watched) -> None:
    seen.page.get_by_role("button", name="Take control").click()


def draw_a_circle(seen: Watched) -> None:
    seen.page.get_by_role("tab", name="Fence").click()
    seen.page.get_by_role("button", name="Draw a circle").click()
    seen.click_map(*seen.shares(-105.2295, 40.0719))
    seen.click_map(*seen.shares(-105.22946, 40.0719))
    expect(seen.page.locator("ol.plain > li")).to_have_count(10)


def upload_the_fence(seen: Watched) -> None:
    seen.page.get_by_role("button", name="Upload the fence, verified").click()
    expect(seen.page.locator(".transfer")).to_contain_text(
        "The fence is on the vehicle, read back and compared."
    )
    expect(seen.page.locator("ul.zones li")).to_have_count(10)


def click_a_target(seen: Watched) -> None:
    seen.page.get_by_role("tab", name="Plan").click()
    seen.click_map(*seen.shares(-105.2293, 40.07178))
    expect(seen.page.locator(HEADLINE)).to_have_text("✓ 2.50 m promised")


def type_a_clearance(seen: Watched) -> None:
    seen.page.get_by_role("spinbutton", name="Clearance to keep while driving, metres").fill("3")
    seen.page.keyboard.press("Tab")
    expect(seen.page.locator(HEADLINE)).to_have_text("✓ 3.00 m promised")
    assert seen.accessible() == []


def move_a_way_point(seen: Watched) -> None:
    seen.page.get_by_role("button", name="Waypoint 1.").focus()
    for _ in range(6):
        seen.page.keyboard.press("Shift+ArrowRight")
    expect(seen.page.locator(HEADLINE)).to_contain_text(re.compile("legs? do(es)? not keep the clearance"))


def back_to_planning(seen: Watched) -> None:
    seen.page.get_by_role("button", name="Back to planning").click()
    expect(seen.page.locator(HEADLINE)).to_have_text("✓ 3.00 m promised")


def upload(seen: Watched) -> None:
    seen.page.get_by_role("button", name="Upload, verified").click()
    # Only what was read back and compared can be started.
    expect(seen.page.get_by_role("button", name="Start: press and hold")).to_be_enabled()


def start(seen: Watched) -> None:
    press_start(seen.page)


def hold(seen: Watched) -> None:
    expect(seen.page.get_by_role("button", name="HOLD key H")).to_be_visible()
    seen.page.keyboard.press("h")
    expect(seen.page.locator(".hold-answer")).to_contain_text("stands")
    expect(seen.page.locator(".chip-mode")).to_contain_text("HOLD")


def go_on(seen: Watched) -> None:
    seen.page.get_by_role("tab", name="Drive").click()
    button = seen.page.get_by_role("button", name="Go on to the target")
    expect(button).to_be_enabled()
    button.click()  # a click moves nothing
    seen.page.wait_for_timeout(1500)
    expect(seen.page.locator(".chip-mode")).to_contain_text("HOLD")
    button.click(delay=1500)
    expect(seen.page.locator(".chip-mode")).to_contain_text("AUTO")


def arrive(seen: Watched) -> None:
    expect(seen.page.locator("#part-drive .facts").first).to_contain_text("arrived", timeout=120_000)
    expect(seen.page.get_by_text("The promise was kept", exact=False)).to_be_visible()
    expect(seen.page.locator("table.pieces tbody tr")).to_have_count(2)  # before HOLD, and after it
    expect(seen.page.locator("table.pieces")).to_contain_text("arrived")
    assert seen.accessible() == []


# Each step of the tutorial with its words: whoever changes one changes the other.
STEPS = [
    ("Press **Take control**. Other pages can now only watch, and press HOLD.", take_control),
    (
        "Open **Fence**, press **Draw a circle**, and click its centre and its rim in the green area. The rover will keep out of it.",
        draw_a_circle,
    ),
    (
        "Press **Upload the fence, verified**. It is written to the rover, read back and compared.",
        upload_the_fence,
    ),
    (
        'Open **Plan** and click the map where the rover should go, some way off. The route appears with the clearance that it promises: "2.50 m promised".',
        click_a_target,
    ),
    (
        'Type 3 as the clearance. The route changes, and the headline says "3.00 m promised".',
        type_a_clearance,
    ),
    (
        "Drag a waypoint across the fence, or move it there with the arrow keys. The headline says at once how many legs do not keep the clearance.",
        move_a_way_point,
    ),
    ("Press **Back to planning**.", back_to_planning),
    ("Press **Upload, verified**. The mission is written to the rover, read back and compared.", upload),
    ("Press **Start: press and hold** for a second. The mode becomes AUTO, and the rover drives.", start),
    (
        "Press **HOLD**, or the key H. The answer beside it is the rover's own: first that it is in HOLD, then that it stands.",
        hold,
    ),
    (
        "Open **Drive** and press **Go on to the target** for a second. A new route is planned from where the rover stands, uploaded, verified and driven.",
        go_on,
    ),
    (
        'Wait until the state is "arrived". The table below compares what was driven with what was promised, before HOLD and after it.',
        arrive,
    ),
]


def test_the_tutorial_word_for_word(browser: Browser) -> None:
    text = TUTORIAL.read_text(encoding="utf-8")
    assert re.findall(r"^\d+\. (.*)$", text, re.MULTILINE) == [words for words, _ in STEPS]
    with serving("--demo", "--speedup", "3") as server:
        seen = open_page(browser, server.url)
        seen.learn_scale()
        for words, do in STEPS:
            try:
                do(seen)
            except AssertionError as error:
                error.add_note(
                    f"step: {words}; troubles: {seen.troubles}; told: {seen.page.locator('.toast').all_inner_texts()}"
                )
                raise

        # The fence that was there before is a backup, and put back with one step and a question.
        page = seen.page
        page.get_by_role("tab", name="Files").click()
        page.get_by_role("button", name=re.compile("^Restore .*fence")).first.click()
        page.get_by_role("dialog").get_by_role("button", name="Restore").click()
        expect(page.locator(".transfer")).to_contain_text("is on the vehicle")
        page.get_by_role("tab", name="Fence").click()
        expect(page.locator("ul.zones li")).to_have_count(9)

        # What stands in the way is marked, and forgotten.
        page.get_by_role("tab", name="Drive").click()
        page.get_by_role("button", name="Blocked here").click()
        expect(page.get_by_role("button", name="Forget blocked places")).to_be_enabled()
        page.get_by_role("button", name="Forget blocked places").click()
        expect(page.get_by_role("button", name="Forget blocked places")).to_be_disabled()
        close(seen)


def test_a_foreign_fence_a_cut_link_and_a_page_that_only_looks(browser: Browser, tmp_path: Path) -> None:
    words = [sys.executable, "-c", "from mavlink_bridge.cli import main; main()"]
    rover = subprocess.Popen(
        [*words, "sim", "--listen", "tcpin:127.0.0.1:0", "--fence", str(FIELDS / "maze-fence.waypoints")],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert rover.stdout is not None
        found = re.search(r"tcp:\S+:\d+", rover.stdout.readline())
        assert found
        connection = found.group()
        with serving("--connect", connection, "--upload", "--drive", "--arm") as server:
            seen, other = open_page(browser, server.url), open_page(browser, server.url)
            page = seen.page
            page.get_by_role("button", name="Take control").click()
            expect(other.page.get_by_text("holds control")).to_be_visible()
            set_target(page, FAR)
            page.get_by_role("button", name="Upload, verified").click()
            press_start(page)

            # Another station puts a fence across the route: HOLD, a new route, and on, without a hand.
            wall = tmp_path / "wall.waypoints"
            wall.write_text(
                with_wall((FIELDS / "maze-fence.waypoints").read_text(encoding="utf-8")), encoding="utf-8"
            )
            subprocess.run(
                [*words, "upload", str(wall), "--connect", connection, "--source-system", "255", "--source-component", "190", "--replace-active"],
                check=True, timeout=60, env={**os.environ, "XDG_STATE_HOME": str(tmp_path)},
            )  # fmt: skip
            page.get_by_role("tab", name="Events").click()
            expect(page.locator("ol.events")).to_contain_text(
                "fence changed", ignore_case=True, timeout=WAIT_MS
            )

            # The page that holds no control has HOLD all the same.
            other.page.get_by_role("button", name="HOLD key H").click()
            expect(other.page.locator(".hold-answer")).to_contain_text("HOLD")
            expect(other.page.locator(".chip-mode")).to_contain_text("HOLD")

            # No heartbeat: nobody can overlook it. And back.
            rover.send_signal(signal.SIGSTOP)
            expect(page.locator(".alarm-bar")).to_contain_text("LINK LOST")
            assert seen.accessible() == []
            rover.send_signal(signal.SIGCONT)
            expect(page.locator(".alarm-bar")).to_be_hidden(timeout=WAIT_MS)

            # One hand on the wheel: the other page takes it in one deliberate step.
            other.page.get_by_role("button", name="Take control").click()
            other.page.get_by_role("dialog").get_by_role("button", name="Take control").click()
            expect(other.page.get_by_text("This page holds control")).to_be_visible()
            expect(page.get_by_text("This page holds control")).to_be_hidden()
            expect(page.get_by_text("page 2 took control: this page can only watch")).to_be_visible()
            close(seen, other)
    finally:
        rover.kill()
        rover.communicate()


def with_wall(text: str) -> str:
    """Return the maze with a circle across the way to FAR."""
    lines = text.splitlines()
    last = lines[-1].split("\t")
    wall = [
        str(int(last[0]) + 1),
        "0",
        "3",
        "5004",
        "4.000000",
        "0",
        "0",
        "0",
        "40.0717300",
        "-105.2291500",
        "0",
        "1",
    ]
    return "\n".join([*lines, "\t".join(wall)]) + "\n"


def test_a_server_started_anew_under_an_open_page(browser: Browser) -> None:
    fence = str(FIELDS / "maze-fence.waypoints")
    with serving("--fence", fence, "--start", "40.0712247,-105.2302031") as server:
        port = server.port
        # What Chromium says of a server that is gone is meant.
        seen = open_page(browser, server.url, expected=r"net::ERR_|WebSocket connection")
        set_target(seen.page, "40.0723079, -105.2285800")
        # Work under way: two corners of a zone.
        seen.page.get_by_role("tab", name="Fence").click()
        seen.page.get_by_role("button", name="Draw a polygon").click()
        seen.click_map(0.4, 0.5)
        seen.click_map(0.45, 0.5)
        server.stop()
        expect(seen.page.locator(".alarm-bar")).to_contain_text("This page has lost its connection to pbpp")
        with serving("--fence", fence, "--start", "40.0712247,-105.2302031", port=port):
            expect(seen.page.locator(".alarm-bar")).to_be_hidden()
            # What was begun goes on: the polygon gets its third corner, and is a zone; then it is undone.
            seen.click_map(0.45, 0.4)
            seen.page.keyboard.press("Enter")
            expect(seen.page.locator("ol.plain > li")).to_have_count(10)
            seen.page.get_by_role("button", name="Back to the vehicle's fence").click()
            seen.page.get_by_role("tab", name="Plan").click()
            # What was asked for is still there, and can be asked again.
            expect(seen.page.locator(HEADLINE)).to_have_text("✓ 2.50 m promised")
            seen.page.get_by_role("button", name="widest possible").click()
            expect(seen.page.locator(HEADLINE)).to_contain_text("m promised")
            close(seen)


def test_a_page_that_stalls_changes_nothing_for_the_rover_and_says_so_when_it_returns(
    browser: Browser,
) -> None:
    with serving("--demo") as server:
        seen, other = open_page(browser, server.url), open_page(browser, server.url)
        page = seen.page
        take_control(seen)
        set_target(page, FAR)
        upload(seen)
        press_start(page)
        page.evaluate(
            """() => {
              window.said = [];
              const bar = document.querySelector(".alarm-bar");
              new MutationObserver(() => window.said.push(bar.textContent)).observe(bar, { childList: true, characterData: true, subtree: true });
            }"""
        )
        debugger = page.context.new_cdp_session(page)
        debugger.send("Debugger.enable")
        debugger.send("Debugger.pause")  # nothing on the page runs any more
        progress = other.page.locator("#part-drive .facts dd").nth(1)
        before = progress.text_content()
        other.page.wait_for_timeout(12_000)
        expect(other.page.locator(".chip-mode")).to_contain_text("AUTO")
        expect(other.page.locator(".who")).to_have_text(re.compile(r"page \d+ holds control$"))
        assert progress.text_content() != before  # it drives on
        debugger.send("Debugger.resume")
        debugger.detach()
        expect(page.locator(".alarm-bar")).to_be_hidden()
        expect(page.locator(".chip-mode")).to_contain_text("AUTO")
        assert any("This page has lost its connection" in text for text in page.evaluate("window.said"))
        expect(page.get_by_text("This page holds control")).to_be_visible()  # it was there all the time
        expect(page.locator(".chip-mode")).to_contain_text("AUTO")
        page.keyboard.press("h")
        expect(other.page.locator(".chip-mode")).to_contain_text("HOLD")
        close(seen, other)


def test_a_replay_is_scrubbed_and_played(browser: Browser) -> None:
    with serving("--log", str(LOG)) as server:
        seen = open_page(browser, server.url)
        page = seen.page
        expect(page.locator(".moment")).to_contain_text("0:00 min of 1:11 min")
        scrub = page.get_by_label("Moment of the log")
        scrub.focus()
        page.keyboard.press("End")
        expect(page.locator(".chip-mode")).to_contain_text("HOLD")
        page.keyboard.press("Home")
        expect(page.locator(".chip-mode")).to_contain_text("–")
        page.get_by_role("button", name="Next decision").click()
        expect(page.locator(".moment")).not_to_contain_text("0:00 min of")
        page.get_by_label("Speed").select_option("60")
        page.get_by_role("button", name="Play").click()
        expect(page.locator(".moment")).to_contain_text("1:11 min of 1:11 min")
        expect(page.get_by_role("button", name="Play")).to_be_visible()
        expect(page.locator("#hold-bar")).to_contain_text("nothing to hold")
        assert seen.accessible() == []
        close(seen)


def test_start_is_meant_once_by_a_page_that_still_may(browser: Browser) -> None:
    asked: list[dict] = []
    with serving("--demo") as server:
        seen = open_page(browser, server.url, expected="409")
        seen.page.on("request", lambda one: asked.append(one.headers) if "/api/start" in one.url else None)
        # A second of pressing is four here: what is short of it must be so on a busy computer, too.
        seen.page.context.add_init_script(
            "const own = setTimeout; window.setTimeout = (act, ms, ...more) => own(act, ms === 1000 ? 4000 : ms, ...more)"
        )
        seen.open()
        take_control(seen)
        set_target(seen.page, FAR)
        upload(seen)
        start = seen.page.get_by_role("button", name="Start: press and hold")
        start.click(delay=300)  # let go too early
        start.dblclick()
        start.click(button="right", delay=4300)
        start.focus()
        # Something lies on the key: the browser says so again and again.
        start.evaluate(
            "b => { for (const repeat of [true, true]) b.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', repeat})) }"
        )
        seen.page.wait_for_timeout(4500)
        # Control is taken away while it is pressed.
        with seen.page.expect_popup() as opened:
            seen.page.evaluate("() => { open(location.href) }")  # a duplicate has the tab's store
        twin = opened.value
        twin.wait_for_selector('.map-area[data-ready="yes"]')
        expect(twin.get_by_text("page 1 holds control")).to_be_visible()  # it is another page
        seen.page.bring_to_front()
        start.hover()
        seen.page.mouse.down()
        twin.evaluate(
            "async () => { const { post } = await import('/page/connection.js'); await post('/api/control/take') }"
        )
        seen.page.wait_for_timeout(4500)
        seen.page.mouse.up()
        assert asked == []
        seen.page.reload()  # keeps its name
        expect(seen.page.get_by_text("page 2 holds control")).to_be_visible()
        assert seen.page.locator(".who").get_attribute("title") == "You are page 1"
        close(seen)
