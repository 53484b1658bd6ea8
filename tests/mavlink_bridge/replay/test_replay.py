"""Replays: of the recordings, what their manifest states; of the bridge's own logs, the same decisions again."""

from __future__ import annotations

import json
import tomllib
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from mavlink_bridge.director import Director, EventName, Orders, TargetSource
from mavlink_bridge.director.orders import ObstacleSource
from mavlink_bridge.errors import LogError
from mavlink_bridge.replay.expectations import differences, read_expectation
from mavlink_bridge.replay.journal import (
    Call,
    Journal,
    JournalWriter,
    journal_path,
    read_journal,
    request_to_text,
)
from mavlink_bridge.replay.replay import replay_foreign, replay_recorded
from mavlink_bridge.tlog import TlogReader
from missions.firmware import Firmware
from missions.geo import LatLon
from missions.request import End, GoTo, Order, RepairMission, Request, Tour
from missions.situation import Situation
from missions.stops import Stop, Stops
from missions.vehicle import Footprint

FOLDER = Path(__file__).parents[3] / "sitl_logs"
MANIFEST = tomllib.loads((FOLDER / "manifest.toml").read_text(encoding="utf-8"))
MANIFEST.pop("origin")
SOURCES = frozenset(TargetSource) - {TargetSource.ECHO, TargetSource.RALLY}


@pytest.fixture(scope="module")
def told():
    orders = Orders(target_sources=SOURCES)
    return {name: list(replay_foreign(TlogReader(FOLDER / f"{name}.tlog"), orders)) for name in MANIFEST}


@pytest.mark.parametrize("name", MANIFEST)
def test_a_recording_gives_its_events(told, name):
    assert [event.name for event in told[name]] == MANIFEST[name]["events"]


@pytest.mark.parametrize("name", MANIFEST)
def test_a_recording_gives_what_was_recorded_of_its_events(told, name):
    expected = read_expectation(FOLDER / f"{name}.events.jsonl")
    assert differences(expected, [event.as_json() for event in told[name]]) == []


def test_the_numbers_of_some_events(told):
    maze = [event for event in told["guided-maze"] if event.name is EventName.TARGET]
    assert [event.data["position"] for event in maze] == [
        [40.071329, -105.229871],
        [40.0726316, -105.2290497],
    ]
    changed = next(event for event in told["fence-change-yard"] if event.name is EventName.FENCE_CHANGED)
    assert changed.data == {"zones": 6, "vertices": 19}
    assert told["no-fence"][-1].data["error"] == "FenceMissingError"
    assert told["island-unreachable"][-1].data["error"] == "NoRouteError"
    assert told["mission-yard"][2].data["source"] == "mission"


def test_times_are_the_logs_own_and_only_go_forward(told, logs):
    first, *_, last = (entry.time_s for entry in TlogReader(logs / "guided-maze.tlog"))
    times = [event.time_s for event in told["guided-maze"]]
    assert times == sorted(times)
    assert first <= times[0] <= times[-1] <= last


def test_a_clock_that_is_set_amid_a_log_changes_no_decision(told):
    """Days back at first, as before the first GPS fix; an hour back from the middle on."""
    entries = list(TlogReader(FOLDER / "fence-change-yard.tlog"))
    middle = len(entries) // 2
    shifts_s = [-3 * 86_400.0 if index < 500 else -3600.0 * (index > middle) for index in range(len(entries))]
    crooked = [
        replace(entry, time_s=entry.time_s + shift_s)
        for entry, shift_s in zip(entries, shifts_s, strict=True)
    ]
    again = list(replay_foreign(crooked, Orders(target_sources=SOURCES)))
    straight = told["fence-change-yard"]
    assert [event.name for event in again] == [event.name for event in straight]
    assert again[-1].time_s == pytest.approx(straight[-1].time_s - 3600.0, abs=1e-6)


def test_an_hour_without_a_heartbeat_is_a_link_lost(told):
    entries = list(TlogReader(FOLDER / "no-fence.tlog"))
    middle = len(entries) // 2
    later = [
        replace(entry, time_s=entry.time_s + 3600.0 * (index > middle)) for index, entry in enumerate(entries)
    ]
    names = [event.name for event in replay_foreign(later, Orders(target_sources=SOURCES))]
    assert EventName.LINK_LOST in names
    assert EventName.LINK_BACK in names


def test_an_empty_log_of_entries_gives_nothing():
    assert list(replay_foreign([], Orders())) == []


ORDERS = Orders(
    identity=(1, 195),
    system=1,
    upload=True,
    drive=True,
    request=Request(start=LatLon(1.0, 2.0), targets=(LatLon(3.0, 4.0),), clearance_m=2.0),
    target_sources=frozenset({TargetSource.TYPED, TargetSource.ECHO}),
    obstacle_sources=frozenset({ObstacleSource.KEYBOARD}),
    obstacle_growth_mps=0.5,
    obstacle_keep_s=20.0,
)
CALLS = (
    Call(0, 10.0, "start"),
    Call(3, 11.5, "timer"),
    Call(9, 12.25, "target", LatLon(5.0, 6.0)),
    Call(9, 12.5, "obstacle", LatLon(5.0, 6.0), "1.5"),
    Call(9, 12.5, "obstacle", text="2.0"),
    Call(9, 12.75, "clear"),
)


