"""Every recording yields the facts its manifest states."""

from __future__ import annotations

import hashlib
import tomllib
from pathlib import Path

import pytest

from mavlink_bridge.mavlink.messages import (
    CommandInt,
    GlobalPositionInt,
    Heartbeat,
    MissionCount,
    MissionItemInt,
    MissionType,
    ParamValue,
    SetPositionTargetGlobalInt,
    Statustext,
)
from mavlink_bridge.tlog import SENT_LINK, Damage, TlogReader

FOLDER = Path(__file__).parents[3] / "sitl_logs"
MANIFEST = tomllib.loads((FOLDER / "manifest.toml").read_text(encoding="utf-8"))
ORIGIN = MANIFEST.pop("origin")
GROUND_STATION = 255
DO_REPOSITION = 192


@pytest.fixture(scope="module", params=sorted(MANIFEST))
def recording(request):
    facts = MANIFEST[request.param]
    reader = TlogReader(FOLDER / facts["file"])
    entries = list(reader)
    return facts, entries, reader.damage


def messages(entries, message_class, system=None):
    return [
        (entry, entry.frame.message)
        for entry in entries
        if isinstance(entry.frame.message, message_class) and system in {None, entry.frame.system}
    ]


def test_every_recording_is_in_the_manifest():
    assert {facts["file"] for facts in MANIFEST.values()} == {path.name for path in FOLDER.glob("*.tlog")}


def test_content(recording):
    facts, entries, damage = recording
    assert hashlib.sha256((FOLDER / facts["file"]).read_bytes()).hexdigest() == facts["sha256"]
    assert damage == Damage(frames=facts["frames"])
    assert entries[-1].time_s - entries[0].time_s == pytest.approx(facts["duration_s"], abs=0.06)


def test_origin(recording):
    _, entries, _ = recording
    banners = {message.text for _, message in messages(entries, Statustext) if "Rover" in message.text}
    assert banners
    assert all(ORIGIN["firmware"].startswith(banner) for banner in banners)


def test_positions_begin_without_a_fix_and_then_stay_near_home(recording):
    facts, entries, _ = recording
    places = [(message.lat, message.lon) for _, message in messages(entries, GlobalPositionInt)]
    zeros = facts["positions_without_fix"]
    assert len(places) == facts["positions"]
    assert places[:zeros] == [(0, 0)] * zeros
    home = ORIGIN["home"]
    for lat, lon in places[zeros:]:
        assert lat / 1e7 == pytest.approx(home["lat_deg"], abs=0.003)
        assert lon / 1e7 == pytest.approx(home["lon_deg"], abs=0.003)


def test_parameters(recording):
    facts, entries, _ = recording
    names = {message.param_id for _, message in messages(entries, ParamValue)}
    assert len(names) == facts["parameters"]
    assert {"FENCE_ENABLE", "FENCE_TYPE", "FENCE_OPTIONS"} <= names


@pytest.mark.parametrize(
    ("key", "kind"),
    [
        ("fence_items", MissionType.FENCE),
        ("mission_items", MissionType.MISSION),
        ("rally_points", MissionType.RALLY),
    ],
)
def test_transfers_up_and_back(recording, key, kind):
    facts, entries, _ = recording
    for system in (GROUND_STATION, 1):
        counts = [m.count for _, m in messages(entries, MissionCount, system) if m.mission_type == kind]
        assert counts == facts[key]
    sent, read_back = (
        [
            (m.seq, m.command, m.x, m.y)
            for _, m in messages(entries, MissionItemInt, system)
            if m.mission_type == kind
        ]
        for system in (GROUND_STATION, 1)
    )
    assert len(sent) == sum(facts[key])
    if kind is MissionType.MISSION:  # the vehicle puts its own home into item 0
        sent, read_back = ([item for item in items if item[0]] for items in (sent, read_back))
    assert sent == read_back


def test_modes(recording):
    facts, entries, _ = recording
    modes = [message.custom_mode for _, message in messages(entries, Heartbeat, system=1)]
    changes = [mode for place, mode in enumerate(modes) if place == 0 or mode != modes[place - 1]]
    assert changes == facts["modes"]


def test_targets_are_on_the_sending_link(recording):
    facts, entries, _ = recording
    begin_s = entries[0].time_s
    found = [
        (entry, (message.x, message.y))
        for entry, message in messages(entries, CommandInt)
        if message.command == DO_REPOSITION
    ]
    found += [
        (entry, (message.lat_int, message.lon_int))
        for entry, message in messages(entries, SetPositionTargetGlobalInt)
    ]
    assert [place for _, place in found] == [
        (target["lat_e7"], target["lon_e7"]) for target in facts["targets"]
    ]
    for (entry, _), target in zip(found, facts["targets"], strict=True):
        assert entry.time_s - begin_s == pytest.approx(target["time_s"], abs=0.06)
        assert (entry.link, entry.frame.system) == (SENT_LINK, GROUND_STATION)
