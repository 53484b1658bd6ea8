"""Rally points on random fields: whether the straight line from any point of the route to the one that the autopilot would choose is free.

``python benchmarks/rally.py [--fields N] [--first SEED] [--most N] [-o FILE.md]``. Each field has a route planned as ``pbpp plan`` does; the rally points are
those of ``pbpp rally``. They are checked without the product's geometry: shapely on a flat plane of this script's own, the autopilot's choice written down
from AP_Rally.cpp once more, every 0.1 m of the route (and, every metre, from eight places beside it, as far off as the vehicle may be). A line fails that comes nearer to a
fence than it is to keep, or than the route is where it begins, by more than 2 cm.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from drive_fields import make_field
from drive_more_fields import make_more

from missions.checking.check import check_mission
from missions.errors import MissionError, NoRouteError
from missions.fence import CircleZone, Fence, ZoneKind
from missions.planning.plan import plan
from missions.request import GoTo
from missions.routing.rally_points import MOST_POINTS, choose_rally_points
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from drive_fields import Field
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.geo import LatLon
    from missions.routing.rally_points import RallyChoice

SAMPLE_M = 0.1
TOLERANCE_M = 0.02
"""Two planes differ by less on these fields, and rounding to degE7 moves a place by 8 mm."""

_A_M, _E2 = 6378137.0, 6.69437999014e-3  # WGS 84
_DIRECTIONS = 8


@dataclass(frozen=True)
class Result:
    """What came of a field."""

    kind: str
    seed: int
    count: int | None
    text: str
    lines: int = 0
    broken: int = 0
    least_over_m: float = math.inf


class Plane:
    """Metres about a place, by the ellipsoid's two radii there."""

    def __init__(self, origin: LatLon) -> None:
        w2 = 1 - _E2 * math.sin(math.radians(origin.lat_deg)) ** 2
        self.origin = origin
        self.scale = np.array(
            [
                math.radians(_A_M) / math.sqrt(w2) * math.cos(math.radians(origin.lat_deg)),
                math.radians(_A_M) * (1 - _E2) / w2**1.5,
            ]
        )

    def points(self, places: Sequence[LatLon] | NDArray[np.float64]) -> NDArray[np.float64]:
        """Return places (latitude first) as points, east first."""
        away_deg = np.array(places, dtype=float) - np.array(self.origin)
        return np.asarray(away_deg[:, ::-1] * self.scale)

    def places(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points as places."""
        return np.asarray((points / self.scale)[:, ::-1] + np.array(self.origin))


def allowed_ground(fence: Fence, plane: Plane) -> BaseGeometry:
    """Return where the fence lets a vehicle be."""
    inside, outside = [], []
    for zone in fence.zones:
        if isinstance(zone, CircleZone):
            area = shapely.Point(plane.points([zone.centre])[0]).buffer(zone.radius_m, quad_segs=256)
        else:
            area = shapely.Polygon(plane.points(zone.vertices)).buffer(0)
        (inside if zone.kind is ZoneKind.INCLUSION else outside).append(area)
    ground = shapely.intersection_all(inside)
    return ground.difference(shapely.union_all(outside))


def chosen_by_autopilot(places: NDArray[np.float64], rally: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the nearest rally point of each place as AP_Rally finds it, with Location::get_distance."""
    north_deg = rally[None, :, 0] - places[:, None, 0]
    middle_rad = np.radians((rally[None, :, 0] + places[:, None, 0]) / 2)
    east_deg = (rally[None, :, 1] - places[:, None, 1]) * np.cos(middle_rad)
    return np.asarray(np.hypot(north_deg, east_deg).argmin(axis=1))


def sampled(path: Sequence[LatLon], plane: Plane) -> NDArray[np.float64]:
    """Return places on a path, straight in latitude and longitude, no farther apart than `SAMPLE_M`."""
    parts = []
    for a, b in pairwise(path):
        length_m = float(np.hypot(*(plane.points([b]) - plane.points([a]))[0]))
        shares = np.linspace(0, 1, max(2, math.ceil(length_m / SAMPLE_M) + 1))[:, None]
        parts.append(np.array(a) + shares * (np.array(b) - np.array(a)))
    return np.vstack(parts)


def judged(field: Field, path: Sequence[LatLon], choice: RallyChoice) -> tuple[int, int, float]:
    """Return how many lines were looked at, how many break what they are to keep, and the least that any keeps beyond that."""
    plane = Plane(field.start)
    ground = allowed_ground(field.fence, plane)
    shapely.prepare([ground, ground.boundary])
    rally = np.array(choice.points)
    on_route = sampled(path, plane)
    over_m = [_over_m(plane, ground, on_route, rally, choice.keep_m)]
    off_m = choice.keep_m - choice.clearance_m - TOLERANCE_M
    turns = np.linspace(0, 2 * np.pi, _DIRECTIONS, endpoint=False)
    for turn in turns:
        some = plane.points(on_route[:: round(1 / SAMPLE_M)])
        beside = some + off_m * np.array([math.cos(turn), math.sin(turn)])
        on_route_m = _clearances_m(ground, shapely.points(some))
        far = (
            on_route_m >= choice.keep_m - TOLERANCE_M
        )  # where the route itself is nearer, nothing is promised beside it
        over_m.append(_over_m(plane, ground, plane.places(beside[far]), rally, choice.clearance_m))
    all_m = np.concatenate(over_m)
    return len(all_m), int((all_m < -TOLERANCE_M).sum()), float(all_m.min())


def _over_m(
    plane: Plane,
    ground: BaseGeometry,
    places: NDArray[np.float64],
    rally: NDArray[np.float64],
    keep_m: float,
) -> NDArray[np.float64]:
    """Return how much more each line keeps than it has to."""
    if not len(places):
        return np.empty(0)
    points = plane.points(places)
    goals = plane.points(rally)[chosen_by_autopilot(places, rally)]
    kept_m = _clearances_m(ground, shapely.linestrings(np.stack([points, goals], axis=1)))
    here_m = _clearances_m(ground, shapely.points(points))
    return kept_m - np.minimum(keep_m, np.maximum(here_m - TOLERANCE_M, 0.0))


def _clearances_m(ground: BaseGeometry, shapes: NDArray[np.object_]) -> NDArray[np.float64]:
    away_m = shapely.distance(shapes, ground.boundary)
    return np.where(shapely.covers(ground, shapes), away_m, -1.0)


def one_field(field: Field, most: int) -> Result | None:
    """Plan on a field, choose and check; None where no route was planned."""
    situation = Situation(
        fence=Known(field.fence, None, "benchmark"), home=Known(field.start, None, "benchmark")
    )
    request = GoTo(target=field.target, clearance_m=field.clearance_m, trusts_model=True)
    try:
        planned = plan(situation, request)
    except MissionError:
        return None
    checked = check_mission(Mission(planned.items, planned.home), situation, request)
    try:
        choice = choose_rally_points(checked, situation, request, most)
    except NoRouteError as error:
        return Result(field.kind, field.seed, None, str(error))
    lines, broken, least_m = judged(field, checked.path, choice)
    text = f"{len(choice.points)} points, from {100 * choice.field_share:.0f} % of the free ground too"
    return Result(field.kind, field.seed, len(choice.points), text, lines, broken, least_m)


def table(results: list[Result]) -> str:
    """Return the results by kind of field."""
    rows = [
        "| kind | fields | points needed | none found | lines checked | broken | least beyond what is kept |"
    ]
    rows.append("|---|---|---|---|---|---|---|")
    kinds = sorted({result.kind for result in results})
    for kind in [*kinds, "all"]:
        some = [result for result in results if kind in (result.kind, "all")]
        counts = Counter(result.count for result in some if result.count is not None)
        needed = ", ".join(f"{count}: {number}" for count, number in sorted(counts.items()))
        missing = sum(result.count is None for result in some)
        lines, broken = sum(result.lines for result in some), sum(result.broken for result in some)
        least_m = min((result.least_over_m for result in some), default=math.inf)
        rows.append(
            f"| {kind} | {len(some)} | {needed} | {missing} | {lines} | {broken} | {100 * least_m:.1f} cm |"
        )
    named = [f"* {one.kind}, seed {one.seed}: {one.text}" for one in results if one.count is None]
    return "\n".join([*rows, "", *named])


def main() -> None:
    """Run over fields and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--most", type=int, default=MOST_POINTS)
    parser.add_argument("-o", "--output", type=Path)
    given = parser.parse_args()
    results: list[Result] = []
    unplanned, seed = 0, given.first
    while len(results) < given.fields:
        for make in (make_field, make_more):
            try:
                field = make(seed)
            except ValueError:  # a field without room
                continue
            result = one_field(field, given.most)
            if result is None:
                unplanned += 1
                continue
            results.append(result)
            print(f"{result.kind}, seed {result.seed}: {result.text}; {result.broken} broken", flush=True)
            if len(results) == given.fields:
                break
        seed += 1
    text = f"Seeds {given.first} to {seed - 1}; {unplanned} more fields have no route.\n\n{table(results)}\n"
    print(text)
    if given.output is not None:
        given.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