def test_a_journal_reads_back_as_written(tmp_path):
    path = journal_path(tmp_path / "run.tlog")
    stops = Stops(given=(Stop(3.0, 6.0), Stop(5.0, 12.5)))
    known = Situation(parameters={"WP_RADIUS": 2.0}, firmware=Firmware(4, 7, 0, 0), stops=stops)
    with path.open("w") as file:
        writer = JournalWriter(file, ORDERS, known)
        for call in CALLS:
            writer.call(call)
    journal = read_journal(path)
    assert asdict(journal.orders) == asdict(ORDERS)
    assert journal.calls == CALLS
    assert journal.described == known
    with path.open("w") as file:
        JournalWriter(file, replace(ORDERS, identity=None, request=Request()), Situation())
    assert read_journal(path).orders.identity is None


def test_a_journal_keeps_what_a_tour_asks_for_and_refuses_what_makes_no_sense(tmp_path):
    path = journal_path(tmp_path / "run.tlog")
    tour = Tour(
        targets=(LatLon(3.0, 4.0), LatLon(1.0, 2.0)),
        order=Order.BEST,
        comes_back=True,
        end=End.LOITER,
        method="pbpp",
        trusts_model=True,
    )
    for asked in (tour, GoTo(), RepairMission(footprint=Footprint(1.0, 0.5))):
        with path.open("w") as file:
            JournalWriter(file, replace(ORDERS, request=asked), Situation())
        assert read_journal(path).orders.request.words() == asked.words()
    path.write_text(path.read_text().replace('"snap_m": 0.0', '"snap_m": -1.0'))
    with pytest.raises(LogError, match=r"snap_m -1\.0: expected a finite number of at least 0"):
        read_journal(path)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "no json\n",
        '{"journal": 7}\n',
        '{"journal": 1, "orders": {}}\n',
        '{"journal": 2, "orders": {}}\n',
        "[]\n",
    ],
)
def test_what_is_no_journal_is_one_clear_error(tmp_path, text):
    path = tmp_path / "run.journal.jsonl"
    path.write_text(text)
    with pytest.raises(LogError, match=r"run\.journal\.jsonl"):
        read_journal(path)
    with pytest.raises(LogError, match=r"missing\.jsonl cannot be read: No such file"):
        read_journal(tmp_path / "missing.jsonl")


def test_a_damaged_line_is_named(tmp_path):
    path = tmp_path / "run.journal.jsonl"
    with path.open("w") as file:
        JournalWriter(file, ORDERS, Situation()).call(CALLS[0])
        file.write(json.dumps({"frames": 1}) + "\n")
    with pytest.raises(LogError, match="line 3"):
        read_journal(path)


@pytest.mark.parametrize("name", ["guided-maze", "no-fence"])
def test_a_log_whose_clock_stands_still_is_an_error_and_no_quiet_log(name):
    entries = [replace(entry, time_s=1.7e9) for entry in TlogReader(FOLDER / f"{name}.tlog")]
    with pytest.raises(
        LogError, match=r"clock does not advance: \d+ heartbeats .* cannot be replayed"
    ) as caught:
        list(replay_foreign(entries, Orders()))
    assert "pbpp plan --log" in str(caught.value.details["advice"])


def test_what_persons_at_pages_asked_for_is_repeated(monkeypatch):
    asked = Tour(targets=(LatLon(3.0, 4.0), LatLon(1.0, 2.0)), clearance_m=2.0, end=End.LOITER)
    made = []
    for name in ("hold", "start_drive", "confirm", "suspect_lists", "take_request", "clear_obstacles"):
        monkeypatch.setattr(Director, name, lambda _self, *given, name=name: made.append((name, *given)))
    calls = (
        Call(0, 1.0, "start"),
        Call(0, 2.0, "request", text=request_to_text(asked)),
        Call(0, 3.0, "confirm"),
        Call(0, 4.0, "drive"),
        Call(0, 5.0, "hold", text="asked for by page 1"),
        Call(0, 6.0, "suspect"),
        Call(0, 7.0, "clear"),
    )
    assert (
        list(replay_recorded([], Journal(replace(ORDERS, starts_on_word=True), Situation(), calls, ()))) == []
    )
    assert made == [
        ("take_request", asked, 2.0),
        ("confirm", 3.0),
        ("start_drive", 4.0),
        ("hold", "asked for by page 1", 5.0),
        ("suspect_lists",),
        ("clear_obstacles", 7.0),
    ]
