"""One rover's bounds from its corners: any sample widens, 300 narrow to the bound that holds 99 % with 95 % confidence."""

from __future__ import annotations

import json
import math
import shutil

import numpy as np
import pytest
from logbook.making import Log
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.dataset.build import build, log_files
from mavlink_bridge.dataset.calibrate import (
    Side,
    calibrate,
    calibration_text,
    corner_classes,
    leg_classes,
    more_m,
    rank_of_bound,
    ranks_of_bounds,
)
from mavlink_bridge.dataset.schema import TABLES
from mavlink_bridge.dataset.store import Dataset
from mavlink_bridge.errors import DatasetError
from mavlink_bridge.many import open_workers
from missions.formats.calibration import read_calibration
from missions.vehicle import Vehicle


def pbpp(*words: object):
    return CliRunner().invoke(app, list(map(str, words)))


@pytest.mark.parametrize(("count", "rank"), [(298, 299), (299, 299), (300, 300), (473, 472), (1000, 996)])
def test_the_rank_is_that_of_tables_of_tolerance_limits(count, rank):
    """299 is the least sample whose largest holds 99 % with 95 % confidence, 473 that whose second largest does."""
    assert rank_of_bound(count) == rank


def test_the_bound_holds_as_often_as_it_says():
    rng = np.random.default_rng(1)
    count, held = 400, 0
    rank = rank_of_bound(count)
    for _ in range(2000):
        bound = np.sort(rng.random(count))[rank - 1]
        held += bound >= 0.99  # of uniform numbers that share lies below
    assert held / 2000 == pytest.approx(0.95, abs=0.05)
    assert held / 2000 > 0.93


def all_of(count):
    return np.ones(count, bool)


def test_any_sample_widens_and_few_do_not_narrow():
    assert more_m(np.array([0.1234]), all_of(1), -1.0, Side.INSIDE) == 0.124
    assert more_m(np.full(299, -0.4), all_of(299), -1.0, Side.INSIDE) == 0.0
    assert more_m(np.full(300, -0.4), all_of(300), -1.0, Side.INSIDE) == -0.4
    assert more_m(np.full(300, -0.4), all_of(300), -0.1, Side.INSIDE) == -0.1
    assert more_m(np.full(300, -0.4), all_of(300), 0.0, Side.INSIDE) == 0.0


def test_what_may_not_narrow_widens():
    excess = np.concatenate((np.full(300, -0.4), [0.2]))
    tells = np.concatenate((all_of(300), [False]))
    assert more_m(excess, tells, -1.0, Side.INSIDE) == 0.2
    assert more_m(-np.abs(excess), ~tells, -1.0, Side.INSIDE) == 0.0  # one that tells, 300 that do not


def test_of_many_corners_one_in_a_hundred_may_exceed_the_bound_whoever_drove_it():
    """A few corners that narrow nothing do not decide alone; those that may narrow have their own bound."""
    excess = np.concatenate((np.full(1000, -0.4), np.full(2, 0.7)))
    tells = excess < 0
    assert more_m(excess, tells, -1.0, Side.INSIDE) == -0.4
    assert more_m(np.append(excess, 0.7), np.append(tells, False), -1.0, Side.INSIDE) == 0.7
    diluted = np.concatenate((np.full(300, 0.1), np.full(10_000, -0.4)))
    assert more_m(diluted, np.arange(10_300) < 300, -1.0, Side.INSIDE) == 0.1


@pytest.mark.parametrize("alike", [0.0, 0.9])
@pytest.mark.parametrize("count", [473, 1000, 2500])
def test_both_bounds_together_hold_what_each_promises(count, alike):
    """Of corners whose cut and overshoot have to do with each other, or not, 99 % are within both in 95 of 100 calibrations."""
    rng = np.random.default_rng(7)
    others = rng.normal(size=(20_000, 2))
    others[:, 1] = alike * others[:, 0] + math.sqrt(1 - alike**2) * others[:, 1]
    held = 0
    for _ in range(400):
        drawn = others[rng.integers(0, len(others), count)]
        most = [np.sort(drawn[:, side])[rank - 1] for side, rank in enumerate(ranks_of_bounds(count))]
        held += np.all(others <= most, axis=1).mean() >= 0.99
    assert held / 400 > 0.93
    assert ranks_of_bounds(300) == (300, 300)
    assert ranks_of_bounds(473) == (473, 473)


