"""One rover's bounds from its corners: any sample widens, 300 narrow to the bound that holds 99 % with 95 % confidence."""

from __future__ import annotations

import json
import math
import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.dataset.build import build, log_files
from mavlink_bridge.dataset.calibrate import calibrate, corner_classes, leg_classes, more_m, rank_of_bound
from mavlink_bridge.dataset.store import Dataset
from mavlink_bridge.errors import DatasetError
from mavlink_bridge.many import open_workers
from missions.formats.calibration import read_calibration


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
    assert more_m(np.array([0.1234]), all_of(1), -1.0) == 0.124
    assert more_m(np.full(299, -0.4), all_of(299), -1.0) == 0.0
    assert more_m(np.full(300, -0.4), all_of(300), -1.0) == -0.4
    assert more_m(np.full(300, -0.4), all_of(300), -0.1) == -0.1
    assert more_m(np.full(300, -0.4), all_of(300), 0.0) == 0.0


def test_what_may_not_narrow_widens():
    excess = np.concatenate((np.full(300, -0.4), [0.2]))
    tells = np.concatenate((all_of(300), [False]))
    assert more_m(excess, tells, -1.0) == 0.2
    assert more_m(-np.abs(excess), ~tells, -1.0) == 0.0  # one that tells, 300 that do not


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
    }
    gentle, sharp = corner_classes(columns, "ackermann", all_of(count + 1))
    assert (gentle.turn_from_deg, gentle.corners, gentle.inside_more_m, gentle.beyond_m) == (
        30.0,
        1,
        0.3,
        0.25,
    )
    assert (sharp.turn_from_deg, sharp.corners) == (105.0, count)
    assert -0.5 < sharp.inside_more_m < 0  # no farther than the measured rows allow
    seldom = {**columns, "gap_m": np.full(count + 1, 1.5)}
    assert corner_classes(seldom, "ackermann", all_of(count + 1))[1].inside_more_m == 0.0
    assert corner_classes(columns, "ackermann", ~all_of(count + 1))[1].inside_more_m == 0.0


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
