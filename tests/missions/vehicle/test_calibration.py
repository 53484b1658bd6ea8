"""A rover's own drives widen the corridor, narrow it within what was measured, and say so."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import pytest
import shapely

from missions.drive_model import corner_forecast, envelope
from missions.firmware import Firmware
from missions.geo import LatLon
from missions.promise import known_vehicle, promise
from missions.request import GoTo
from missions.situation import Calibration, CornerClass, LegClass, Situation
from missions.vehicle import Autopilot, Steering, Vehicle
from missions.vehicle.calibration import corner_more, leg_more_m, speed_class, turn_class
from missions.vehicle.measured_corners import LEAST_MORE_M

LINE = [(0.0, 0.0), (0.0, 50.0), (50.0, 50.0)]


def corners(
    inside_m=0.0, outside_m=0.0, beyond_m=0.0, *, turn=90, speed=2.0, count=400, stands=False
) -> CornerClass:
    return CornerClass(turn, turn + 15, speed, speed + 0.5, stands, count, inside_m, outside_m, beyond_m)


def rover(*classes: CornerClass, legs: tuple[LegClass, ...] = (), **more) -> Vehicle:
    return Vehicle(calibration=Calibration(7, 12, "ackermann", classes, legs, {"WP_RADIUS": 2.0}), **more)


def test_bounds_and_corridor_grow():
    plain, worse = (corner_forecast(90, one) for one in (Vehicle(), rover(corners(0.5, 0.3, 0.4))))
    assert worse.inside_cut_m == pytest.approx(plain.inside_cut_m + 0.5)
    assert worse.outside_overshoot_m == pytest.approx(plain.outside_overshoot_m + 0.3)
    before = envelope(LINE, Vehicle(), heading_deg=0).area
    after = envelope(LINE, rover(corners(0.5, 0.3, 0.4)), heading_deg=0).area
    # From the middle of one leg to the middle of the next everything within 0.4 m of the model's corridor belongs to it.
    window = shapely.box(-10, 26, 24, 60)
    assert after.buffer(1e-6).covers(before.buffer(0.399).intersection(window))
    assert after.covers(before.buffer(-1e-6))


def test_narrowing_goes_no_farther_than_measured_rows():
    plain = corner_forecast(110, Vehicle())
    narrow = corner_forecast(110, rover(corners(-9.0, -9.0, turn=105)))
    least = LEAST_MORE_M["ackermann", 7, 4]
    assert least[0] < -0.1
    assert plain.inside_cut_m > narrow.inside_cut_m >= plain.inside_cut_m + least[0] - 1e-9
    assert narrow.outside_overshoot_m >= plain.outside_overshoot_m + least[1] - 1e-9
    # A class without measured rows to spare is not narrowed at all.
    assert ("ackermann", 3, 4) not in LEAST_MORE_M
    assert corner_forecast(50, rover(corners(-9.0, -9.0, turn=45))) == corner_forecast(50, Vehicle())


def test_the_table_is_what_the_rows_left_unused():
    path = Path(__file__).parents[3] / "benchmarks" / "drive_model.py"
    spec = importlib.util.spec_from_file_location("drive_model_benchmark", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.left_unused() == LEAST_MORE_M
    assert all(more_m <= 0 for pair in LEAST_MORE_M.values() for more_m in pair)


def test_a_class_without_corners_takes_the_most_of_its_neighbours():
    known = rover(
        corners(0.2, 0.1, 0.3, turn=60),
        corners(0.5, 0.0, 0.1, turn=120),
        corners(-0.3, 0.0, turn=75, speed=3.0),
    )
    assert corner_more(known, 80.0, 2.0, stands=False) == (0.2, 0.1, 0.3)
    assert corner_more(known, -95.0, 2.0, stands=False) == (0.5, 0.1, 0.3)
    assert corner_more(known, 80.0, 2.0, stands=True) == (0.0, 0.0, 0.0)
    assert corner_more(Vehicle(), 80.0, 2.0, stands=False) == (0.0, 0.0, 0.0)


def test_legs_widen_the_band():
    known = rover(legs=(LegClass(2.0, 2.5, 40, 0.15), LegClass(3.0, 3.5, 40, 0.4)))
    assert [leg_more_m(known, speed) for speed in (2.0, 2.5, 3.2, 9.0)] == [0.15, 0.4, 0.4, 0.4]
    straight = [(0.0, 0.0), (0.0, 80.0)]
    plain, wide = (envelope(straight, one, heading_deg=0) for one in (Vehicle(), known))
    assert wide.legs[0].half_width_m == pytest.approx(plain.legs[0].half_width_m + 0.15)


def test_classes_take_float32_speeds():
    assert (speed_class(1.9999999), turn_class(-89.99999)) == (4, 6)


BEFORE = Calibration(7, 12, "ackermann", (corners(-0.2, turn=105),), (), {"WP_RADIUS": 2.0}, "4.6.3")


class TestOfASituation:
    request = GoTo(target=LatLon(40.0, -105.0), clearance_m=1.5)

    def situation(self, *classes, **parameters) -> Situation:
        calibration = Calibration(7, 12, "ackermann", classes, (), {"WP_RADIUS": 2.0, "WP_SPEED": 2.0})
        return Situation(
            parameters={"WP_RADIUS": 2.0, "WP_SPEED": 2.0, **parameters}, calibration=calibration
        )

    def test_it_says_on_how_many_drives_it_rests(self):
        situation = self.situation(corners(0.1))
        vehicle = known_vehicle(situation, self.request)
        asked = promise(situation, self.request, vehicle)
        assert "calibrated from 12 drives of vehicle 7 (400 corners)" in asked.info

    def test_other_parameters_narrow_nothing_and_are_named(self):
        situation = self.situation(corners(-0.2, turn=105), corners(0.3, turn=60), WP_RADIUS=3.0)
        vehicle = known_vehicle(situation, self.request)
        assert [one.inside_more_m for one in vehicle.calibration.corners] == [0.0, 0.3]
        (warning,) = [
            one for one in promise(situation, self.request, vehicle).warnings if "calibrated" in one
        ]
        assert "WP_RADIUS 3 (then 2)" in warning
        as_it_was = self.situation(corners(-0.2, turn=105), WP_SPEED=3.0)  # classes have their speeds
        assert known_vehicle(as_it_was, self.request).calibration.corners[0].inside_more_m == -0.2

    def test_so_does_another_steering(self):
        situation = self.situation(corners(-0.2, turn=105), SERVO1_FUNCTION=73.0, SERVO3_FUNCTION=74.0)
        vehicle = known_vehicle(situation, self.request)
        assert vehicle.steering is Steering.SKID
        assert vehicle.calibration.corners[0].inside_more_m == 0.0


def test_px4_has_no_rows_to_be_narrowed_by():
    known = rover(corners(-0.2, -0.2, turn=105), autopilot=Autopilot.PX4)
    assert corner_more(known, 110.0, 2.0, stands=False) == (0.0, 0.0, 0.0)
    stood = rover(corners(-0.2, -0.2, turn=105, stands=True))
    assert corner_more(stood, 110.0, 2.0, stands=True) == (0.0, 0.0, 0.0)
    assert corner_more(rover(corners(-0.2, turn=105)), 110.0, 2.0, stands=False)[0] == -0.2


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"system": 3}, "of vehicle 7, this is vehicle 3"),
        ({"ardupilot": False}, "of another autopilot than PX4"),
        ({"firmware": Firmware(4, 5, 7)}, "the firmware is 4.5.7 (when the rover was calibrated: 4.6.3)"),
        ({"parameters": {"WP_RADIUS": 2.0, "ATC_TURN_MAX_G": 0.9}}, "ATC_TURN_MAX_G 0.9 (then not known)"),
        ({"calibration": replace(BEFORE, parameters={})}, "does not say with which parameters"),
        ({"calibration": replace(BEFORE, firmware=None)}, "when the rover was calibrated: not known"),
    ],
)
def test_what_is_not_as_it_was_narrows_nothing_and_is_said(more, said):
    request = GoTo(target=LatLon(40.0, -105.0), clearance_m=1.5)
    same = Situation(
        system=7,
        firmware=Firmware(4, 6, 3),
        parameters={"WP_RADIUS": 2.0, "TUNE": 9.0},
        calibration=BEFORE,
    )
    vehicle = known_vehicle(same, request)
    assert vehicle.calibration.corners[0].inside_more_m == -0.2
    assert not [one for one in promise(same, request, vehicle).warnings if "calibrat" in one]
    other = replace(same, **more)
    vehicle = known_vehicle(other, request)
    assert vehicle.calibration.corners[0].inside_more_m == 0.0
    assert any(said in one for one in promise(other, request, vehicle).warnings)


def test_a_corridor_of_two_kinds_of_firmware_grows_in_both():
    known = replace(rover(corners(0.5, 0.3, 0.4)), has_measured_corners=None)
    plain = replace(known, calibration=None)
    assert corner_forecast(90, known).inside_cut_m == pytest.approx(
        corner_forecast(90, plain).inside_cut_m + 0.5
    )
