"""What a live bridge shows its pages, in stepped time; a defect of ours costs a picture, never the bridge."""

from __future__ import annotations

import asyncio
import math
import threading
import time

import pytest
from console.serving import SteppedConsole, files_hub
from console.test_live_desk import looked_at
from director.test_bridge_director import FAR, IN_BARN, NEAR

from mavlink_bridge.console import deeds
from mavlink_bridge.console.access import Access
from mavlink_bridge.console.deeds import Refusal
from mavlink_bridge.console.live import LiveBackend, LiveConsole
from mavlink_bridge.console.view import driven
from mavlink_bridge.console.view.events import text_view
from mavlink_bridge.console.view.instruments import Instruments
from mavlink_bridge.console.view.plans import plan_id
from mavlink_bridge.director import State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.simulator.faults import Faults
from missions.request import Tour
from missions.situation import Situation


class Pages:
    """Takes what a hub takes."""

    def __init__(self) -> None:
        self.state: dict = {}
        self.events: list = []
        self.rows: list = []

    def post(self, sections, events=(), rows=(), rows_anew=None):
        self.state.update(sections)
        self.events += events
        self.rows += rows


class Shown(SteppedConsole):
    """A stepped bridge with the console's own eyes and ears."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.pages = Pages()
        self.backend = LiveBackend(self.director)
        self.console = LiveConsole(self.director, self.writer, self.backend, Tour())
        self.console.serve(self.pages, self.desk)
        self.console.link_opened()
        heard = self.director.receive

        def hear(frame, now_s):
            heard(frame, now_s)
            self.console.hear([frame], now_s)

        self.director.receive = hear
        take = self.director.take_events

        def taken():
            events = take()
            for event in events:
                self.console.tell(event)
            return events

        self.director.take_events = taken

    def _beside(self, run) -> None:
        super()._beside(run)
        self.console.step(run.now_s)
        self.console.show(run.now_s)

    def drawn(self, condition):
        """Wait for the drawer's thread."""
        until_s = time.monotonic() + 150
        while not condition(self.pages.state):
            assert time.monotonic() < until_s
            time.sleep(0.01)
        return self.pages.state


@pytest.fixture
def shown(tmp_path):
    found = Shown(tmp_path)
    found.until(lambda: found.director.state is State.READY)
    yield found
    found.console.close()


def test_a_page_sees_the_vehicle_its_fence_the_plan_and_the_drive(shown):
    state = shown.drawn(lambda state: state.get("fence") and state["fence"].meant)
    assert state["fence"].where == "vehicle"
    assert state["link"].state == "ok"
    assert (state["vehicle"].autopilot, state["vehicle"].mode_text) == ("ArduPilot", "MANUAL")
    shown.do(deeds.TakeTargets(Tour(targets=(FAR,), clearance_m=2.5)))
    shown.until(lambda: shown.director.awaits_confirmation)
    shown.wait(0.3)
    state = shown.drawn(lambda state: state.get("plan") and state["plan"].state == "planned")
    assert state["plan"].by == "director"
    assert state["drive"].awaits_upload
    assert state["drive"].plan_id == state["plan"].id
    shown.do(deeds.UploadPlan(state["plan"].id))
    shown.until(lambda: shown.director.state is State.VERIFIED)
    shown.wait(0.3)
    assert (shown.pages.state["upload"].state, shown.pages.state["mission"].matches_plan) == (
        "verified",
        True,
    )
    shown.do(deeds.Start(state["plan"].id))
    shown.until(
        lambda: (
            shown.pages.state["drive"].progress_m not in (None, 0.0)
            and shown.pages.state["drive"].progress_m > 20
        )
    )
    drive = shown.pages.state["drive"]
    assert drive.is_driving
    assert drive.corridor_ok
    assert drive.least_clearance_m >= drive.asked_m == 2.5
    assert drive.left_m + drive.progress_m == pytest.approx(drive.length_m, abs=0.2)
    shown.until(lambda: shown.director.state is State.ARRIVED, 200)
    shown.wait(0.5)
    assert not shown.pages.state["drive"].is_driving
    assert shown.pages.state["drive"].least_clearance_m >= 2.5  # stays to be seen
    after = shown.backend.after()
    assert (len(after.pieces), after.is_kept, after.has_arrived) == (1, True, True)
    assert after.least_m >= after.promised_m == 2.5
    assert after.outside_max_m == 0.0
    assert len(shown.pages.rows) > 100
    names = [event.name for event in shown.pages.events]
    assert "progress" not in names
    assert {"planned", "verified", "arrived", "statustext"} <= set(names)


