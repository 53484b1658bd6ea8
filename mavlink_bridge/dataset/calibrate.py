"""One rover's corners and legs beside the drive model's bounds, as its calibration."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from mavlink_bridge.errors import DatasetError
from missions.firmware import read_firmware
from missions.formats.calibration import write
from missions.situation import Calibration, CornerClass, LegClass
from missions.vehicle import vehicle_from_parameters
from missions.vehicle.calibration import (
    LEAST_CORNERS,
    SPEED_STEP_MPS,
    TURN_STEP_DEG,
    bends_the_track,
    least_more_m,
    speed_class,
    turn_class,
)
from missions.vehicle.parameters import PARAMETERS
from missions.words import counted

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mavlink_bridge.dataset.store import Dataset
    from missions.vehicle import Vehicle

WITHIN: Final = 0.99
CONFIDENCE: Final = 0.95
"""A narrowed bound holds so many corners of its class, with this confidence."""

MOST_GAP_M: Final = 1.0
"""Corners whose positions lie farther apart than this do not narrow a bound: between them the cut may have been deeper. Chosen: at this spacing an arc of 2 m radius is
missed by 0.06 m at the most."""

NEARLY = 0.1
"""Corners between legs that were driven at another speed than predicted, by more than this share, do not narrow a bound: something that the log does not tell slowed the
rover. Chosen: half a class at 2.5 m/s."""

_ROUNDED = 3  # decimals of metres in the file; away from the safe side by nothing: it is rounded up


@dataclass(frozen=True, slots=True)
class Calibrated:
    """A calibration, with what to know of it.

    Parameters
    ----------
    system : int
    calibration : Calibration
    remarks : tuple of str
        What could not be used, and why.
    """

    system: int
    calibration: Calibration
    remarks: tuple[str, ...]


_CORNERS = """SELECT log, drive, abs(turn_deg) AS turn_deg, greatest(speed_mps, coalesce(next_mps, 0)) AS speed_mps, stands,
    inside_cut_m - predicted_inside_cut_m AS inside_m, outside_overshoot_m - predicted_outside_overshoot_m AS outside_m,
    greatest(coalesce(inside_beyond_m, 0), coalesce(outside_beyond_m, 0)) AS beyond_m,
    gap_m, coalesce(is_bounded, false) AS is_bounded, coalesce(off_speed <= $nearly AND next_off_speed <= $nearly, false) AS is_at_speed
FROM (SELECT *, lead(speed_mps) OVER one_drive AS next_mps, lead(off_speed) OVER one_drive AS next_off_speed
    FROM (SELECT *, abs(driven_mps / predicted_driven_mps - 1) AS off_speed FROM legs WHERE vehicle = $system)
    WINDOW one_drive AS (PARTITION BY log, vehicle, drive ORDER BY leg))
WHERE turn_deg IS NOT NULL AND is_whole AND predicted_inside_cut_m IS NOT NULL ORDER BY log, drive, leg"""
_LEGS = """SELECT speed_mps, straight_m - predicted_straight_m AS more_m FROM legs
WHERE vehicle = ? AND is_whole AND straight_m IS NOT NULL AND predicted_straight_m IS NOT NULL"""
_DRIVES = "SELECT count(*) FROM (SELECT DISTINCT log, drive FROM legs WHERE vehicle = ? AND is_whole AND predicted_straight_m IS NOT NULL)"
_NEWEST = """SELECT v.log, v.firmware FROM vehicles v WHERE v.vehicle = ? AND v.driven_m > 0
ORDER BY EXISTS (SELECT 1 FROM parameters p WHERE p.vehicle = v.vehicle AND p.log = v.log AND p.name = ANY(?)) DESC,
    v.begins_utc DESC NULLS LAST, v.log LIMIT 1"""
_SAME = """SELECT v.log FROM vehicles v WHERE v.vehicle = $system AND v.firmware IS NOT DISTINCT FROM $firmware AND NOT EXISTS
    (SELECT 1 FROM parameters n LEFT JOIN parameters p ON p.name = n.name AND p.vehicle = n.vehicle AND p.log = v.log
    WHERE n.vehicle = $system AND n.log = $newest AND n.name = ANY($bending) AND p.value IS DISTINCT FROM n.value)
