"""Recordings of real PX4 rovers: what `pbpp log` tells of them is what pymavlink's own reader decodes."""

from __future__ import annotations

import hashlib
import json
import math
import re
import struct
import tomllib
from collections import Counter
from pathlib import Path

import pytest
from pymavlink import mavutil
from pyproj import Geod
from shapely import LineString, Polygon
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.logbook import read_logbook
from mavlink_bridge.logbook.log_situation import situation_from_log
from missions.vehicle.parameters import PARAMETERS, PX4_NAMES

FOLDER = Path(__file__).parents[3] / "sitl_logs" / "px4"
MANIFEST = tomllib.loads((FOLDER / "manifest.toml").read_text(encoding="utf-8"))
MODES = {(4, 3): "AUTO.LOITER", (4, 4): "AUTO.MISSION", (4, 5): "AUTO.RTL", (4, 6): "AUTO.LAND"}


class Decoded:
    """A recording by pymavlink's own reader, and what is concluded from it with nothing of ours."""

    def __init__(self, path):
        reader = mavutil.mavlink_connection(str(path))
        self.messages = []
        while (message := reader.recv_match()) is not None:
            self.messages.append(message)
        reader.close()
        self.vehicle = next(
            m.get_srcSystem() for m in self.messages if m.get_type() == "HEARTBEAT" and m.autopilot == 12
        )

    def of(self, *names):
        return [m for m in self.messages if m.get_srcSystem() == self.vehicle and m.get_type() in names]

    def parameters(self):
        found = {}
        for m in self.of("PARAM_VALUE"):
            bits = struct.pack("<f", m.param_value)
            found[m.param_id] = struct.unpack("<i" if m.param_type == 6 else "<f", bits)[0]
        return found

    def modes(self):
        found = []
        for m in self.of("HEARTBEAT"):
            mode = (MODES[m.custom_mode >> 16 & 255, m.custom_mode >> 24], bool(m.base_mode & 128))
            if not found or found[-1] != mode:
                found.append(mode)
        return found


WGS84 = Geod(ellps="WGS84")
ARDUPILOT = re.compile(
    r"ArduPilot|\b(FENCE|WP|ATC|AVOID|OA|RTL|FS)_[A-Z]+|GUIDED|Mission Planner|MAVProxy|with home"
)


@pytest.fixture(scope="module", params=sorted(MANIFEST))
def recording(request):
    path = FOLDER / MANIFEST[request.param]["file"]
    return request.param, path, Decoded(path)


def test_they_are_the_files_of_the_manifest(recording):
    name, path, _ = recording
    assert hashlib.sha256(path.read_bytes()).hexdigest() == MANIFEST[name]["sha256"]


def test_messages_modes_and_positions(recording):
    _, path, decoded = recording
    book = read_logbook(path)
    (vehicle,) = book.vehicles
    assert vehicle.system == decoded.vehicle
    told = Counter({(t.system, t.component, t.name): t.count for t in book.traffic})
    assert told == Counter((m.get_srcSystem(), m.get_srcComponent(), m.get_type()) for m in decoded.messages)
    assert [(span.name, span.armed) for span in vehicle.modes] == decoded.modes()
    assert vehicle.positions == len(decoded.of("GLOBAL_POSITION_INT"))
    last = decoded.of("GLOBAL_POSITION_INT")[-1]
    assert tuple(vehicle.situation.pose.value.position) == (
        pytest.approx(last.lat / 1e7, abs=1e-9),
        pytest.approx(last.lon / 1e7, abs=1e-9),
    )
    home = decoded.of("HOME_POSITION")[-1]
    assert tuple(vehicle.situation.home.value) == (home.latitude / 1e7, home.longitude / 1e7)


def test_parameters_by_their_bits(recording):
    _, path, decoded = recording
    situation = situation_from_log(path, None, any_vehicle=False, on_damage=pytest.fail)
    expected = decoded.parameters()
    assert dict(situation.parameters) == {
        name: value for name, value in expected.items() if math.isfinite(value)
    }
    assert not situation.no_numbers
    if "GF_ACTION" in expected:
        assert expected["GF_ACTION"] == 2


def test_the_lists_that_were_read_back():
    path = FOLDER / "upload-and-square.tlog"
    items = [m for m in Decoded(path).of("MISSION_ITEM_INT") if m.mission_type == 0]
    situation = situation_from_log(path, None, any_vehicle=False, on_damage=pytest.fail)
    mission = situation.mission.value
    assert mission.home is None  # there is no home item: the first one counts
    assert [(i.command, i.frame, i.lat_e7, i.lon_e7, i.alt_m) for i in mission.items] == [
        (m.command, m.frame, m.x, m.y, m.z) for m in items
    ]
    assert len(mission.items) == 6
    vertices = [m for m in Decoded(path).of("MISSION_ITEM_INT") if m.mission_type == 1]
    zones = situation.fence.value.zones
    assert [round(v.lat_deg * 1e7) for zone in zones for v in zone.vertices] == [m.x for m in vertices]


@pytest.mark.parametrize(
    ("name", "mission_items", "refused"),
    [
        ("upload-and-square", 6, []),
        ("fence-breach", 2, []),
        (
            "118-protocol",
            None,
            ["INVALID_PARAM3", "INVALID_PARAM4", "INVALID_PARAM5_X", "INVALID_PARAM7", "INVALID_PARAM2", "INVALID_PARAM1", "ERROR"],
        ),
    ],
)  # fmt: skip
def test_log_as_json(name, mission_items, refused):
    result = CliRunner().invoke(app, ["log", str(FOLDER / f"{name}.tlog"), "--json"])
    (vehicle,) = json.loads(result.stdout)["logs"][0]["vehicles"]
    assert result.exit_code == 0
    assert [one["result"] for one in vehicle["transfers"] if one["ending"] == "refused"] == refused
    if mission_items is not None:
        assert vehicle["mission_items"] == mission_items