def test_a_drive_is_compared_whole_piece_by_piece_also_one_that_was_stopped(shown):
    assert shown.backend.after() is None
    shown.do(deeds.TakeTargets(Tour(targets=(FAR,), clearance_m=2.5)))
    shown.until(lambda: shown.director.awaits_confirmation)
    shown.director.confirm(shown.run.now_s)
    shown.until(lambda: shown.director.state is State.VERIFIED)
    shown.do(deeds.Start(plan_id(shown.director.plan)))
    shown.until(lambda: shown.director.drive is not None and shown.director.drive.driven_m > 20)
    shown.do(deeds.Hold())
    shown.wait(10.0)
    first = shown.backend.after()  # so far: nobody has to arrive to know it
    assert (len(first.pieces), first.is_kept, first.has_arrived) == (1, True, False)
    assert first.driven_m > 15
    shown.do(deeds.Resume())
    shown.until(lambda: shown.director.state is State.ARRIVED, 200)
    shown.wait(0.5)
    after = shown.backend.after()
    one, two = after.pieces
    assert one.driven_m == pytest.approx(first.driven_m, abs=0.01)
    assert (one.has_arrived, two.has_arrived, after.has_arrived) == (False, True, True)
    assert after.driven_m == pytest.approx(one.driven_m + two.driven_m, abs=0.02)
    assert after.least_m == min(one.least_m, two.least_m)
    assert after.predicted_s == one.predicted_s
    assert after.took_s > one.took_s + two.took_s + 5  # it stood in between
    # Another target is another drive.
    shown.do(deeds.TakeTargets(Tour(targets=(NEAR,), clearance_m=2.5)))
    shown.until(lambda: shown.director.awaits_confirmation)
    shown.director.confirm(shown.run.now_s)
    shown.until(lambda: shown.director.state is State.VERIFIED)
    shown.do(deeds.Start(plan_id(shown.director.plan)))
    shown.until(lambda: shown.director.drive is not None and shown.director.drive.driven_m > 2)
    assert len(shown.backend.after().pieces) == 1


def test_a_long_drive_is_compared_to_its_end_and_loses_no_clearance(shown, monkeypatch):
    monkeypatch.setattr(driven, "_MOST_PLACES", 50)
    shown.do(deeds.TakeTargets(Tour(targets=(FAR,), clearance_m=2.5)))
    shown.until(lambda: shown.director.awaits_confirmation)
    shown.director.confirm(shown.run.now_s)
    shown.until(lambda: shown.director.state is State.VERIFIED)
    shown.do(deeds.Start(plan_id(shown.director.plan)))
    shown.until(lambda: shown.director.state is State.DRIVING)
    watch = shown.director.drive
    shown.until(lambda: shown.director.state is State.ARRIVED, 200)
    (piece,) = shown.backend.log.so_far()
    assert 25 < len(piece.passed) <= 50
    times_s = [one.time_s for one in piece.passed]
    assert times_s == sorted(set(times_s))
    assert piece.passed[-1].time_s == pytest.approx(shown.run.now_s, abs=2.0)
    assert piece.least_m == watch.least_clearance_m
    (view,) = shown.backend.after().pieces
    assert view.least_m == pytest.approx(watch.least_clearance_m, abs=0.005)
    assert view.driven_m == pytest.approx(watch.driven_m, rel=0.02)


def test_why_there_is_no_route_is_shown_and_the_link_that_is_lost(shown):
    shown.do(deeds.TakeTargets(Tour(targets=(IN_BARN,), clearance_m=2.5)))
    shown.until(lambda: shown.director.state is State.READY and shown.director.trouble is not None)
    shown.wait(0.3)
    state = shown.drawn(lambda state: state.get("plan") and state["plan"].state == "no_route")
    assert state["plan"].no_route.kind == "TargetBlockedError"
    assert state["plan"].no_route.message
    shown.run.is_cut = True
    shown.wait(4.0)
    assert shown.pages.state["link"].state == "late"
    shown.wait(3.0)
    assert shown.pages.state["link"].state == "lost"
    shown.console.link_closed("cable pulled")
    shown.wait(0.3)
    assert shown.pages.state["link"].trouble == "cable pulled"


