"""What pages are shown: the newest of what they have not got yet, however slow they are; and a track that never grows without end."""

from __future__ import annotations

import json
import math
from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink_bridge.console.board import MOST_EVENTS, NAMES, Board, Seen
from mavlink_bridge.console.view.sections import EventView, Sections, ServerView, VehicleView
from mavlink_bridge.console.view.track import MOST_ROWS, Track
from mavlink_bridge.console.wire import encode
from missions.geo import LatLon, destination, distance_m

SERVER = ServerView(version="1", run_id="x", source="files", source_name="f")


def event(text: str = "") -> EventView:
    return EventView(id=0, time_s=0.0, name="n", severity="info", text=text)


def test_first_everything_then_only_what_changed():
    board, seen = Board(Sections(server=SERVER)), Seen()
    first = board.news(seen)
    assert set(first["state"]) == set(NAMES)
    assert board.news(seen) == {}
    assert not board.publish({"vehicle": VehicleView()})  # the same
    assert board.news(seen) == {}
    assert board.publish({"vehicle": VehicleView(mode=4), "home": (1.0, 2.0)})
    assert json.loads(encode(board.news(seen))) == {
        "state": {"vehicle": json.loads(encode(VehicleView(mode=4))), "home": [1.0, 2.0]}
    }


def test_a_slow_page_gets_the_newest_and_nothing_in_between():
    board, quick, slow = Board(Sections(server=SERVER)), Seen(), Seen()
    board.news(quick), board.news(slow)
    for mode in range(50):
        board.publish({"vehicle": VehicleView(mode=mode)})
        board.add_events([event(str(mode))])
        board.add_rows([(float(mode), 0.0, 0.0, 0.0, mode)])
        assert list(board.news(quick)["state"]) == ["vehicle"]
    found = json.loads(encode(board.news(slow)))
    assert found["state"]["vehicle"]["mode"] == 49
    assert [one["text"] for one in found["events"]] == [str(n) for n in range(50)]
    assert len(found["track"]) == 50
    board.replace_rows([(0.0, 0.0, 0.0, 0.0, 1)])
    assert board.news(slow) == {"track": [(0.0, 0.0, 0.0, 0.0, 1)], "track_anew": True}


def test_events_are_numbered_and_a_page_that_missed_many_gets_the_newest():
    board, seen = Board(Sections(server=SERVER)), Seen()
    board.add_events([event()] * (MOST_EVENTS + 20))
    events = board.news(seen)["events"]
    assert len(events) == MOST_EVENTS
    assert [one.id for one in events] == list(range(21, MOST_EVENTS + 21))
    kept = Board(Sections(server=SERVER), None)
    kept.add_events([event()] * (MOST_EVENTS + 20))
    assert len(kept.events) == MOST_EVENTS + 20


def test_numbers_that_json_has_not_become_null():
    assert b"null" in encode(replace(VehicleView(), speed_mps=math.nan))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.floats(0.0, 3.0), st.floats(0.0, 360.0)), min_size=1, max_size=60))
def test_a_track_shows_where_the_vehicle_was_to_ten_centimetres(steps):
    track, at = Track(), LatLon(47.0, 8.0)
    for number, (away_m, along_deg) in enumerate(steps):
        at = destination(at, away_m, along_deg)
        track.add(float(number), at, 1.0, 10)
        _, lon_deg, lat_deg, *_ = track.rows[-1]
        assert distance_m(LatLon(lat_deg, lon_deg), at) <= 0.101


def test_a_long_track_is_thinned_and_keeps_its_ends():
    track = Track()
    for number in range(MOST_ROWS + 5):
        track.add(float(number), LatLon(0.0, number * 2e-6), 1.0, 10)
    assert len(track.rows) <= MOST_ROWS
    assert track.generation == 1
    assert track.rows[0][0] == 0.0
    assert track.rows[-1][0] >= MOST_ROWS
    track.add(1e6, LatLon(0.0, (MOST_ROWS + 4) * 2e-6), 0.0, 4)  # another mode is always shown
    assert track.rows[-1][4] == 4
