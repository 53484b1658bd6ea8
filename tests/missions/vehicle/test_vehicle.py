from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.drive_model import beyond_measured
from missions.errors import VehicleError
from missions.firmware import Firmware, firmware_from_number, read_firmware
from missions.promise import known_vehicle
from missions.request import GoTo
from missions.situation import MadeFor, Reading, Situation
from missions.vehicle import (
    Autopilot,
    FenceParameters,
    Footprint,
    Pursuit,
    Steering,
    Vehicle,
    known_ardupilot,
    known_type,
    vehicle_from_parameters,
    whole_number,
)
from missions.vehicle.asked_parameters import PX4_ASKED_NAMES
from missions.vehicle.item_limit import most_items, most_own_items, storage_remarks
from missions.vehicle.parameter_remarks import (
    assumed_remarks,
    made_for_remarks,
    parameter_remarks,
    range_remarks,
)
from missions.vehicle.parameters import PARAMETER_NAMES, PARAMETERS, PX4_NAMES, Range

SKID = {"SERVO1_FUNCTION": 73, "SERVO3_FUNCTION": 74}
ACKERMANN = {"SERVO1_FUNCTION": 26, "SERVO3_FUNCTION": 70}
KNOWN = {
    "WP_RADIUS": 3.0,
    "WP_SPEED": 5.0,
    "WP_ACCEL": 0.8,
    "WP_JERK": 0.5,
    "WP_PIVOT_ANGLE": 45.0,
    "WP_PIVOT_RATE": 30.0,
    "CRUISE_SPEED": 4.0,
    "TURN_RADIUS": 1.5,
    "ATC_TURN_MAX_G": 0.3,
    "ATC_ACCEL_MAX": 2.0,
    "PSC_POS_P": 0.4,
    "FENCE_ENABLE": 1,
    "FENCE_TYPE": 4,
    "FENCE_MARGIN": 1.0,
    "FENCE_RADIUS": 150.0,
    "FENCE_OPTIONS": 3,
    "FENCE_ACTION": 2,
    "AVOID_ENABLE": 1,
    "AVOID_BACKUP_SPD": 0.0,
    "OA_TYPE": 2,
    **ACKERMANN,
}


def test_a_vehicle_whose_parameters_are_all_known() -> None:
    assert vehicle_from_parameters({**KNOWN, "BATT_MONITOR": 4.0}, mav_type=10) == Vehicle(
        waypoint_radius_m=3.0,
        speed_mps=5.0,
        turn_radius_m=1.5,
        turn_max_g=0.3,
        accel_max_mps2=0.8,
        jerk_mps3=0.5,
        position_gain_per_s=0.4,
        pivot_angle_deg=45.0,
        pivot_rate_dps=30.0,
        steering=Steering.ACKERMANN,
        autopilot=Autopilot.ARDUPILOT,
        fence=FenceParameters(
            enabled=True,
            type_bits=4,
            margin_m=1.0,
            radius_m=150.0,
            union=True,
            action=2,
            avoid_bits=1,
            oa_type=2,
            backs_away=False,
        ),
        assumed=(),
        mav_type=10,
        has_measured_corners=None,
    )


def test_what_is_not_known_is_told_with_the_default_used() -> None:
    vehicle = vehicle_from_parameters({})
    assert {str(one) for one in vehicle.assumed} >= {
        "WP_RADIUS unknown; assuming 2",
        "WP_SPEED unknown; assuming 2",
        "TURN_RADIUS unknown; assuming 0.9",
        "SERVO1_FUNCTION unknown; assuming 26",
        "FENCE_ENABLE unknown; assuming 0",
        "firmware unknown; assuming 4.6",
    }
    assert vehicle == Vehicle(assumed=vehicle.assumed, pivot_angle_deg=0.0)


@given(st.sets(st.sampled_from(sorted(KNOWN))))
def test_exactly_the_missing_ones_are_assumed(missing: set[str]) -> None:
    parameters = {name: value for name, value in KNOWN.items() if name not in missing}
    assumed = {one.parameter for one in vehicle_from_parameters(parameters).assumed}
    silent = {
        "CRUISE_SPEED",
        "firmware",
        *ACKERMANN,
    }  # matter only where WP_SPEED, or the other output, is not there
    assert assumed - silent == missing - silent