AND NOT EXISTS (SELECT 1 FROM events e WHERE e.vehicle = $system AND e.log = v.log AND e.event = 'parameter' AND e.name = ANY($bending))"""
_TWICE = """WITH d AS (SELECT d.log, d.drive, d.driven_s, v.begins_utc + to_microseconds(CAST(d.begun_s * 1e6 AS BIGINT)) AS begun_utc
    FROM drives d LEFT JOIN vehicles v USING (log, month, vehicle) WHERE d.vehicle = ?)
SELECT DISTINCT a.log FROM d a JOIN d b ON a.log > b.log AND a.begun_utc < b.begun_utc + to_microseconds(CAST(b.driven_s * 1e6 AS BIGINT))
    AND b.begun_utc < a.begun_utc + to_microseconds(CAST(a.driven_s * 1e6 AS BIGINT))
UNION SELECT log FROM d WHERE begun_utc IS NULL"""
"""Recordings of drives of which another log has a recording too, by the time of day; and those without one, of which that is not known."""


def calibrate(dataset: Dataset, system: int | None) -> Calibrated:
    """Return one rover's calibration.

    Parameters
    ----------
    dataset : Dataset
    system : int or None
        Which vehicle; None where the dataset has one that drove missions.

    Raises
    ------
    DatasetError
        The vehicle has no drives that were predicted; or there are several vehicles, and none was chosen.
    """
    with dataset.readable(), contextlib.closing(dataset.open()) as database:
        system = _chosen(database, system)
        (drives,) = database.execute(_DRIVES, [system]).fetchone()
        if not drives:
            raise DatasetError(
                f"vehicle {system} has no drive in this dataset that the drive model predicts: there is nothing to calibrate from",
                system=system,
                advice="record AUTO missions of plain waypoints, with mission and parameters in the log",
            )
        named = [one for one in PARAMETERS if bends_the_track(one)]
        newest, version = database.execute(_NEWEST, [system, named]).fetchone()
        query = "SELECT name, value FROM parameters WHERE vehicle = ? AND log = ? AND isfinite(value) ORDER BY name"
        parameters = dict(database.execute(query, [system, newest]).fetchall())
        bending = [name for name in parameters if bends_the_track(name)]
        same = {"system": system, "firmware": version, "newest": newest, "bending": bending}
        known = {log for (log,) in database.execute(_SAME, same).fetchall()} if bending else set()
        twice = {log for (log,) in database.execute(_TWICE, [system]).fetchall()}
        corners = database.execute(_CORNERS, {"system": system, "nearly": NEARLY}).fetchnumpy()
        legs = database.execute(_LEGS, [system]).fetchnumpy()
    firmware = read_firmware(version) if version else None
    vehicle = vehicle_from_parameters(parameters, firmware=firmware)
    logs = corners["log"].astype(str)
    is_tuned_so = np.isin(logs, sorted(known))
    is_once = ~np.isin(logs, sorted(twice))
    calibration = Calibration(
        system=system,
        drives=int(drives),
        steering=str(vehicle.steering),
        corners=tuple(corner_classes(corners, vehicle, is_tuned_so & is_once)),
        legs=tuple(leg_classes(legs)),
        parameters=parameters,
        firmware=None if firmware is None else str(firmware),
    )
    is_at_speed = corners["is_at_speed"].astype(bool)
    return Calibrated(system, calibration, tuple(_remarks(calibration, is_tuned_so, is_once, is_at_speed)))


def _chosen(database: Any, system: int | None) -> int:  # noqa: ANN401 - a duckdb connection
    found = [one for (one,) in database.execute("SELECT DISTINCT vehicle FROM legs ORDER BY 1").fetchall()]
    if system is not None:
        if system not in found:
            raise DatasetError(
                f"the dataset has no drives of vehicle {system}, only of {', '.join(map(str, found)) or 'none'}",
                system=system,
                vehicles=found,
                advice="choose one of them: --system N"
                if found
                else "build a dataset from logs with AUTO missions",
            )
        return system
    if len(found) != 1:
        names = ", ".join(map(str, found)) or "none"
        raise DatasetError(
            f"a calibration is of one rover; the dataset has drives of vehicles: {names}",
            vehicles=found,
            advice="choose one: --system N" if found else "build a dataset from logs with AUTO missions",
        )
    return int(found[0])


def corner_classes(
    columns: dict[str, NDArray[Any]], vehicle: Vehicle, is_tuned_so: NDArray[np.bool_]
) -> list[CornerClass]:
    """Return what each class of corners adds to the model's bounds, or takes from them.

    Parameters
    ----------
    columns : dict of str to ndarray, shape (n,)
        Of each corner: ``turn_deg``, ``speed_mps``, ``stands``, ``inside_m`` and ``outside_m`` (measured less its bound), ``beyond_m`` (outside the
        corridor), ``gap_m``, ``is_bounded``, ``is_at_speed`` (whether the legs at it were driven at the speed in force).
    vehicle : Vehicle
    is_tuned_so : ndarray of bool, shape (n,)
        Whether it was driven with the parameters that the rover has now; others widen, and do not narrow.
    """
    turns = np.array([turn_class(turn_deg) for turn_deg in columns["turn_deg"].tolist()], dtype=np.int64)
    speeds = np.array([speed_class(speed_mps) for speed_mps in columns["speed_mps"].tolist()], dtype=np.int64)
    stands = columns["stands"].astype(bool)
    tells = is_tuned_so & (columns["gap_m"] <= MOST_GAP_M)
    tells &= columns["is_bounded"].astype(bool) & columns["is_at_speed"].astype(bool)
    found = []
    for turn, speed, stood in sorted(set(zip(turns.tolist(), speeds.tolist(), stands.tolist(), strict=True))):
        these = (turns == turn) & (speeds == speed) & (stands == stood)
        least = least_more_m(vehicle, turn, speed, stands=stood)
        found.append(
            CornerClass(
                turn_from_deg=turn * TURN_STEP_DEG,
                turn_to_deg=(turn + 1) * TURN_STEP_DEG,
                speed_from_mps=speed * SPEED_STEP_MPS,
                speed_to_mps=(speed + 1) * SPEED_STEP_MPS,
                stands=stood,
                corners=int(these.sum()),
                inside_more_m=more_m(columns["inside_m"][these], tells[these], least[0], Side.INSIDE),
                outside_more_m=more_m(columns["outside_m"][these], tells[these], least[1], Side.OUTSIDE),
                beyond_m=_rounded_up(float(columns["beyond_m"][these].max())),
            )
        )
    return found


class Side(IntEnum):
    """Which of a corner's two bounds."""

    INSIDE = 0
    OUTSIDE = 1


