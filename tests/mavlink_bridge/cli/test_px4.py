"""Recordings of PX4 rovers: their parameters are read as PX4 sends them, and what would be a false claim is refused."""

from __future__ import annotations

import json
import struct
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.tlog import TlogWriter

if TYPE_CHECKING:
    from pathlib import Path

INT32, REAL32 = 6, 9
CORNERS = [(48.1, 11.5), (48.101, 11.5), (48.101, 11.501), (48.1, 11.501)]
TARGET = "48.1008,11.5008"
PARAMETERS = [
    ("CA_AIRFRAME", INT32, 6),
    ("GF_ACTION", INT32, 2),
    ("RA_WHEEL_BASE", REAL32, 0.5),
    ("RD_TRANS_DRV_TRN", REAL32, 0.1),
    ("RO_SPEED_LIM", REAL32, 1.5),
    ("NAV_ACC_RAD", REAL32, 0.5),
    ("GF_MAX_HOR_DIST", REAL32, 0.0),
]


def told(kind: int, value: float) -> float:
    return struct.unpack("<f", struct.pack("<i", value))[0] if kind == INT32 else value


def px4_log(path: Path, parameters=PARAMETERS, *, waypoints=((48.1002, 11.5005), (48.1008, 11.5005))) -> Path:
    """A PX4 rover's log: INT32 sent bytewise, a fence and a mission read back (without a home item), a place."""
    heartbeat = m.Heartbeat(10, 12, 0x51, 0x04040000, 4)
    own: list[m.Message] = [
        heartbeat,
        m.AutopilotVersion(0xE8FF, 0x011100FF),
        m.ParamValue("GF_ACTION", told(INT32, 3), INT32, 7, 0),
        *(m.ParamValue(name, told(kind, value), kind, 7, 0) for name, kind, value in parameters),
    ]
    for mission_type, command, places in ((1, 5001, CORNERS), (0, 16, waypoints)):
        own.append(m.MissionCount(255, 190, len(places), mission_type))
        own += [
            m.MissionItemInt(
                255, 190, n, 0, command, 0, 1, 4.0 if mission_type else 0.0, 0, 0, 0, round(lat * 1e7), round(lon * 1e7), 0, mission_type
            )
            for n, (lat, lon) in enumerate(places)
        ]  # fmt: skip
    own += [heartbeat, m.GlobalPositionInt(0, 481_005_000, 115_005_000)]
    codec = Codec(1, 1)
    with TlogWriter(path) as log:
        for number, message in enumerate(own):
            log.write(1.79e9 + number / 10, codec.encode(message))
    return path


def run(*arguments: object) -> tuple[int, dict[str, Any]]:
    result = CliRunner().invoke(app, [*map(str, arguments), "--json"])
    return result.exit_code, json.loads(result.stdout)


def test_whole_numbers_are_read_as_px4_sends_them(tmp_path: Path) -> None:
    code, found = run("plan", "--log", px4_log(tmp_path / "px4.tlog"), "--target", TARGET)
    assert code == 0
    assert not any("does not enforce this fence" in text for text in found["warnings"])  # GF_ACTION 2
    assert not any("CA_AIRFRAME" in text for text in found["warnings"])
    assert any("skid-steered rovers were not measured with PX4" in text for text in found["warnings"])


def test_the_log_tells_them_too(tmp_path: Path) -> None:
    code, found = run("log", px4_log(tmp_path / "px4.tlog"))
    assert code == 0
    (vehicle,) = found["vehicles"] if "vehicles" in found else found["logs"][0]["vehicles"]
    parameters = vehicle["parameters"]
    assert {name: parameters[name] for name in ("GF_ACTION", "NAV_ACC_RAD")} == {
        "GF_ACTION": 2.0,
        "NAV_ACC_RAD": 0.5,
    }
    (change,) = vehicle["parameter_changes"]
    assert (change["name"], change["before"], change["after"]) == ("GF_ACTION", 3.0, 2.0)


def test_a_px4_rover_that_told_no_parameters_is_no_ardupilot(tmp_path: Path) -> None:
    code, found = run("plan", "--log", px4_log(tmp_path / "px4.tlog", []), "--target", TARGET)
    assert code == 0
    assert any("RA_WHEEL_BASE 0.5 m was not measured with PX4" in text for text in found["warnings"])


@pytest.mark.parametrize("command", [("check", "--log"), ("plan", "--via-mission", "own", "--log")])
def test_of_its_mission_nothing_is_claimed(tmp_path: Path, command: tuple[str, ...]) -> None:
    code, found = run(*command, log := px4_log(tmp_path / "px4.tlog"))
    assert (code, found["error"]) == (3, "LogError")
    assert found["message"] == (
        f"{log}: the autopilot of system 1 is not ArduPilot: its mission in a log is not used; give it as a file (--mission)"
    )