@pytest.mark.parametrize(
    ("parameters", "speed_mps", "accel_mps2", "jerk_mps3"),
    [
        ({"WP_SPEED": 0, "CRUISE_SPEED": 3}, 3, 1, 1),
        ({"CRUISE_SPEED": 3}, 3, 1, 1),
        ({"WP_SPEED": 0}, 2, 1, 1),
        ({"WP_SPEED": 1.5, "CRUISE_SPEED": 3}, 1.5, 1, 1),
        ({"WP_ACCEL": 0, "ATC_ACCEL_MAX": 0.7}, 2, 0.7, 0.7),
        ({"WP_ACCEL": 2, "ATC_ACCEL_MAX": 0.7}, 2, 0.7, 0.7),
        ({"ATC_ACCEL_MAX": 1.5, "ATC_DECEL_MAX": 0.5}, 2, 0.5, 0.5),
        ({"ATC_ACCEL_MAX": 0}, 2, 20, 20),
        ({"WP_JERK": 0.4}, 2, 1, 0.4),
    ],
)
def test_zero_means_what_it_means_to_ardupilot(
    parameters: dict[str, float], speed_mps: float, accel_mps2: float, jerk_mps3: float
) -> None:
    vehicle = vehicle_from_parameters(parameters)
    assert (vehicle.speed_mps, vehicle.accel_max_mps2, vehicle.jerk_mps3) == (
        speed_mps,
        accel_mps2,
        jerk_mps3,
    )


@pytest.mark.parametrize(
    ("functions", "steering"),
    [
        (SKID, Steering.SKID),
        ({"SERVO16_FUNCTION": 73, "SERVO32_FUNCTION": 74}, Steering.SKID),
        (ACKERMANN, Steering.ACKERMANN),
        ({"SERVO1_FUNCTION": 73}, Steering.ACKERMANN),
        ({}, Steering.ACKERMANN),
    ],
)
def test_steering_from_the_outputs(functions: dict[str, float], steering: Steering) -> None:
    vehicle = vehicle_from_parameters({"WP_PIVOT_ANGLE": 60, **functions})
    assert vehicle.steering is steering
    assert vehicle.can_pivot is (steering is Steering.SKID)


def test_no_pivot_angle_no_pivots() -> None:
    assert not vehicle_from_parameters({**SKID, "WP_PIVOT_ANGLE": 0}).can_pivot


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"WP_RADIUS": -1.0}, "WP_RADIUS is -1; allowed: 0 to 1000"),
        ({"WP_SPEED": math.nan}, "WP_SPEED is nan, which is not a number"),
        ({"PSC_POS_P": 0.0}, "PSC_POS_P is 0; allowed: 0.01 to 100"),
        ({"WP_SPEED": 0.0, "CRUISE_SPEED": 0.0}, "would not move"),
        ({"RA_MAX_STR_ANG": 1.6}, "RA_MAX_STR_ANG is 1.6 rad"),
        ({"RA_MAX_STR_ANG": math.inf}, "RA_MAX_STR_ANG is inf"),
    ],
)
def test_impossible_values_are_refused_by_name(parameters: dict[str, float], message: str) -> None:
    with pytest.raises(VehicleError, match=message):
        vehicle_from_parameters(parameters)


@pytest.mark.parametrize(
    ("changes", "stops_within_m"),
    [
        ({}, 1.0),
        ({"FENCE_ENABLE": 0}, 0.0),
        ({"FENCE_TYPE": 2}, 0.0),
        ({"AVOID_ENABLE": 2}, 0.0),
    ],
)
def test_it_stops_within_the_margin_of_a_fence_that_it_avoids(
    changes: dict[str, float], stops_within_m: float
) -> None:
    assert vehicle_from_parameters({**KNOWN, **changes}).stops_within_m == stops_within_m


def test_the_circle_about_home() -> None:
    assert FenceParameters(enabled=True).enforces_home_circle
    assert not FenceParameters(enabled=True, type_bits=4).enforces_home_circle
    assert not FenceParameters(enabled=True, radius_m=0.0).enforces_home_circle


@pytest.mark.parametrize(("mav_type", "is_rover"), [(None, True), (10, True), (11, True), (2, False)])
def test_rovers_and_boats(mav_type: int | None, is_rover: bool) -> None:
    assert vehicle_from_parameters({}, mav_type=mav_type).is_rover is is_rover