def more_m(excess_m: NDArray[np.float64], tells: NDArray[np.bool_], least_m: float, side: Side) -> float:
    """Return what is added to a bound.

    With `LEAST_CORNERS` corners that may narrow it, or more: the order statistic of `ranks_of_bounds`, of those corners or of all of the class, whichever is larger,
    and no less than the autopilot's measured rows allow. With fewer the largest excess of all, where that is above 0: any sample may widen.

    Parameters
    ----------
    excess_m : ndarray of float, shape (n,)
        Measured less the bound.
    tells : ndarray of bool, shape (n,)
        Which of them may narrow it.
    least_m : float
        As far as measured rows allow, 0 or negative.
    side : Side
    """
    known = excess_m[tells]
    if len(known) < LEAST_CORNERS:
        return _rounded_up(max(0.0, float(excess_m.max())))
    bound_m = max(float(np.sort(one)[ranks_of_bounds(len(one))[side] - 1]) for one in (known, excess_m))
    return _rounded_up(max(bound_m, least_m))


def ranks_of_bounds(count: int) -> tuple[int, int]:
    """Return the ranks, from 1, of the order statistics that bound cut and overshoot.

    Each holds 99 % of all corners with 95 % confidence; from 473 corners on both together do: as many corners as one bound alone might leave outside are shared among the
    two (statistically equivalent blocks: Tukey, Annals of Mathematical Statistics 18, 1947, 529-539; that they are counted apart errs to the safe side). With fewer corners both are the largest.
    """
    blocks = count + 1 - rank_of_bound(count)
    return count + 1 - (blocks + 1) // 2, count + 1 - max(1, blocks // 2)


