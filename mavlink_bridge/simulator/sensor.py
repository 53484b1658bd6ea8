"""A distance sensor on the rover: what it sees of discs in the field, in 72 sectors of 5° as ArduPilot takes them."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mavlink_bridge.simulator.config import MovingDisc
    from mavlink_bridge.simulator.flat import FlatFrame

SECTORS = 72
_STEP = 2 * math.pi / SECTORS
_LEAST_CM = 20
_LASER = 0  # MAV_DISTANCE_SENSOR_LASER
_BODY_FRD = 12  # MAV_FRAME_BODY_FRD
_RAYS = 5  # in a sector; the nearest counts


def place_at(disc: MovingDisc, frame: FlatFrame, now_s: float) -> complex:
    """Return where the middle of a disc is, in metres north and east of the frame's origin."""
    way = cmath.rect(disc.speed_mps * max(0.0, now_s - disc.from_s), math.radians(disc.heading_deg))
    return frame.to_flat(disc.centre) + way


def distances_cm(
    discs: Iterable[tuple[complex, float]], here_m: complex, heading_rad: float, sees_m: float
) -> tuple[int, ...]:
    """Return the nearest disc in each sector, the first one about the front; one more than it sees where there is none.

    Parameters
    ----------
    discs : iterable of tuple of complex and float
        Middle and radius of each.
    here_m : complex
        Where the sensor is.
    heading_rad : float
        Where its front points, clockwise from north.
    sees_m : float
        How far it sees.
    """
    nothing = round(sees_m * 100) + 1
    found = [nothing] * SECTORS
    for centre_m, radius_m in discs:
        away_m = (centre_m - here_m) * cmath.exp(-1j * heading_rad)
        if abs(away_m) - radius_m > sees_m:
            continue
        middle = cmath.phase(away_m)
        half = math.asin(radius_m / abs(away_m)) if abs(away_m) > radius_m else math.pi
        for sector in range(SECTORS):
            if abs(math.remainder(sector * _STEP - middle, 2 * math.pi)) > half + _STEP:
                continue
            for ray in range(_RAYS):
                bearing = (sector + ray / (_RAYS - 1) - 0.5) * _STEP
                seen_m = _along_m(away_m, radius_m, bearing)
                if seen_m is not None and seen_m <= sees_m:
                    found[sector] = min(found[sector], max(_LEAST_CM, round(seen_m * 100)))
    return tuple(found)


def _along_m(away_m: complex, radius_m: float, bearing: float) -> float | None:
    """Return where a ray first meets a disc; None where it does not."""
    turned = away_m * cmath.exp(-1j * bearing)
    if abs(turned) <= radius_m:
        return 0.0
    inside = radius_m**2 - turned.imag**2
    return turned.real - math.sqrt(inside) if inside >= 0 and turned.real > 0 else None


def obstacle_distance(distances: tuple[int, ...], time_s: float, sees_m: float) -> m.ObstacleDistance:
    """Return distances as a message, counted from the front."""
    return m.ObstacleDistance(
        round(time_s * 1e6),
        _LASER,
        distances,
        360 // SECTORS,
        _LEAST_CM,
        round(sees_m * 100),
        frame=_BODY_FRD,
    )