def test_px4_with_steered_wheels() -> None:
    vehicle = vehicle_from_parameters(
        {
            "NAV_ACC_RAD": 0.5,
            "RA_ACC_RAD_MAX": 3.0,
            "RA_WHEEL_BASE": 0.321,
            "RA_MAX_STR_ANG": 0.5236,
            "RO_SPEED_LIM": 3.0,
            "RO_ACCEL_LIM": 3.0,
            "RO_DECEL_LIM": 6.0,
            "RO_JERK_LIM": -1.0,
            "GF_ACTION": 0,
            "GF_MAX_HOR_DIST": 100.0,
        }
    )
    assert vehicle.autopilot is Autopilot.PX4
    assert vehicle.steering is Steering.ACKERMANN
    assert vehicle.waypoint_radius_m == 3.0
    assert vehicle.turn_radius_m == pytest.approx(0.321 / math.tan(0.5236))
    assert (vehicle.speed_mps, vehicle.accel_max_mps2, vehicle.jerk_mps3) == (3.0, 3.0, 20.0)
    assert not vehicle.fence.enabled
    assert vehicle.fence.radius_m == 100.0
    assert vehicle.stops_within_m == 0.0
    assert vehicle.pursuit == Pursuit(acceptance_gain=1.0, full_speed_mps=None, speed_reduction=-1.0)
    assert {one.parameter for one in vehicle.assumed} == {
        "RA_ACC_RAD_GAIN", "RO_SPEED_RED", "PP_LOOKAHD_GAIN", "PP_LOOKAHD_MIN", "PP_LOOKAHD_MAX",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("parameters", "steering", "assumed"),
    [
        ({"RD_WHEEL_TRACK": 0.3}, Steering.SKID, False),
        ({"RD_WHEEL_TRACK": 0.3, "RA_WHEEL_BASE": 0.3}, Steering.ACKERMANN, True),
        ({"RD_WHEEL_TRACK": 0.3, "RA_WHEEL_BASE": 0.3, "CA_AIRFRAME": 6}, Steering.SKID, False),
        ({"RD_WHEEL_TRACK": 0.3, "RA_WHEEL_BASE": 0.3, "CA_AIRFRAME": 5}, Steering.ACKERMANN, False),
        ({"NAV_ACC_RAD": 0.5}, Steering.ACKERMANN, True),
    ],
)
def test_px4_steering(parameters: dict[str, float], steering: Steering, assumed: bool) -> None:
    vehicle = vehicle_from_parameters(parameters)
    assert vehicle.steering is steering
    assert any(one.parameter == "CA_AIRFRAME" for one in vehicle.assumed) is assumed


def test_px4_differential() -> None:
    vehicle = vehicle_from_parameters(
        {"RD_TRANS_DRV_TRN": math.radians(10), "RD_MISS_SPD_DEF": 1.5, "NAV_ACC_RAD": 0.5}
    )
    assert (vehicle.waypoint_radius_m, vehicle.turn_radius_m, vehicle.speed_mps) == (0.5, 0.0, 1.5)
    assert vehicle.pivot_angle_deg == pytest.approx(10)
    assert vehicle.can_pivot


def test_ardupilot_wins_where_names_of_both_are_there() -> None:
    assert vehicle_from_parameters({"WP_RADIUS": 1.0, "RA_WHEEL_BASE": 1.0}).autopilot is Autopilot.ARDUPILOT


def test_footprint() -> None:
    footprint = Footprint(length_m=2.0, width_m=1.0, gps_forward_m=0.5, gps_right_m=-0.1)
    assert footprint.half_width_m == pytest.approx(0.6)
    assert footprint.swept_radius_m == pytest.approx(math.hypot(1.5, 0.6))
    assert Footprint().swept_radius_m == 0.0


@pytest.mark.parametrize("sizes", [(-1.0, 1.0), (1.0, math.nan), (math.inf, 1.0)])
def test_a_footprint_that_is_none(sizes: tuple[float, float]) -> None:
    with pytest.raises(VehicleError, match="footprint"):
        Footprint(*sizes)