FENCE = {
    "version": 2,
    "polygons": [{"inclusion": True, "polygon": CORNERS, "version": 1}],
    "circles": [],
}
MEASURED = """# Stack: PX4 Pro
# Version: 1.17.0
CA_AIRFRAME 5
NAV_ACC_RAD 0.5
RA_ACC_RAD_MAX 3
RA_ACC_RAD_GAIN 2
RA_WHEEL_BASE 0.321
RA_MAX_STR_ANG 0.5236
RO_SPEED_LIM 2
RO_MAX_THR_SPEED 3.2
RO_ACCEL_LIM 3
RO_DECEL_LIM 3
RO_JERK_LIM 10
RO_SPEED_RED 1
PP_LOOKAHD_GAIN 1
PP_LOOKAHD_MIN 1
PP_LOOKAHD_MAX 10
GF_ACTION 2
"""


def fence_plan(path: Path, firmware: int) -> Path:
    mission = {
        "version": 2,
        "firmwareType": firmware,
        "vehicleType": 10,
        "items": [],
        "plannedHomePosition": [48.1002, 11.5002, 0],
    }
    path.write_text(json.dumps({"fileType": "Plan", "version": 1, "mission": mission, "geoFence": FENCE}))
    return path


@pytest.mark.parametrize(
    ("firmware", "parameters", "says_px4", "told", "clearance_m"),
    [
        (12, None, True, "assuming PX4, as ", None),
        (12, MEASURED, True, None, 1.0),
        (3, MEASURED, True, "is made for ArduPilot (firmwareType), but the vehicle is PX4", 1.0),
        (3, None, False, None, 2.5),
        (12, "WP_SPEED 2\n", False, "is made for PX4 (firmwareType), but the vehicle is ArduPilot", 2.5),
    ],
)
def test_for_whom_a_plan_of_files_is_made(
    tmp_path: Path, firmware, parameters, says_px4, told, clearance_m
) -> None:
    arguments: list[object] = [
        "plan",
        "--fence",
        fence_plan(tmp_path / "field.plan", firmware),
        "--start",
        "48.1002,11.5002",
    ]
    arguments += ["--target", TARGET, "-o", tmp_path / "mission.plan"]
    if parameters is not None:
        (tmp_path / "rover.params").write_text(parameters)
        arguments += ["--vehicle", tmp_path / "rover.params"]
    code, found = run(*arguments)
    assert (code, found["clearance_m"]) == (0, clearance_m)
    assert any("PX4 keeps no margin" in text for text in found["info"]) == says_px4
    made = [text for text in found["warnings"] if "firmwareType" in text]
    assert len(made) == (told is not None)
    assert told is None or told in made[0]
    written = json.loads((tmp_path / "mission.plan").read_text())["mission"]
    assert (written["firmwareType"], written["vehicleType"]) == (12 if says_px4 else 3, 10)
    code, checked = run("check", "--mission", tmp_path / "mission.plan", *arguments[9:])
    assert (
        any("PX4 keeps no margin" in text for text in checked["info"]) == says_px4
    )  # its own plan says the same


def test_a_mission_of_px4_is_counted_without_home(tmp_path: Path) -> None:
    (tmp_path / "rover.params").write_text(MEASURED)
    plan = tmp_path / "mission.plan"
    assert run("plan", "--fence", fence_plan(tmp_path / "field.plan", 12), "--vehicle", tmp_path / "rover.params", "--start", "48.1002,11.5002", "--target", TARGET, "-o", plan)[0] == 0  # fmt: skip
    checked = CliRunner().invoke(
        app, ["check", "--mission", str(plan), "--vehicle", str(tmp_path / "rover.params")]
    )
    assert "1 mission item\n" in checked.output
    assert run("check", "--mission", plan, "--vehicle", tmp_path / "rover.params")[1]["mission_items"] == 1
    converted = CliRunner().invoke(app, ["convert", str(plan), str(tmp_path / "mission.geojson")])
    assert "1 mission item," in converted.output
    document = json.loads(plan.read_text())
    document["mission"]["items"] *= 501
    for number, one in enumerate(document["mission"]["items"]):
        one["params"][4] += 1e-6 * (number % 2)
    plan.write_text(json.dumps(document))
    _, found = run("check", "--mission", plan, "--vehicle", tmp_path / "rover.params")
    assert (
        "501 mission items; the vehicle holds 500 (or 1000, depending on the board; no parameter tells which)"
        in found["warnings"]
    )


@pytest.mark.parametrize(
    ("text", "is_told"), [("WP_SPEED 2\n", True), (MEASURED, False), ("BATT_MONITOR 4\n", False)]
)
def test_parameters_of_another_autopilot_than_the_logs_vehicle_are_said(
    tmp_path: Path, text: str, *, is_told: bool
) -> None:
    (tmp_path / "rover.parm").write_text(text)
    log = px4_log(tmp_path / "px4.tlog")
    result = CliRunner().invoke(
        app, ["plan", "--log", str(log), "--target", TARGET, "--vehicle", str(tmp_path / "rover.parm")]
    )
    assert result.exit_code == 0
    told = "--vehicle holds ArduPilot's parameters, but the vehicle is PX4, to which they mean nothing"
    assert (told in result.stderr) == is_told
