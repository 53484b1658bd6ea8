"""A calibration's file: written, read, and refused where it says more than its corners."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.errors import MissionFormatError
from missions.formats.calibration import calibration_from_plain, calibration_to_plain, read_calibration, write
from missions.situation import Calibration, CornerClass, LegClass

METRES = st.floats(0, 50).map(lambda value: round(value, 3))
CORNERS = st.builds(
    lambda turn, speed, *rest: CornerClass(
        15.0 * turn, 15.0 * turn + 15, 0.5 * speed, 0.5 * speed + 0.5, *rest
    ),
    st.integers(0, 12),
    st.integers(0, 40),
    st.booleans(),
    st.integers(0, 10_000),
    METRES,
    METRES,
    METRES,
)
LEGS = st.builds(
    lambda speed, *rest: LegClass(0.5 * speed, 0.5 * speed + 0.5, *rest),
    st.integers(0, 40),
    st.integers(0, 999),
    METRES,
)
CALIBRATIONS = st.builds(
    Calibration,
    st.integers(1, 255),
    st.integers(0, 10_000),
    st.sampled_from(["ackermann", "skid"]),
    st.lists(
        CORNERS, max_size=4, unique_by=lambda one: (one.turn_from_deg, one.speed_from_mps, one.stands)
    ).map(tuple),
    st.lists(LEGS, max_size=3).map(tuple),
    st.dictionaries(st.sampled_from(["WP_RADIUS", "TURN_RADIUS", "ATC_TURN_MAX_G"]), st.floats(0, 100)),
    st.sampled_from([None, "4.6.3", "1.17.0-beta2"]),
)
ONE = Calibration(
    7, 3, "skid", (CornerClass(0, 15, 1, 1.5, False, 300, -0.1, 0.0, 0.0),), (), {"WP_RADIUS": 2.0}
)


@given(CALIBRATIONS)
def test_what_is_written_is_read(tmp_path_factory, calibration):
    path = tmp_path_factory.mktemp("one") / "rover.toml"
    path.write_text(write(calibration))
    situation = read_calibration(path)
    assert situation.calibration == calibration
    assert dict(situation.parameters) == dict(calibration.parameters)
    assert str(situation.firmware) == str(calibration.firmware)
    assert calibration_from_plain(json.loads(json.dumps(calibration_to_plain(calibration)))) == calibration


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("corners = 300", "corners = 299", "narrows a bound with 299 corners; that needs 300"),
        ("inside_more_m = -0.1", "inside_more_m = nan", "inside_more_m is nan"),
        ("beyond_m = 0.0", "beyond_m = -1.0", "expected 0 or more"),
        ("stands = false", "stands = 1", "expected true or false"),
        ("calibration = 1", "calibration = 2", "calibration = 2; expected 1"),
        ('steering = "skid"', "", "'steering' is missing"),
        ('steering = "skid"', 'steering = "wings"', "wings"),
        ("system = 7", "system = true", "expected a whole number"),
        ("turn_to_deg = 15", "turn_to_deg = 180", "turn_from_deg of class 1 of corners is 0, up to 180"),
        ("speed_from_mps = 1", "speed_from_mps = 1.2", "expected a multiple of 0.5"),
        ("drives = 3", "drives = 3\nfirmware = 4", "is no calibration"),
        ("drives = 3", "drives = = 3", "is no calibration"),
    ],
)
def test_what_is_none_is_refused(tmp_path, before, after, said):
    text = write(ONE)
    assert before in text
    path = tmp_path / "rover.toml"
    path.write_text(text.replace(before, after, 1))
    with pytest.raises(MissionFormatError, match=r"is no calibration of a rover") as caught:
        read_calibration(path)
    assert said in str(caught.value)


def test_legs_are_not_narrowed(tmp_path):
    path = tmp_path / "rover.toml"
    path.write_text(
        write(ONE)
        .replace("legs = []", "")
        .replace(
            "[parameters]",
            "[[legs]]\nspeed_from_mps = 1.0\nspeed_to_mps = 1.5\nlegs = 900\nmore_m = -0.1\n\n[parameters]",
        )
    )
    with pytest.raises(MissionFormatError, match="legs are not narrowed"):
        read_calibration(path)


def test_a_class_that_stands_there_twice_is_refused(tmp_path):
    text = write(ONE)
    begin = text.index("[[corners]]")
    one = text[begin : text.index("[parameters]")]
    path = tmp_path / "rover.toml"
    path.write_text(text[:begin] + one + one.replace("-0.1", "0.9") + text[begin + len(one) :])
    with pytest.raises(MissionFormatError, match="two classes of corners are the same"):
        read_calibration(path)