@pytest.mark.parametrize("value", [1e38, -1.0, 32_768.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["FENCE_TYPE", "FENCE_OPTIONS", "FENCE_ACTION", "AVOID_ENABLE", "OA_TYPE"])
def test_a_bit_mask_or_enumeration_that_is_none_is_refused(name: str, value: float) -> None:
    with pytest.raises(VehicleError, match=f"{name} is .*(allowed: 0 to 32767|not a number)"):
        vehicle_from_parameters({name: value})


@pytest.mark.parametrize("value", [1e38, -1.0, math.nan, math.inf])
@pytest.mark.parametrize(
    "name",
    [
        *("WP_SPEED", "WP_RADIUS", "TURN_RADIUS", "ATC_TURN_MAX_G", "ATC_ACCEL_MAX", "ATC_DECEL_MAX", "WP_ACCEL", "WP_JERK"),
        *("PSC_POS_P", "FENCE_MARGIN", "FENCE_MARGIN_XY", "FENCE_RADIUS", "AVOID_BACKUP_SPD", "WP_PIVOT_RATE"),
    ],
)  # fmt: skip
def test_a_quantity_that_is_none_is_refused(name: str, value: float) -> None:
    with pytest.raises(VehicleError, match=f"{name} is .*(allowed:|not a number)"):
        vehicle_from_parameters({name: value})


def test_whole_numbers_are_rounded_as_ardupilot_rounds_them() -> None:
    assert vehicle_from_parameters({"FENCE_TYPE": 5.9}).fence.type_bits == 6
    assert whole_number({"A": 2.4}, "A", 7) == 2
    assert whole_number({}, "A", 7) == 7


@pytest.mark.parametrize(
    ("parameters", "margin_m", "name"),
    [
        ({"FENCE_MARGIN": 3.0}, 3.0, "FENCE_MARGIN"),
        ({"FENCE_MARGIN": 3.0, "FENCE_MARGIN_XY": 0.0}, 3.0, "FENCE_MARGIN"),
        ({"FENCE_MARGIN": 3.0, "FENCE_MARGIN_XY": 0.5}, 0.5, "FENCE_MARGIN_XY"),
        ({"FENCE_MARGIN": 0.0, "FENCE_MARGIN_XY": 5.0}, 5.0, "FENCE_MARGIN_XY"),
    ],
)
def test_the_margin_of_horizontal_fences(parameters: dict[str, float], margin_m: float, name: str) -> None:
    vehicle = vehicle_from_parameters({**KNOWN, **parameters})
    assert (vehicle.fence.margin_m, vehicle.fence.margin_name) == (margin_m, name)
    assert vehicle.stops_within_m == margin_m


@pytest.mark.parametrize(
    ("told", "firmware", "pivot_angle_deg"),
    [
        ({}, None, 0.0),
        ({}, Firmware(4, 5, 7), 60.0),
        ({}, Firmware(4, 6, 3), 60.0),
        ({}, Firmware(4, 7, 0, 0), 0.0),
        ({}, Firmware(4, 7), 0.0),
        ({"WP_PIVOT_ANGLE": 45.0}, None, 45.0),
        ({"WP_PIVOT_ANGLE": 45.0}, Firmware(4, 7), 45.0),
    ],
)
def test_what_a_skid_steered_rover_pivots_at_where_nobody_told(
    told: dict[str, float], firmware: Firmware | None, pivot_angle_deg: float
) -> None:
    vehicle = vehicle_from_parameters({**SKID, **told}, firmware=firmware)
    assert vehicle.pivot_angle_deg == pivot_angle_deg
    said = [text for text in assumed_remarks(vehicle) if "WP_PIVOT_ANGLE unknown; assuming 0" in text]
    assert bool(said) is (pivot_angle_deg == 0)


@pytest.mark.parametrize(
    ("parameters", "slowest_mps", "said"),
    [
        ({"WP_SPEED": 1.0}, None, False),
        ({"WP_SPEED": 0.9}, None, True),
        ({"WP_SPEED": 2.0}, 0.5, True),
        ({"WP_SPEED": 0.5, **SKID}, None, False),
    ],
)
def test_slow_steered_rovers_were_not_measured(
    parameters: dict[str, float], slowest_mps: float | None, said: bool
) -> None:
    texts = beyond_measured(vehicle_from_parameters(parameters), slowest_mps)
    assert any("steered rovers below 1 m/s were not measured" in text for text in texts) is said


@pytest.mark.parametrize(
    ("firmware", "told", "has_measured_corners"),
    [
        (None, {}, None),
        (None, {"FENCE_NTF_FREQ": 1.0}, True),
        (Firmware(4, 5, 7), {}, False),
        (Firmware(4, 6, 0, 0), {}, False),
        (Firmware(4, 6, 0, 128 + 5), {}, False),
        (Firmware(4, 6, 0, 128 + 6), {}, True),
        (Firmware(4, 6), {}, True),
        (Firmware(4, 7, 0, 0), {}, None),
        (Firmware(4, 7, 0, 0), {"FENCE_NTF_FREQ": 0.0}, True),
        (Firmware(4, 7, 0, 128), {}, True),
        (Firmware(4, 7), {}, True),
        (Firmware(4, 8, 0, 0), {}, True),
    ],
)
def test_which_firmware_has_the_corners_that_were_measured(
    firmware: Firmware | None, told: dict[str, float], has_measured_corners: bool | None
) -> None:
    vehicle = vehicle_from_parameters({"WP_SPEED": 2.0, **told}, firmware=firmware)
    assert vehicle.has_measured_corners is has_measured_corners
    said = beyond_measured(replace(vehicle, turn_radius_m=0.5))
    assert bool(said) is (has_measured_corners is False)
    assert all("TURN_RADIUS 0.5 m was not measured before ArduPilot 4.6 (only 0.9)" in text for text in said)


@pytest.mark.parametrize(
    ("text", "firmware"),
    [
        ("4.5", Firmware(4, 5)),
        ("4.5.7", Firmware(4, 5, 7)),
        ("V4.6.0-beta6", Firmware(4, 6, 0, 134)),
        (" 4.7.0-dev ", Firmware(4, 7, 0, 0)),
        ("4.6.1-rc1", Firmware(4, 6, 1, 193)),
    ],
)
def test_a_version_reads_back_as_written(text: str, firmware: Firmware) -> None:
    assert read_firmware(text) == firmware == read_firmware(str(firmware))


@pytest.mark.parametrize("text", ["", "4", "4.x", "ArduRover V4.5", "4.5.6.7", "444.1"])
def test_what_is_no_version_is_refused(text: str) -> None:
    with pytest.raises(VehicleError, match="is not a firmware version"):
        read_firmware(text)


@given(*(st.integers(0, 255) for _ in range(4)))
def test_versions_are_in_the_order_of_their_numbers(major: int, minor: int, patch: int, stage: int) -> None:
    number = (major << 24) + (minor << 16) + (patch << 8) + stage
    firmware, next_one = firmware_from_number(number), firmware_from_number(number + 1)
    assert (firmware is None) is (number == 0)
    assert firmware is None or (next_one or Firmware(256, 0)) > firmware or number == 2**32 - 1


def published(name: str = "ardupilot_parameters.csv") -> list[dict[str, str]]:
    text = (Path(__file__).parent / "data" / name).read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


@pytest.mark.parametrize("row", published(), ids=lambda row: row["name"])
def test_the_table_is_as_ardupilot_published_it(row: dict[str, str]) -> None:
    found = PARAMETERS[row["name"]]
    assert found.autopilot is Autopilot.ARDUPILOT
    assert found.since == (None if row["since"] == "4.4" else Firmware(4, 7, 0, 0))
    if found.documented is not None or row["least"]:
        assert found.documented == Range(float(row["least"]), float(row["most"]))
    for version in ("4.5", "4.6", "4.7"):
        default = row[f"default_{version.replace('.', '_')}"]
        taken = found.default_of(read_firmware(version))
        assert taken is None or not default or taken == float(default)


def test_every_parameter_that_is_asked_for_is_published_and_what_is_read_is_asked_for() -> None:
    assert {row["name"] for row in published()} == set(PARAMETER_NAMES)
    read = {one.parameter for one in vehicle_from_parameters({"SERVO1_FUNCTION": 26.0}).assumed}
    assert read <= set(PARAMETER_NAMES)


NOT_SET = {"RA_WHEEL_BASE", "RA_MAX_STR_ANG"}
"""Whose default of 0 means that nobody set them: nothing drives so."""


@pytest.mark.parametrize("row", published("px4_parameters.csv"), ids=lambda row: row["name"])
def test_the_table_is_as_px4_published_it(row: dict[str, str]) -> None:
    found = PARAMETERS[row["name"]]
    assert found.autopilot is Autopilot.PX4
    assert found.is_whole == (row["type"] == "INT32")
    assert found.documented == (Range(float(row["least"]), float(row["most"])) if row["least"] else None)
    assert (str(found.until)[:4] if found.until else "1.18") == row["last"]
    if found.default is not None and found.name not in NOT_SET:
        assert found.default == pytest.approx(float(row["default"]), abs=1e-6)
    assert len(row["commit"]) == 40
    is_in_1_17 = row["last"] != "1.15"
    assert (len(row["commit_1_17"]), bool(row["file_1_17"])) == ((40, True) if is_in_1_17 else (0, False))


def test_all_of_px4s_that_is_read_is_published_and_asked_for() -> None:
    assert {row["name"] for row in published("px4_parameters.csv")} == set(PX4_NAMES)
    for kind in ({"CA_AIRFRAME": 5.0}, {"CA_AIRFRAME": 6.0}):
        read = {one.parameter for one in vehicle_from_parameters(kind).assumed}
        assert read <= set(PX4_ASKED_NAMES)
    assert set(PX4_NAMES) - set(PX4_ASKED_NAMES) == {
        *("RA_MISS_VEL_DEF", "RD_MISS_SPD_DEF", "RA_MAX_ACCEL", "RD_MAX_ACCEL", "RA_MAX_JERK", "RD_MAX_JERK"),
        "GF_PREDICT",
    }


@pytest.mark.parametrize(
    ("values", "remarks"),
    [
        ({"NAV_ACC_RAD": 0.5, "GF_ACTION": 2, "RO_SPEED_LIM": -1}, []),
        ({"NAV_ACC_RAD": 0.01}, ["NAV_ACC_RAD is 0.01; PX4 documents 0.05 to 200, and PX4 does not check it"]),
        ({"GF_ACTION": 2.5}, ["GF_ACTION is 2.5; PX4 keeps a whole number there (INT32), and PX4 does not check it"]),
        # What comes of a tool that takes bits for a number, or a number for bits.
        ({"GF_ACTION": 1_077_936_128}, ["GF_ACTION is 1.07793613e+09; PX4 documents 0 to 5, and PX4 does not check it"]),
        ({"NAV_ACC_RAD": 1.4e-45}, ["NAV_ACC_RAD is 1.4e-45; PX4 documents 0.05 to 200, and PX4 does not check it"]),
        ({"WP_SPEED": 2.0, "NAV_ACC_RAD": 0.01}, []),  # ArduPilot's
        ({"FS_ACTION": 2.0}, []),
    ],
)  # fmt: skip
def test_values_that_px4_does_not_document_are_said(values: dict[str, float], remarks: list[str]) -> None:
    assert range_remarks(values) == remarks
    assert range_remarks(values, ardupilot=True) == []
    assert parameter_remarks(Situation(parameters=values)) == remarks


def test_many_values_out_of_range_are_counted() -> None:
    found = range_remarks(dict.fromkeys(PX4_NAMES, -7.0))
    assert len(found) == 6
    assert (
        found[-1] == f"and {len(PX4_NAMES) - 7} more parameters out of range"
    )  # CA_AIRFRAME, GF_PREDICT have none


PX4S, ARDUPILOTS = {"RO_SPEED_LIM": 3.0}, {"WP_SPEED": 2.0}


@pytest.mark.parametrize(
    ("heard", "parameters", "said", "known", "told"),
    [
        (None, {}, None, None, None),
        (None, {}, True, True, None),
        (None, {}, False, False, "assuming PX4, as f.plan says"),
        (None, PX4S, False, False, None),
        (None, PX4S, True, False, "f.plan is made for ArduPilot (firmwareType), but the vehicle is PX4"),
        (
            None,
            ARDUPILOTS,
            False,
            True,
            "f.plan is made for PX4 (firmwareType), but the vehicle is ArduPilot",
        ),
        (True, PX4S, False, True, "f.plan is made for PX4 (firmwareType), but the vehicle is ArduPilot"),
        (False, {}, True, False, "f.plan is made for ArduPilot (firmwareType), but the vehicle is PX4"),
        (False, {}, False, False, None),
    ],
)
def test_what_a_vehicle_says_of_itself_counts_more_than_a_file(
    heard: bool | None, parameters: dict[str, float], said: bool | None, known: bool | None, told: str | None
) -> None:
    made_for = MadeFor("f.plan", said) if said is not None else None
    situation = Situation(ardupilot=heard, parameters=parameters, reading=Reading(made_for=made_for))
    assert known_ardupilot(situation) is known
    remarks = made_for_remarks(situation)
    assert (told is None) == (not remarks)
    assert told is None or told in remarks[0]
    vehicle = known_vehicle(situation, GoTo())
    assert vehicle.autopilot is (Autopilot.PX4 if known is False else Autopilot.ARDUPILOT)


@pytest.mark.parametrize(
    ("heard", "said", "known"), [(None, 11, 11), (None, 2, None), (10, 11, 10), (None, None, None)]
)
def test_a_plan_for_a_boat_is_one(heard: int | None, said: int | None, known: int | None) -> None:
    reading = Reading(made_for=MadeFor("f.plan", True, said))
    situation = Situation(vehicle_type=heard, reading=reading)
    assert known_type(situation) == known
    assert (known_vehicle(situation, GoTo()).boat_drift_m is not None) == (known == 11)


def test_how_many_items_are_held_by_autopilot() -> None:
    for parameters, most, home in (({}, 654, 1), (PX4S, 500, 0)):
        assert most_own_items(Situation(parameters=parameters)) == most
        assert vehicle_from_parameters(parameters).home_items == home


def measured_cells(*, before_4_6: bool = False) -> list[dict[str, str]]:
    path = Path(__file__).parent / "data" / "measured_cells.csv"
    with path.open(newline="", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if (row["firmware"] == "before 4.6") is before_4_6]


@pytest.mark.parametrize(
    ("name", "column"),
    [("WP_SPEED", "wp_speed_mps"), ("WP_RADIUS", "wp_radius_m"), ("TURN_RADIUS", "turn_radius_m")],
)
@pytest.mark.parametrize("steering", Steering)
def test_no_range_is_wider_than_what_was_measured(name: str, column: str, steering: Steering) -> None:
    row = PARAMETERS[name]
    claimed = row.measured_skid if steering is Steering.SKID else row.measured
    values = [float(cell[column]) for cell in measured_cells() if cell["steering"] == steering]
    assert claimed is None or min(values) <= claimed.least <= claimed.most <= max(values)


def test_before_4_6_no_range_is_wider_than_what_was_measured() -> None:
    for name, column in (
        ("WP_SPEED", "wp_speed_mps"),
        ("WP_RADIUS", "wp_radius_m"),
        ("TURN_RADIUS", "turn_radius_m"),
    ):
        claimed = PARAMETERS[name].measured_before_4_6
        values = [float(cell[column]) for cell in measured_cells(before_4_6=True)]
        assert claimed is not None
        assert min(values) <= claimed.least <= claimed.most <= max(values)
    assert {cell["parameters"] for cell in measured_cells(before_4_6=True)} == {
        ""
    }  # so all others had their defaults
    for name in ("ATC_TURN_MAX_G", "ATC_ACCEL_MAX", "PSC_POS_P"):
        claimed = PARAMETERS[name].measured_before_4_6
        assert claimed is not None
        assert claimed.least == PARAMETERS[name].default


@pytest.mark.parametrize(("name", "ends"), [("ATC_ACCEL_MAX", (0.5, 2.0)), ("ATC_TURN_MAX_G", (0.2,))])
@pytest.mark.parametrize("steering", Steering)
def test_limits_were_measured_at_the_ends_of_their_ranges(
    name: str, ends: tuple[float, ...], steering: Steering
) -> None:
    claimed = PARAMETERS[name].measured_skid if steering is Steering.SKID else PARAMETERS[name].measured
    assert claimed is not None
    told = {cell["parameters"] for cell in measured_cells() if cell["steering"] == steering}
    assert {f"{name} {end:g}" for end in ends} <= told
    assert claimed.least == ends[0]
    assert claimed.most in {math.inf, ends[-1]}


@pytest.mark.parametrize("steering", [{}, SKID])
def test_a_vehicle_with_its_defaults_is_of_the_measured_kind(steering: dict[str, float]) -> None:
    for version in ("4.6", "4.7"):
        assert beyond_measured(vehicle_from_parameters(steering, firmware=read_firmware(version))) == ()


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"OA_TYPE": 2.0}, "OA_TYPE 2: ArduPilot plans its own way"),
        ({"FRAME_CLASS": 2.0}, "not on a boat"),
        (
            {"ATC_STR_ACC_MAX": 60.0},
            "ATC_STR_ACC_MAX 60 °/s² was not measured (only 120 or more, ackermann steering)",
        ),
        ({"ATC_STR_DEC_MAX": 60.0, "ATC_STR_ACC_MAX": 0.0}, "ATC_STR_ACC_MAX 60 °/s² was not measured"),
        ({"WP_RADIUS": 6.0}, "WP_RADIUS 6 m was not measured (only 0.9 to 5, "),
        ({"TURN_RADIUS": 2.5}, "TURN_RADIUS 2.5 m was not measured (only 0.27 to 2, "),
        ({"FENCE_MARGIN": 7.0, "FENCE_ENABLE": 1.0}, "FENCE_MARGIN 7 m was not measured (only 0.1 to 5)"),
        (
            {"FENCE_MARGIN_XY": 7.0, "FENCE_ENABLE": 1.0},
            "FENCE_MARGIN_XY 7 m was not measured (only 0.1 to 5)",
        ),
        ({"FENCE_MARGIN": 0.0, "FENCE_ENABLE": 1.0}, "FENCE_MARGIN 0 m does not switch avoidance off"),
        ({"WP_SPEED": 0.5}, "ATC_STR_RAT_FF 2.5 (not 0.75) or PSC_VEL_P 3 (not 1)"),
    ],
)
def test_what_was_not_measured_is_named(parameters: dict[str, float], said: str) -> None:
    (sentence,) = beyond_measured(vehicle_from_parameters(parameters, firmware=Firmware(4, 7)))
    assert said in sentence


