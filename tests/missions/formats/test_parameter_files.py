from __future__ import annotations

import math
import re
import struct
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.errors import MissionFormatError
from missions.firmware import Firmware
from missions.formats import read_parameters
from missions.formats.parameters import qgc_text, read, read_path, value_text, write
from missions.situation import Situation

if TYPE_CHECKING:
    from pathlib import Path

MISSION_PLANNER = """#NOTE: 12/2/2025 10:00:00 Frame : rover
FENCE_ENABLE,1
FENCE_MARGIN,2.5
WP_SPEED,2
BRD_OPTIONS,-1
"""
MAVPROXY = """FENCE_ENABLE     1.000000
FENCE_MARGIN     2.500000
WP_SPEED         2.000000 # metres a second
BRD_OPTIONS      -1
"""
QGROUNDCONTROL = """# Onboard parameters for Vehicle 1
#
# Vehicle-Id Component-Id Name Value Type
1\t1\tFENCE_ENABLE\t1\t2
1\t1\tFENCE_MARGIN\t2.500000000000000000\t9
1\t1\tWP_SPEED\t2.0\t9
1\t1\tBRD_OPTIONS\t-1\t6
"""


@pytest.mark.parametrize(
    "text", [MISSION_PLANNER, MAVPROXY, QGROUNDCONTROL], ids=["Mission Planner", "MAVProxy", "QGC"]
)
@pytest.mark.parametrize("bom", ["", "\ufeff"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_files_of_three_tools(tmp_path: Path, text: str, bom: str, end: str) -> None:
    path = tmp_path / "rover.parm"
    path.write_bytes((bom + text).replace("\n", end).encode())
    assert read_parameters(path) == {"FENCE_ENABLE": 1, "FENCE_MARGIN": 2.5, "WP_SPEED": 2, "BRD_OPTIONS": -1}


@pytest.mark.parametrize("line", ["wp_speed = 3", "WP_SPEED:3", "WP_SPEED\t3", " WP_SPEED , 3e0 "])
def test_other_ways_to_part_name_and_value(tmp_path: Path, line: str) -> None:
    path = tmp_path / "rover.param"
    path.write_text(line)
    assert read_parameters(path) == {"WP_SPEED": 3}


def test_the_last_of_two_values_counts(tmp_path: Path) -> None:
    path = tmp_path / "rover.parm"
    path.write_text("WP_SPEED 1\n\nWP_SPEED 2\n")
    assert read_parameters(path) == {"WP_SPEED": 2}


@pytest.mark.parametrize(
    "line",
    ["WP_SPEED", "WP_SPEED fast", "WP_SPEED nan", "WP_SPEED inf", "2 WP_SPEED", "1\t1\tX\tfast\t9", "WP_SPEED 1_0"],
)  # fmt: skip
def test_lines_that_are_none_are_named(tmp_path: Path, line: str) -> None:
    path = tmp_path / "rover.parm"
    path.write_text(f"WP_RADIUS 2\n{line}\n")
    with pytest.raises(
        MissionFormatError, match=r"rover\.parm: line 2: expected a parameter's name and a number, found"
    ):
        read_parameters(path)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(MissionFormatError, match=r"none\.parm cannot be read: No such file"):
        read_parameters(tmp_path / "none.parm")
    (tmp_path / "x.parm").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MissionFormatError, match=r"x\.parm is not a text file"):
        read_parameters(tmp_path / "x.parm")


def test_the_checksum_that_mavproxy_writes_down_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "mav.parm"
    path.write_text("NAV_ACC_RAD      0.500000\n_HASH_CHECK      123456789\n", encoding="utf-8")
    assert read_parameters(path) == {"NAV_ACC_RAD": 0.5}


def test_bit_masks_may_be_hexadecimal(tmp_path: Path) -> None:
    path = tmp_path / "a.parm"
    path.write_text("CAN_D1_UC_ESC_BM 0x0F\nFENCE_OPTIONS 0X2\n", encoding="utf-8")
    assert read_parameters(path) == {"CAN_D1_UC_ESC_BM": 15.0, "FENCE_OPTIONS": 2.0}


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e999", "1e39", "0x" + "f" * 400, "0xg"])
def test_what_no_32_bit_float_holds_is_no_value(tmp_path: Path, value: str) -> None:
    path = tmp_path / "a.parm"
    path.write_text(f"FENCE_TYPE {value}\n", encoding="utf-8")
    with pytest.raises(MissionFormatError, match="line 1: expected a parameter's name and a number"):
        read_parameters(path)


def test_what_no_vehicle_has_is_passed_over_and_said() -> None:
    text = (
        "_HASH_CHECK,123\n1\t1\t_HASH_CHECK\t5\t6\nA_NAME_OF_MORE_THAN_16 1\nWP_SPEED,0x02\nWP_RADIUS -0x1\n"
    )
    situation = read(text, "f")
    assert situation.parameters == {"WP_SPEED": 2.0, "WP_RADIUS": -1.0}
    assert situation.remarks == (
        "f: line 3: A_NAME_OF_MORE_THAN_16 skipped: parameter names have at most 16 characters, this one has 22",
    )
    with pytest.raises(MissionFormatError, match="'1,5' has a decimal comma"):
        read("WP_SPEED 1,5\n", "f")


@pytest.mark.parametrize(
    ("remark", "firmware"),
    [
        ("# Version: 4.5.7 ", Firmware(4, 5, 7)),
        ("# Version: 4.7.0 dev", Firmware(4, 7, 0, 0)),
        ("#NOTE: 12/2/2025 ArduRover V4.6.3 (3fc7011a)", Firmware(4, 6, 3)),
        ("# Git Revision: 4.5.7", None),
        ("#NOTE: 12/2/2025 10:00:00 Frame : rover", None),
    ],
)
def test_a_remark_may_name_the_firmware(tmp_path: Path, remark: str, firmware: Firmware | None) -> None:
    path = tmp_path / "rover.parm"
    path.write_text(f"# Onboard parameters for Vehicle 1\n{remark}\nWP_SPEED 2\n", encoding="utf-8")
    found = read_path(path)
    assert (dict(found.parameters), found.firmware) == ({"WP_SPEED": 2.0}, firmware)
    path.write_text(write(found), encoding="utf-8")
    assert read_path(path) == found


PX4 = """# Onboard parameters for Vehicle 3
#
# Stack: PX4 Pro
# Vehicle: Rover
# Version: 1.17.0\x20
# Git Revision: 0000000000000000
#
# Vehicle-Id Component-Id Name Value Type
3\t1\tCAL_ACC0_ID\t1310988\t6
3\t1\tCA_AIRFRAME\t5\t6
3\t1\tGF_ACTION\t2\t6
3\t1\tNAV_ACC_RAD\t0.500000000000000000\t9
3\t1\tRA_MAX_STR_ANG\t0.523599982261657715\t9
"""


def test_px4s_file_of_qgroundcontrol() -> None:
    found = read(PX4, "rover.params")
    assert (found.system, found.ardupilot, found.firmware) == (3, False, Firmware(1, 17))
    assert found.parameters == {
        "CAL_ACC0_ID": 1310988, "CA_AIRFRAME": 5, "GF_ACTION": 2, "NAV_ACC_RAD": 0.5, "RA_MAX_STR_ANG": 0.523599982261657715,
    }  # fmt: skip
    assert found.remarks == ()
    assert read(PX4.replace("\t", " "), "f").parameters == found.parameters
    assert read(PX4.replace("PX4 Pro", "Generic"), "f").ardupilot is None
    assert read(QGROUNDCONTROL.replace("# Vehicle-Id", "# Stack: ArduPilot\n# V"), "f").ardupilot is True


def test_parameters_of_other_components_are_not_the_autopilots() -> None:
    gimbal = "3\t154\tGF_ACTION\t7\t6\n3\t154\tMNT_X\t1\t9\n"
    found = read(PX4 + gimbal, "f")
    assert found.parameters == read(PX4, "f").parameters
    assert found.remarks == (
        "f: 2 parameters of component 154 skipped: only the autopilot's (component 1) count",
    )
    assert read(gimbal, "f").parameters == {"GF_ACTION": 7, "MNT_X": 1}  # the only ones there are


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("4\t1\tGF_SOURCE\t0\t6", "parameters of vehicle 4, but those above are of vehicle 3"),
        ("3\t1\tGF_SOURCE\t0\t11", "'11' is no parameter type"),
        ("3\t1\tGF_SOURCE\t0\tint", "'int' is no parameter type"),
        ("x\t1\tGF_SOURCE\t0\t6", "'x' is no vehicle id; expected 0 to 255"),
        ("3\t256\tGF_SOURCE\t0\t6", "'256' is no component id"),
        ("3\t1\tGF_SOURCE\t0.5\t6", "GF_SOURCE 0.5 is no value of type 6; expected a whole number"),
        ("3\t1\tGF_SOURCE\t3e9\t6", "GF_SOURCE 3e+09 is no value of type 6"),
        ("3\t1\tGF_SOURCE\t-1\t1", "GF_SOURCE -1 is no value of type 1; expected a whole number, 0 to 255"),
    ],
)
def test_rows_that_contradict_themselves_are_refused(row: str, message: str) -> None:
    with pytest.raises(MissionFormatError, match=re.escape(f"f: line {PX4.count(chr(10)) + 1}: {message}")):
        read(f"{PX4}{row}\n", "f")