def rank_of_bound(count: int, within: float = WITHIN, confidence: float = CONFIDENCE) -> int:
    """Return the rank, from 1, of the order statistic of a sample that holds a share of all with a confidence; one above the largest where the sample is too small.

    The r-th smallest of n lies above the share p with the probability that fewer than r of n lie within: the binomial distribution function at r - 1
    (David and Nagaraja, Order Statistics, 3rd edition, 2003, section 7.2).
    """
    beyond = 0  # so many of the sample may lie above the bound
    chance = 0.0
    while beyond <= count:
        chance += math.exp(
            math.lgamma(count + 1)
            - math.lgamma(beyond + 1)
            - math.lgamma(count - beyond + 1)
            + beyond * math.log1p(-within)
            + (count - beyond) * math.log(within)
        )
        if chance > 1 - confidence:
            break
        beyond += 1
    return count - beyond + 1


def leg_classes(columns: dict[str, NDArray[Any]]) -> list[LegClass]:
    """Return what each class of straight legs adds to the band: the largest excess of its sample, or nothing."""
    speeds = np.array([speed_class(speed_mps) for speed_mps in columns["speed_mps"].tolist()], dtype=np.int64)
    found = []
    for speed in sorted(set(speeds.tolist())):
        most_m = float(columns["more_m"][speeds == speed].max())
        ends = (speed * SPEED_STEP_MPS, (speed + 1) * SPEED_STEP_MPS)
        found.append(LegClass(*ends, int((speeds == speed).sum()), _rounded_up(max(most_m, 0.0))))
    return found


def _rounded_up(value_m: float) -> float:
    scale = 10.0**_ROUNDED
    return math.ceil(value_m * scale - 1e-9) / scale


def _remarks(
    calibration: Calibration,
    is_tuned_so: NDArray[np.bool_],
    is_once: NDArray[np.bool_],
    is_at_speed: NDArray[np.bool_],
) -> list[str]:
    few = sum(one.corners < LEAST_CORNERS for one in calibration.corners)
    remarks = []
    if few:
        remarks.append(
            f"{few} of {len(calibration.corners)} classes of corners have fewer than {LEAST_CORNERS} corners: they may widen the corridor, but do not narrow it"
        )
    if others := int((~is_tuned_so).sum()):
        remarks.append(
            f"{counted(others, 'corner')} driven with parameters or firmware that are unknown or not the newest log's: they may widen the corridor, but do not narrow it"
        )
    if twice := int((~is_once).sum()):
        remarks.append(
            f"{counted(twice, 'corner')} in logs without times of day, or at a time when another log of the same system id has drives (another recording, or another rover): they may widen the corridor, but do not narrow it"
        )
    if slowed := int((~is_at_speed).sum()):
        remarks.append(
            f"{counted(slowed, 'corner')} between legs whose speed is unknown or differs by more than {NEARLY:.0%} from the predicted one: they may widen the corridor, but do not narrow it"
        )
    return remarks


def calibration_text(found: Calibrated) -> str:
    """Return the file of a calibration."""
    return write(found.calibration)
