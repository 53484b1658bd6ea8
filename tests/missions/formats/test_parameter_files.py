from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from missions.errors import MissionFormatError
from missions.firmware import Firmware
from missions.formats import read_parameters
from missions.formats.parameters import read, read_path, write

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
        "f: line 3: A_NAME_OF_MORE_THAN_16 is passed over: a parameter's name has at most 16 letters, and this 22",
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