def test_a_type_that_is_not_px4s_is_said() -> None:
    found = read(PX4.replace("GF_ACTION\t2\t6", "GF_ACTION\t2\t9"), "f")
    assert found.parameters["GF_ACTION"] == 2
    assert found.remarks == (
        "f: line 11: GF_ACTION has type 9, PX4's is INT32 (6): QGroundControl skips such a line",
    )
    rows = "".join(f"1\t1\t{name}\t1\t6\n" for name in ("NAV_ACC_RAD", "RA_ACC_RAD_MAX", "RO_SPEED_LIM", "RO_JERK_LIM", "PP_LOOKAHD_MIN", "PP_LOOKAHD_MAX"))  # fmt: skip
    assert read(rows, "f").remarks[-1] == "and 1 more of another type"
    ardupilots = "1\t1\tWP_SPEED\t2\t9\n1\t1\tGF_ACTION\t2\t9\n"
    assert read(ardupilots, "f").remarks == ()


def test_a_remark_that_the_names_contradict_does_not_count() -> None:
    found = read("# Stack: PX4 Pro\nWP_SPEED 2\n", "f")
    assert found.ardupilot is True
    assert found.remarks == (
        "f: a remark says that this is PX4 Pro, but its parameters are ArduPilot's: the parameters decide",
    )


def test_what_is_written_is_what_qgroundcontrol_writes() -> None:
    types = {"CAL_ACC0_ID": 6, "CA_AIRFRAME": 6, "GF_ACTION": 6}
    found = read(PX4, "f")
    text = qgc_text(found, types)
    assert read(text, "f").parameters == pytest.approx(found.parameters, rel=1e-7)
    rows = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    assert [row[:3] for row in rows] == [["3", "1", name] for name in sorted(found.parameters)]
    assert [row[4] for row in rows] == ["6", "6", "6", "9", "9"]
    assert "# Stack: PX4 Pro\n# Version: 1.17.0\n" in text
    assert qgc_text(Situation(parameters={"A": 1.0}), {}).endswith("1\t1\tA\t1\t9\n")


@given(st.integers(-(2**31), 2**31 - 1))
def test_every_int32_is_read_as_written(value: int) -> None:
    assert float(value_text(float(value))) == value
    assert "e" not in value_text(float(value))


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_every_float_of_32_bits_is_read_as_written(value: float) -> None:
    assert (
        struct.pack("<f", float(value_text(value))) == struct.pack("<f", value)
        or math.copysign(1, value) < 0 == value
    )