def test_corners_are_parted_into_classes():
    count = 310
    columns = {
        "turn_deg": np.concatenate((np.full(count, 110.0), [30.0])),
        "speed_mps": np.full(count + 1, 2.0),
        "stands": np.zeros(count + 1, bool),
        "inside_m": np.concatenate((np.full(count, -0.5), [0.3])),
        "outside_m": np.full(count + 1, -0.5),
        "beyond_m": np.concatenate((np.zeros(count), [0.25])),
        "gap_m": np.full(count + 1, 0.5),
        "is_bounded": all_of(count + 1),
        "is_at_speed": all_of(count + 1),
    }
    gentle, sharp = corner_classes(columns, Vehicle(), all_of(count + 1))
    assert (gentle.turn_from_deg, gentle.corners, gentle.inside_more_m, gentle.beyond_m) == (
        30.0,
        1,
        0.3,
        0.25,
    )
    assert (sharp.turn_from_deg, sharp.corners) == (105.0, count)
    assert -0.5 < sharp.inside_more_m < 0  # no farther than the measured rows allow
    seldom = {**columns, "gap_m": np.full(count + 1, 1.5)}
    assert corner_classes(seldom, Vehicle(), all_of(count + 1))[1].inside_more_m == 0.0
    assert corner_classes(columns, Vehicle(), ~all_of(count + 1))[1].inside_more_m == 0.0
    slowed = {**columns, "is_at_speed": ~all_of(count + 1)}
    assert corner_classes(slowed, Vehicle(), all_of(count + 1))[1].inside_more_m == 0.0


def test_legs_only_widen():
    (one,) = leg_classes({"speed_mps": np.array([2.0, 2.1]), "more_m": np.array([-0.4, -0.1])})
    assert (one.legs, one.more_m) == (2, 0.0)
    (one,) = leg_classes({"speed_mps": np.array([2.0]), "more_m": np.array([0.05])})
    assert one.more_m == 0.05


@pytest.fixture(scope="module")
def fleet(tmp_path_factory, logs):
    folder = tmp_path_factory.mktemp("fleet")
    shutil.copy(logs / "mission-yard.tlog", folder)
    shutil.copy(logs / "px4" / "upload-and-square.tlog", folder)
    with open_workers(1) as workers:
        build(
            Dataset(folder / "dataset"),
            log_files([folder / "mission-yard.tlog", folder / "upload-and-square.tlog"]),
            workers,
        )
    return folder / "dataset"


def test_a_calibration_is_of_one_rover(fleet):
    with pytest.raises(DatasetError, match="of one rover; the dataset has drives of vehicles: 1, 3"):
        calibrate(Dataset(fleet), None)
    with pytest.raises(DatasetError, match="no drives of vehicle 9, only of 1, 3"):
        calibrate(Dataset(fleet), 9)


def test_from_logs_to_a_plan(fleet, tmp_path, fields):
    found = pbpp("logs", "calibrate", fleet, "--system", 3, "-o", tmp_path / "rover.toml", "--json")
    document = json.loads(found.stdout)
    assert (found.exit_code, document["drives"], document["corners"]) == (0, 1, 4)
    situation = read_calibration(tmp_path / "rover.toml")
    assert sum(one.corners for one in situation.calibration.corners) == 4
    assert all(
        not math.isnan(one.inside_more_m) and one.inside_more_m >= 0 for one in situation.calibration.corners
    )
    words = (
        "plan",
        "--fence",
        fields / "yard-fence.waypoints",
        "--start",
        "40.071374,-105.229930",
        "--target",
        "40.0720926,-105.2286152",
    )
    told = pbpp(*words, "--vehicle", tmp_path / "rover.toml", "--trust-model", "--json")
    assert told.exit_code == 0, told.output
    assert any(
        one.startswith("calibrated from 1 drive of vehicle 3") for one in json.loads(told.stdout)["info"]
    )


def made_dataset(folder, logs, **other):
    """Return a dataset of 402 equal corners of vehicle 1 in two logs; each log is (begins_s, firmware, parameters, name of a changed one); ``other`` of their legs."""
    dataset = Dataset(folder)
    database = dataset.begin()
    rows = {name: [] for name in TABLES}
    for number, (begins_s, firmware, parameters, changed) in enumerate(logs):
        log, end = f"log{number}", ("2026-08", 1)

        def row(table, log=log, end=end, **values):
            names = TABLES[table].names
            assert set(values) <= set(names)
            return (log, *(values.get(name) for name in names[1:]), *end)

        rows["vehicles"].append(row("vehicles", begins_utc=begins_s, firmware=firmware, driven_m=900.0))
        rows["drives"].append(row("drives", drive=1, begun_s=10.0, driven_s=500.0))
        rows["parameters"] += [
            row("parameters", name=name, value=value) for name, value in parameters.items()
        ]
        if changed:
            rows["events"].append(
                row("events", time_s=9.0, event="parameter", name=changed, before=1.0, after=2.0)
            )
        leg = {
            "drive": 1, "item": 2, "length_m": 30.0, "speed_mps": 2.0, "straight_m": 0.1, "predicted_straight_m": 0.3, "turn_deg": 110.0,
            "stands": False, "inside_cut_m": 0.1, "outside_overshoot_m": 0.1, "predicted_inside_cut_m": 0.9, "predicted_outside_overshoot_m": 0.9,
            "inside_beyond_m": 0.0, "outside_beyond_m": 0.0, "is_bounded": True, "gap_m": 0.4, "is_whole": True,
            "driven_mps": 1.9, "predicted_driven_mps": 2.0, **other,
        }  # fmt: skip
        rows["legs"] += [row("legs", leg=leg_number, **leg) for leg_number in range(1, 202)]
        rows["legs"].append(row("legs", leg=202, **{**leg, "turn_deg": None}))
    dataset.stage(database, rows)
    dataset.publish(database)
    database.close()
    dataset.end()
    dataset.close()
    return dataset


