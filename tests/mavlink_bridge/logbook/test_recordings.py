"""What the logbook tells of our recordings, against their manifest and other ways to measure."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from pyproj import Geod
from shapely import Point, Polygon

from mavlink_bridge.logbook import Ending, Way, read_logbook
from mavlink_bridge.mavlink.messages import GlobalPositionInt
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.tlog import read_columns
from missions.fence import CircleZone, PolygonZone, ZoneKind
from missions.formats import read_fence
from missions.situation import ListKind

FOLDER = Path(__file__).parents[3] / "sitl_logs"
MANIFEST = tomllib.loads((FOLDER / "manifest.toml").read_text(encoding="utf-8"))
HOME = MANIFEST.pop("origin")["home"]
FIELD = {name: name.rpartition("-")[2] for name in MANIFEST} | {
    "union-rally": "union",
    "island-unreachable": "island",
    "fence-change-yard": "yard2",
}
M_PER_DEG = 111_195.0


@pytest.fixture(scope="module", params=sorted(MANIFEST))
def recording(request):
    return request.param, MANIFEST[request.param], read_logbook(FOLDER / f"{request.param}.tlog")


def local(places_deg):
    """Return places in a flat frame of our own, good to centimetres on such fields."""
    array = np.asarray(places_deg, dtype=float).reshape(-1, 2) - (HOME["lat_deg"], HOME["lon_deg"])
    return np.column_stack((array[:, 1] * np.cos(np.radians(HOME["lat_deg"])), array[:, 0])) * M_PER_DEG


def test_the_facts_of_the_manifest(recording):
    _, facts, book = recording
    (vehicle,) = book.vehicles
    # The manifest counts to the last message of ours, the logbook to the last of all.
    assert book.duration_s == pytest.approx(facts["duration_s"], abs=0.3)
    assert book.damage.frames == facts["frames"] == sum(traffic.count for traffic in book.traffic)
    assert (vehicle.positions, vehicle.positions_without_fix) == (
        facts["positions"],
        facts["positions_without_fix"],
    )
    assert vehicle.parameters.seen == facts["parameters"]
    modes = [span.mode for span in vehicle.modes]
    assert [mode for mode, before in zip(modes, [None, *modes[:-1]], strict=True) if mode != before] == facts[
        "modes"
    ]
    assert {span.name for span in vehicle.modes} == {Mode(mode).name for mode in modes}
    assert [
        (round(target.time_s, 1), *np.round(np.array(target.position) * 1e7)) for target in vehicle.targets
    ] == [
        (pytest.approx(target["time_s"], abs=0.11), target["lat_e7"], target["lon_e7"])
        for target in facts["targets"]
    ]


def test_every_list_went_over_twice_and_whole(recording):
    _, facts, book = recording
    (vehicle,) = book.vehicles
    for kind, key in (
        (ListKind.FENCE, "fence_items"),
        (ListKind.MISSION, "mission_items"),
        (ListKind.RALLY, "rally_points"),
    ):
        found = [transfer for transfer in vehicle.transfers if transfer.kind is kind]
        assert [transfer.way for transfer in found] == [Way.UPLOAD, Way.READ_BACK] * len(facts[key])
        assert [transfer.seen for transfer in found[::2]] == facts[key]
        assert {transfer.ending for transfer in found} <= {Ending.COMPLETE}
        assert {transfer.station for transfer in found} <= {(255, 230)}
    assert len(vehicle.fences) == len(facts["fence_items"])


def test_the_least_clearance_by_another_way(recording, fields):
    name, _, book = recording
    (vehicle,) = book.vehicles
    if vehicle.nearest is None:
        assert not vehicle.fences or not any(span.armed for span in vehicle.modes)
        return
    position = Point(local([vehicle.nearest.position])[0])
    distances_m = [
        _distance_m(zone, position) for zone in read_fence(fields / f"{FIELD[name]}-fence.waypoints").zones
    ]
    assert vehicle.nearest.clearance_m == pytest.approx(max(0.0, min(distances_m)), abs=0.3)


def _distance_m(zone, position):
    if isinstance(zone, CircleZone):
        return position.distance(Point(local([zone.centre])[0])) - zone.radius_m
    assert isinstance(zone, PolygonZone)
    ring = Polygon(local(zone.vertices))
    return ring.distance(position) if zone.kind is ZoneKind.EXCLUSION else ring.exterior.distance(position)


def test_the_distance_driven_by_another_way(recording):
    name, facts, book = recording
    (vehicle,) = book.vehicles
    columns = read_columns(FOLDER / facts["file"], GlobalPositionInt)
    armed_s = next((span.begun_s for span in vehicle.modes if span.armed), np.inf)
    driven = (columns["lat"] != 0) & (columns["time_s"] - book.begins_s >= armed_s)
    lats, lons = columns["lat"][driven] / 1e7, columns["lon"][driven] / 1e7
    length_m = Geod(ellps="WGS84").line_length(lons, lats) if len(lats) else 0.0
    assert vehicle.driven_m == pytest.approx(length_m, abs=max(0.5, 0.02 * length_m)), name


def test_what_happened_in_some(recording):
    name, _, book = recording
    (vehicle,) = book.vehicles
    if name == "mission-yard":
        (intrusion,) = vehicle.intrusions
        assert intrusion.deepest_m == pytest.approx(5.4, abs=0.3)
        assert vehicle.nearest.clearance_m == 0.0
        assert [part.mode for part in vehicle.track] == ["AUTO", "HOLD"]
        assert vehicle.situation.mission.value.items[-1].position == (40.0720926, -105.2286152)
    else:
        assert vehicle.intrusions == ()
        assert vehicle.grades == ()
    if name == "union-rally":
        assert [(change.name, change.after) for change in vehicle.parameters.changes][-2:] == [
            ("FENCE_OPTIONS", 2.0),
            ("FENCE_TYPE", 4.0),
        ]
    assert vehicle.reported_breaches == ()
    assert (book.clock_jumps, book.has_timestamps) == (0, True)