def test_a_defect_of_ours_is_told_and_nothing_ends(shown, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("of ours")

    monkeypatch.setattr(shown.desk, "handle_timer", broken)
    shown.console.step(shown.run.now_s)
    shown.console._drawer.want("picture", broken)
    until_s = time.monotonic() + 150
    while sum("bug in pbpp" in event.text for event in shown.pages.events) < 2:
        assert time.monotonic() < until_s
        shown.console.show(shown.run.now_s)
        shown.run.now_s += 0.2
        time.sleep(0.01)


def asked(backend, bridge) -> list:
    """Ask for HOLD as the server does, with the bridge's loop in another thread."""
    results = []

    async def ask():
        try:
            results.append(await backend.do(deeds.Hold(), "page 1"))
        except Refusal as refusal:
            results.append(refusal.problem)

    thread = threading.Thread(target=bridge)
    thread.start()
    asyncio.run(ask())
    thread.join(100)
    return results


def test_deeds_are_done_in_the_bridges_own_loop(shown, monkeypatch):
    def bridge():
        until_s = time.monotonic() + 100
        while not shown.backend._asked and time.monotonic() < until_s:
            time.sleep(0.005)
        shown.backend.take_asked(shown.run.now_s)

    assert asked(shown.backend, bridge) == ["HOLD is being sent"]

    def broken(*_):
        raise ZeroDivisionError("of ours")

    monkeypatch.setattr(shown.desk, "do", broken)
    (problem,) = asked(shown.backend, bridge)
    assert "bug in pbpp" in problem.message


def test_a_deed_before_the_bridge_is_ready_is_answered_too(shown):
    shown.backend.desk = None

    def bridge():
        until_s = time.monotonic() + 100
        while not shown.backend._asked and time.monotonic() < until_s:
            time.sleep(0.005)
        shown.backend.take_asked(shown.run.now_s)

    (problem,) = asked(shown.backend, bridge)
    assert (problem.kind, "nothing was sent" in problem.message) == ("not_now", True)
    assert not shown.backend._asked


def test_control_that_is_taken_while_the_bridge_does_not_answer_is_taken(shown, monkeypatch):
    monkeypatch.setattr("mavlink_bridge.console.live._ANSWER_S", 0.05)
    hub = files_hub(Access.of("127.0.0.1", 1), backend=shown.backend)
    said = asyncio.run(hub.take_control("a" * 12))
    assert hub.board.sections["control"].holder == "page 1"
    assert "may still be done: the bridge does not answer" in said
    assert [(event.severity, event.text) for event in hub.board.events] == [
        ("notice", "page 1 took control"),
        ("warning", said),
    ]
    said = asyncio.run(hub.give_control("a" * 12))
    assert hub.board.sections["control"].holder is None
    assert "may still be done" in said
    shown.desk.do = lambda deed, page, now_s: done.append((type(deed).__name__, page)) or ""
    done: list = []
    shown.backend.take_asked(shown.run.now_s)  # it only ends what is wanted: done as soon as the bridge can
    assert done == [("TakeControl", "page 1"), ("GiveControl", "page 1")]


def test_a_rover_left_armed_is_shown_until_it_is_disarmed(tmp_path):
    shown = Shown(tmp_path, {"faults": Faults(latency_s=0.1)})
    shown.until(lambda: shown.director.state is State.READY)
    shown.do(deeds.UploadPlan("x", looked_at(shown)))
    shown.until(lambda: shown.director.state is State.VERIFIED)
    shown.do(deeds.Start(plan_id(shown.director.plan)))
    shown.until(lambda: shown.run.vehicles[0].is_armed)
    shown.do(deeds.TakeControl(), "page 2")
    shown.until(lambda: shown.pages.state["drive"].is_left_armed, 10)
    assert shown.director.state is State.VERIFIED
    shown.run.vehicles[0].rover.is_armed = False
    shown.until(lambda: not shown.pages.state["drive"].is_left_armed, 10)
    shown.console.close()


def test_a_bridge_that_does_not_answer_is_not_waited_for(shown, monkeypatch):
    monkeypatch.setattr("mavlink_bridge.console.live._ANSWER_S", 0.05)
    (problem,) = asked(shown.backend, lambda: None)
    assert "it is not known whether that was done" in problem.message


@pytest.mark.parametrize(
    ("message", "percent", "volts"),
    [
        (m.SysStatus(0, 0, 0, 12_340, 55), 55, 12.34),
        (m.SysStatus(0, 0, 0, 0, 0), None, None),  # no monitor
        (m.SysStatus(0, 0, 0, 65_535, -1), None, None),
        (m.BatteryStatus(0, (4000, 4100, *(65_535,) * 8), 20), 20, 8.1),
        (m.BatteryStatus(1, (4000, *(65_535,) * 9), 20), None, None),  # another battery
    ],
)
def test_a_battery_is_shown_where_it_is_known(message, percent, volts):
    instruments = Instruments()
    instruments.receive(m.Frame(1, 1, message), 0.0)
    seen = instruments.vehicle(Situation())
    assert (seen.battery_percent, seen.battery_v) == (percent, volts)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("EKF failsafe", "EKF failsafe"),
        ("<b>not markup</b>", "<b>not markup</b>"),  # the page writes texts, never markup
        ("one\ntwo\x1b[31m", r"one\ntwo\x1b[31m"),
        ("\u202edlof", r"\u202edlof"),
        ("A" * 500, "A" * 500),
        ("A" * 10_000, "A" * 500 + "…"),
        ("\u202e" * 10_000, (r"\u202e" * 100)[:500] + "…"),
    ],
)
def test_texts_of_a_vehicle_are_shown_as_what_they_are_and_never_without_end(text, shown):
    assert text_view(m.Statustext(2, text), 1.0).text == shown


