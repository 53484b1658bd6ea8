"""A log behind the page: any moment of it, as the director's run over it knew it."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest
from console.serving import served
from websockets.sync.client import connect

from mavlink_bridge.console import deeds, wire
from mavlink_bridge.console.deeds import Refusal
from mavlink_bridge.console.recorded import RecordedBackend
from mavlink_bridge.console.recording import Recording
from mavlink_bridge.director import Orders, TargetSource
from mavlink_bridge.errors import LogError
from mavlink_bridge.replay.replay import replay_log
from missions.geo import LatLon, distance_m

LOGS = Path(__file__).parents[3] / "sitl_logs"
LOG = LOGS / "mission-yard.tlog"
ORDERS = Orders(target_sources=frozenset(TargetSource) - {TargetSource.ECHO, TargetSource.RALLY})


@pytest.fixture(scope="module")
def recording():
    return Recording(LOG, ORDERS)


def test_every_decision_stands_where_the_replay_makes_it(recording):
    told = [(str(event.name), round(event.time_s, 3)) for event in replay_log(LOG, ORDERS)]
    shown = [(event.name, event.time_s) for event in recording.events if event.name != "statustext"]
    assert shown == [one for one in told if one[0] != "progress"]
    assert [event.time_s for event in recording.events] == sorted(event.time_s for event in recording.events)


def test_a_moment_is_what_was_known_then_and_never_later(recording):
    backend = RecordedBackend(recording)
    planned_s = next(event.time_s for event in recording.events if event.name == "planned")
    assert backend.at(planned_s - 0.5)["plan"] is None
    after = backend.at(planned_s + 0.5)
    assert after["plan"].state == "planned"
    assert after["drive"].state == "proposed"
    before = backend.at(recording.begin_s - 100.0)
    assert before["drive"].state == "listening"
    assert before["replay"].now_s == recording.begin_s
    assert backend.at(recording.end_s + 100.0)["replay"].now_s == recording.end_s
    end = backend.at(recording.end_s)
    assert end["fence"].where == "log"
    assert len(end["fence"].held.features) == 4
    assert backend.at(recording.end_s)["plan"] is end["plan"]  # drawn once


def test_the_track_leads_to_where_the_vehicle_was(recording):
    _, lon_deg, lat_deg, *_ = recording.track.rows[-1]
    pose = recording.moments[-1].situation.pose.value.position
    assert distance_m(LatLon(lat_deg, lon_deg), pose) < 0.6  # a moment is up to 0.2 s old


async def refused(backend) -> None:
    with pytest.raises(Refusal, match="replay"):
        await backend.do(deeds.Hold(), "page 1")


def test_nothing_can_be_sent_in_a_replay(recording):
    import asyncio

    backend = RecordedBackend(recording)
    asyncio.run(refused(backend))
    assert backend.backups() == ()
    assert backend.after() is None
    assert backend.situation().fence is not None


def test_each_page_seeks_by_itself(recording):
    backend = RecordedBackend(recording)
    with served(backend=backend) as (_, address):
        streams = [
            connect(f"ws://{address}/api/live?page=seeker-{n}xx", ping_interval=None) for n in range(2)
        ]
        with streams[0] as one, streams[1] as other:
            assert json.loads(one.recv(60))["type"] == json.loads(other.recv(60))["type"] == "snapshot"
            for stream, time_s in ((one, recording.begin_s), (other, recording.end_s)):
                stream.send(json.dumps({"type": "seek", "time_s": time_s}))
            stream.send("no JSON")
            stream.send("x" * 10_000)
            seen = []
            for stream in (one, other):
                while not (message := json.loads(stream.recv(60))).get("state", {}).get("replay"):
                    pass
                jsonschema.validate(
                    message, {"$defs": wire.schema()["$defs"], "$ref": "#/$defs/ChangeMessage"}
                )
                seen.append(message["state"]["replay"]["now_s"])
            assert seen == [recording.begin_s, recording.end_s]


def test_a_log_without_a_vehicle_is_no_replay(tmp_path):
    empty = tmp_path / "empty.tlog"
    empty.write_bytes(b"")
    with pytest.raises(LogError, match="the file is empty"):
        Recording(empty, ORDERS)