TUNE = {"WP_RADIUS": 2.0, "TURN_RADIUS": 0.9, "ATC_TURN_MAX_G": 0.6}
LATER_S = 1000.0


@pytest.mark.parametrize(
    ("first", "second", "narrows", "said"),
    [
        ((0.0, "4.6.3", TUNE, None), (LATER_S, "4.6.3", TUNE, None), True, ""),
        ((0.0, "4.5.7", TUNE, None), (LATER_S, "4.6.3", TUNE, None), False, "201 corners driven with"),
        ((0.0, None, TUNE, None), (LATER_S, "4.6.3", TUNE, None), False, "201 corners driven with"),
        ((0.0, "4.6.3", {}, None), (LATER_S, "4.6.3", TUNE, None), False, "201 corners driven with"),
        ((0.0, "4.6.3", TUNE, None), (LATER_S, "4.6.3", {}, None), False, "201 corners driven with"),
        ((0.0, "4.6.3", {}, None), (LATER_S, "4.6.3", {}, None), False, "402 corners driven with"),
        ((0.0, "4.6.3", {"WP_RADIUS": 2.0}, None), (LATER_S, "4.6.3", TUNE, None), False, "201 corners"),
        ((0.0, "4.6.3", TUNE, "WP_RADIUS"), (LATER_S, "4.6.3", TUNE, None), False, "201 corners driven"),
        ((0.0, "4.6.3", TUNE, None), (100.0, "4.6.3", TUNE, None), False, "another recording, or another"),
        ((None, "4.6.3", TUNE, None), (None, "4.6.3", TUNE, None), False, "in logs without times of day"),
        ((0.0, "4.6.3", {**TUNE, "WP_SPEED": math.nan}, None), (LATER_S, "4.6.3", TUNE, None), True, ""),
    ],
)
def test_only_corners_known_to_be_of_this_rover_as_it_is_narrow(tmp_path, first, second, narrows, said):
    found = calibrate(made_dataset(tmp_path / "dataset", [first, second]), None)
    (path := tmp_path / "rover.toml").write_text(calibration_text(found))
    (one,) = read_calibration(path).calibration.corners
    assert one.corners == 402
    assert (one.inside_more_m < 0) == narrows
    assert said in " ".join(found.remarks)


@pytest.mark.parametrize(
    ("driven_mps", "narrows"), [(1.81, True), (2.19, True), (1.0, False), (2.5, False), (None, False)]
)
def test_corners_slowed_by_what_the_log_does_not_tell_narrow_nothing(tmp_path, driven_mps, narrows):
    """By a hand on the throttle, by mud: they are gentler than those at the speed in force."""
    logs = [(0.0, "4.6.3", TUNE, None), (LATER_S, "4.6.3", TUNE, None)]
    found = calibrate(made_dataset(tmp_path / "dataset", logs, driven_mps=driven_mps), None)
    (one,) = found.calibration.corners
    assert (one.inside_more_m < 0) == narrows
    assert ("whose speed is unknown or differs" in " ".join(found.remarks)) != narrows


SQUARE = [(0.0, 0.0), (0.0, 30.0), (30.0, 30.0), (30.0, 0.0), (0.0, 0.0)]


def test_corners_that_a_station_slowed_are_of_the_class_of_their_speed(tmp_path):
    """Half of the drives of a mission at 2 m/s were driven at 1 m/s, by DO_CHANGE_SPEED: at 2 m/s they count nothing."""
    folder = tmp_path / "logs"
    folder.mkdir()
    for number, speed_mps in enumerate((2.0, 1.0)):
        log = Log(now_s=number * 1000.0)
        log.heartbeat()
        log.parameters({**TUNE, "WP_SPEED": 2.0, "FENCE_ENABLE": 0.0})
        log.mission(SQUARE[1:])
        log.position(*SQUARE[0])
        log.drive(SQUARE, speed_mps=speed_mps, asked_mps=None if speed_mps == 2.0 else speed_mps)
        log.write(folder / f"{number}.tlog")
    with open_workers(1) as workers:
        build(Dataset(tmp_path / "dataset"), log_files([folder]), workers)
    found = calibrate(Dataset(tmp_path / "dataset"), None)
    counted = {(one.speed_from_mps, one.turn_from_deg): one.corners for one in found.calibration.corners}
    assert counted == {(1.0, 90.0): 3, (2.0, 90.0): 3}
    assert not any("whose speed is unknown or differs" in remark for remark in found.remarks)