def test_heartbeats_that_are_missing_are_counted():
    instruments = Instruments()
    for second in range(30):
        if second % 2:
            instruments.receive(m.Frame(1, 1, m.Heartbeat(10, 3)), float(second))
    assert instruments.link(29.0, 29.5, is_lost=False, trouble="").heartbeats_missed_percent == 50
    assert instruments.link(None, 29.5, is_lost=False, trouble="").state == "listening"


def test_an_upload_between_two_looks_is_shown_all_the_same(shown):
    shown.do(deeds.UploadFence(shown.director.situation.fence.value))
    shown.until(lambda: not shown.writer.is_busy)
    shown.wait(0.3)
    assert (shown.pages.state["upload"].what, shown.pages.state["upload"].state) == ("fence", "verified")
    shown.do(deeds.TakeTargets(Tour(targets=(FAR,), clearance_m=2.5)))
    shown.until(lambda: shown.director.awaits_confirmation)
    shown.console._due_s = math.inf  # nobody looks
    shown.director.confirm(shown.run.now_s)
    shown.until(lambda: shown.director.state is State.VERIFIED)
    shown.console._due_s = 0.0
    shown.wait(0.3)
    assert (shown.pages.state["upload"].what, shown.pages.state["upload"].state) == ("mission", "verified")


def test_what_only_stops_is_done_though_nobody_waits_for_its_answer(shown):
    """A page that takes control and is gone before the bridge has heard it: what the other one waits for is not done all the same."""

    async def ask():
        wanted = asyncio.create_task(shown.backend.do(deeds.TakeTargets(Tour(targets=(FAR,))), "page 1"))
        await asyncio.sleep(0)
        shown.backend.take_asked(shown.run.now_s)
        assert await wanted == "the bridge plans"
        taken = asyncio.create_task(shown.backend.do(deeds.TakeControl(), "page 2"))
        await asyncio.sleep(0)
        taken.cancel()
        await asyncio.sleep(0)
        shown.backend.take_asked(shown.run.now_s)

    done: list = []
    own = shown.desk.do
    shown.desk.do = lambda deed, page, now_s: (
        done.append((type(deed).__name__, page)),
        own(deed, page, now_s),
    )[1]
    asyncio.run(ask())
    assert done == [("TakeTargets", "page 1"), ("TakeControl", "page 2")]


def test_hold_is_done_though_its_page_does_not_wait_any_more_and_before_all_else(shown):
    async def ask():
        held = asyncio.create_task(shown.backend.do(deeds.Hold(), "page 1"))
        await asyncio.sleep(0)
        held.cancel()
        begun = asyncio.create_task(shown.backend.do(deeds.TakeTargets(Tour(targets=(FAR,))), "page 2"))
        late = asyncio.create_task(shown.backend.do(deeds.Hold(), "page 3"))
        await asyncio.sleep(0)
        shown.backend.take_asked(shown.run.now_s)
        assert "sent" in await late
        with pytest.raises(Refusal, match="HOLD was pressed after it"):
            await begun

    asyncio.run(ask())
    assert [(name, text.split(" of ")[0]) for name, _, text in shown.calls] == [
        ("hold", "asked for by page 1"),
        ("hold", "asked for by page 3"),
    ]
