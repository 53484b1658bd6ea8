"""Where on a route there is no way home, and what a person should know of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from missions.geo import LatLon, distance_m
from missions.words import counted, metres

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.routing.way_home import WaysHome

_STEP_M = 5.0
"""Between the positions of a route that are looked at: ground without a way home that is smaller is passed in a few seconds. Chosen, not measured."""
_MOST_STEPS = 2000  # on the longest routes they stand farther apart; chosen, not measured


@dataclass(frozen=True, slots=True)
class AlongRoute:
    """What of a route has no way home.

    Parameters
    ----------
    length_m : float
        How long the route is.
    without_m : float
        On how much of it there is none; what of it is forbidden ground does not count, for that is another fault.
    first_without : LatLon or None
        Where that begins.
    first_leg : int or None
        On the leg to which point of the path.
    """

    length_m: float
    without_m: float
    first_without: LatLon | None
    first_leg: int | None


def along(ways: WaysHome, path: Sequence[LatLon]) -> AlongRoute:
    """Look where on a path there is no way home."""
    whole_m = sum(distance_m(a, b) for a, b in pairwise(path))
    step_m = max(_STEP_M, whole_m / _MOST_STEPS)
    without_m, first, first_leg = 0.0, None, None
    for number, (a, b) in enumerate(pairwise(path), 1):
        leg_m = distance_m(a, b)
        pieces = max(1, math.ceil(leg_m / step_m))
        for piece in range(pieces):
            share = (piece + 0.5) / pieces
            position = LatLon(
                a.lat_deg + (b.lat_deg - a.lat_deg) * share, a.lon_deg + (b.lon_deg - a.lon_deg) * share
            )
            if ways.is_allowed(position) and not ways.reaches(position):
                without_m += leg_m / pieces
                first, first_leg = (position, number) if first is None else (first, first_leg)
    return AlongRoute(whole_m, without_m, first, first_leg)


def way_remarks(ways: WaysHome, route: AlongRoute, items: Sequence[int]) -> list[str]:
    """Return warnings of places that no way leads to, and of what of a route has no way home.

    Parameters
    ----------
    ways : WaysHome
        The ways.
    route : AlongRoute
        Those of the route.
    items : sequence of int
        The mission item of each point of the path.
    """
    remarks = [f"no way home leads to {name}: {why}" for name, why in ways.blocked.items()]
    if route.first_leg is not None:
        remarks.append(
            f"no way home from {route.without_m:.0f} m of the route's {route.length_m:.0f} m, "
            f"first on the leg to item {items[route.first_leg]} at {route.first_without}: "
            f"none of {counted(len(ways.places), 'place')} (home, rally points, --place) can be reached "
            f"at {metres(ways.clearance_m)} from every fence"
        )
    return remarks