def test_the_breach_is_where_the_vehicle_stopped():
    # Measured apart: the deepest point of the track inside the box of the fence uploaded at 1.7 s, 2.35 m at 3 m/s.
    (vehicle,) = read_logbook(FOLDER / "fence-breach.tlog").vehicles
    (intrusion,) = vehicle.intrusions
    assert intrusion.deepest_m == pytest.approx(2.3, abs=0.1)


def test_replay_and_plan_of_a_recording():
    log = str(FOLDER / "upload-and-square.tlog")
    replayed = CliRunner().invoke(app, ["replay", log])
    assert replayed.exit_code == 0
    assert "the fence changed: 2 zones" in replayed.stdout
    planned = CliRunner().invoke(app, ["plan", "--log", log, "--target", "47.3978,8.5462", "--json"])
    found = json.loads(planned.stdout)
    assert (planned.exit_code, found["system"]) == (0, 3)
    assert found["clearance_m"] == 1.0  # steered wheels, as they were measured
    assert any("keeps no margin" in text for text in found["info"])
    assert found["fence"]["vertices"] == 8


def test_types_are_those_that_px4_publishes(recording):
    _, _, decoded = recording
    for m in decoded.of("PARAM_VALUE"):
        if m.param_id in PX4_NAMES:
            assert m.param_type == (6 if PARAMETERS[m.param_id].is_whole else 9), m.param_id


def test_nothing_is_told_in_ardupilots_words(recording):
    _, path, decoded = recording
    for command in ("log", "replay"):
        assert not ARDUPILOT.findall(CliRunner().invoke(app, [command, str(path)]).output)
    (vehicle,) = json.loads(CliRunner().invoke(app, ["log", str(path), "--json"]).stdout)["logs"][0][
        "vehicles"
    ]
    shown = set(vehicle["parameters"])
    assert shown == {name for name in decoded.parameters() if name in PX4_NAMES}


def test_breaches_that_px4_reports(recording):
    name, path, decoded = recording
    texts = [m.text for m in decoded.of("STATUSTEXT") if m.text.startswith("Geofence: ")]
    (vehicle,) = read_logbook(path).vehicles
    assert (
        len(vehicle.reported_breaches)
        == len(texts)
        == {"fence-breach": 2, "118-rtl-through-fence": 1}.get(name, 0)
    )
    assert [one.count for one in vehicle.reported_breaches] == list(range(1, len(texts) + 1))
    (drawn,) = json.loads(CliRunner().invoke(app, ["log", str(path), "--json"]).stdout)["logs"][0]["vehicles"]
    assert len(drawn["reported_breaches"]) == len(texts)


def test_drives_are_graded_by_px4s_own_model():
    (square,) = read_logbook(FOLDER / "upload-and-square.tlog").vehicles
    (grade,) = square.grades
    assert (grade.arrived, grade.is_as_foreseen, grade.notes) == (True, True, ())  # of the measured kind
    (breach,) = read_logbook(FOLDER / "fence-breach.tlog").vehicles
    (grade,) = breach.grades
    assert len(grade.notes) == 1  # of 8 parameters
    assert grade.notes[0].startswith("the prediction is extrapolated: ")


def armed_track(decoded):
    """The track while armed, in pieces: latitude and longitude."""
    pieces, armed = [[]], False
    for m in decoded.of("HEARTBEAT", "GLOBAL_POSITION_INT"):
        if m.get_type() == "HEARTBEAT":
            if armed and not m.base_mode & 128:
                pieces.append([])
            armed = bool(m.base_mode & 128)
        elif armed:
            pieces[-1].append((m.lat / 1e7, m.lon / 1e7))
    return [piece for piece in pieces if len(piece) > 1]


def test_driven_is_the_length_of_the_track(recording):
    _, path, decoded = recording
    length_m = sum(
        WGS84.line_length([lon for _, lon in piece], [lat for lat, _ in piece])
        for piece in armed_track(decoded)
    )
    (vehicle,) = read_logbook(path).vehicles
    assert vehicle.driven_m == pytest.approx(
        length_m, abs=0.02 * length_m + 0.2
    )  # from a heartbeat to a heartbeat


def test_the_least_clearance_is_what_shapely_measures():
    decoded = Decoded(FOLDER / "upload-and-square.tlog")
    vertices = [m for m in decoded.of("MISSION_ITEM_INT") if m.mission_type == 1]
    lat_deg, lon_deg = vertices[0].x / 1e7, vertices[0].y / 1e7
    east_m = (
        WGS84.inv(lon_deg, lat_deg, lon_deg + 1e-3, lat_deg)[2] / 1e-3
    )  # of a degree; the field is 40 m wide
    north_m = WGS84.inv(lon_deg, lat_deg, lon_deg, lat_deg + 1e-3)[2] / 1e-3

    def plane(lat, lon):
        return (lon - lon_deg) * east_m, (lat - lat_deg) * north_m

    rings, start = [], 0
    while start < len(vertices):
        count = int(vertices[start].param1)
        rings.append(Polygon([plane(m.x / 1e7, m.y / 1e7) for m in vertices[start : start + count]]))
        start += count
    track = LineString([plane(*place) for piece in armed_track(decoded) for place in piece])
    least_m = min(ring.exterior.distance(track) for ring in rings)
    (vehicle,) = read_logbook(FOLDER / "upload-and-square.tlog").vehicles
    assert vehicle.nearest.clearance_m == pytest.approx(least_m, abs=0.01)