def test_a_boat_drifts_where_it_stops() -> None:
    assert vehicle_from_parameters({}, mav_type=11).boat_drift_m == 2.0
    assert vehicle_from_parameters({"FRAME_CLASS": 2.0, "LOIT_RADIUS": 10.0}).boat_drift_m == 10.0
    assert vehicle_from_parameters({"FRAME_CLASS": 1.0, "LOIT_RADIUS": 10.0}).boat_drift_m is None


@pytest.mark.parametrize(
    ("parameters", "items"),
    [
        ({}, 655),
        ({"BRD_SD_MISSION": 64.0}, 4368),
        ({"BRD_SD_MISSION": 1e38}, 655),
        ({"BRD_SD_MISSION": -1.0}, 655),
    ],
)
def test_storage_that_is_none_counts_as_none(parameters: dict[str, float], items: int) -> None:
    assert most_items(parameters) == items
    said = storage_remarks(parameters)
    assert bool(said) is (parameters.get("BRD_SD_MISSION") in (1e38, -1.0))
    assert all("assuming 0" in text for text in said)


@pytest.mark.parametrize(
    "name", ["WP_SPEED", "CRUISE_SPEED", "ATC_ACCEL_MAX", "ATC_DECEL_MAX", "WP_ACCEL", "WP_JERK"]
)
@pytest.mark.parametrize("value", [1e-38, 1e-10, 0.001])
def test_what_nobody_drives_with_is_refused(name: str, value: float) -> None:
    with pytest.raises(VehicleError, match=f"{name} is {value:g}; allowed: 0, or 0.0"):
        vehicle_from_parameters({name: value})
    assert (
        vehicle_from_parameters({name: 0.0, "CRUISE_SPEED": 2.0}).speed_mps == 2.0 or name == "CRUISE_SPEED"
    )


@pytest.mark.parametrize(("rate_dps", "is_told"), [(40.0, True), (119.0, True), (120.0, False), (0.0, False), (None, False)])  # fmt: skip
def test_a_turn_rate_below_the_measured_one_is_told(rate_dps: float | None, is_told: bool) -> None:
    known = {} if rate_dps is None else {"ATC_STR_RAT_MAX": rate_dps}
    told = beyond_measured(vehicle_from_parameters({**KNOWN, "TURN_RADIUS": 0.9, **known}))
    assert any("was not measured (only 120 or more" in text for text in told) is is_told


def test_a_range_holds_its_ends_as_vehicles_tell_them():
    one = Range(0.9, 0.9)
    assert float(np.float32(0.9)) in one
    assert float(np.float32(0.9)) != 0.9
    assert 0.901 not in one
    assert 0.899 not in one
