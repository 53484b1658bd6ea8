"""The moves of the local search: what can be done where the band of drawn lines comes too near to a fence.

**How.** Each move takes lines and the number of a point and yields lines that may do better: other points, or the same ones driven
slower. It judges nothing. A candidate may lead through a fence or turn sharper than before; `cost` measures it, and `local_search` keeps the
best. Start and targets never move.

**Why these.** A band comes too near to a fence for a few reasons, and each has its moves. A corner is cut or swung out of: move it
(`moved`, `together`), turn earlier or later (`prolonged`), or make two gentler ones of it (`split`). A leg passes a fence: bend it (`bent`), or lay
it straight through the gap (`gap.straight_through`). Corners are so near to one another that their swings add up: leave one out or merge them
(`without`, `merged`). The vehicle starts facing the wrong way (`headed`), or comes to a target from a bad side (`approached`). What is left is
speed, which costs most: cuts shrink with it (`slowed`, `crawling`, `stopped`).

**Why so coarse.** A move offers a few lengths, each one and a half to two times the last, instead of a fine scale, because each candidate costs a
measurement. What was moved too far comes back afterwards in fine steps (`eased`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from missions.fitting import polyline as drawn
from missions.fitting.polyline import Drawing, shifted
from missions.geo import LocalPoint, Vector, heading_vector

MOVES = (0.5, 1.0, 1.5, 2.5)
"""How far `moved` moves a corner, in multiples of what is missing. Chosen, not measured."""

# How far a turn is put off; chosen, not measured: bounds the candidates to 20 a corner
PROLONGED_M = (3.0, 6.0, 10.0, 15.0)
SPACINGS_M = (6.0, 10.0, 15.0, 20.0)  # between the corners that one is split into; chosen, not measured
NEAR_SPACINGS_M = (4.0, 6.0, 10.0)  # where there is a corner that keeps enough already; chosen, not measured
SLOW_MPS = (3.0, 2.0, 1.0)
SLOW_BEFORE_M = {3.0: 10.0, 2.0: 10.0, 1.0: 5.0}
SLOW_AFTER_M = (6.0, 15.0)
"""Measured on corners: 1 m/s from 5 m before to 6 m after takes away the cut (1.8 to 0.3 m), 2 m/s from 10 m before leaves 0.57 m; 5 m before
is as good as 10 or 15 (rows ``slow`` of benchmarks/data). 3 m/s was not measured there. 15 m after is for narrow lanes, which are longer."""

APART_M = 3.0
"""Turns nearer to one another are one turn to a rover, as for `drive_model.corner.NEAR_M`."""

REJOINED_M = (
    0.3,
    0.7,
    1.2,
    2.0,
    3.0,
)  # how far out one corner in the place of several may lie; as coarse as `MOVES`
QUICK_AFTER_M, QUICK_BEFORE_M = (0.0, 6.0, 15.0), (0.0, 5.0, 10.0)
"""What of a slow leg stays slow behind its first corner and before its last: as `SLOW_AFTER_M` and `SLOW_BEFORE_M`."""

CHANGE_TURN_DEG, CHANGE_AWAY_M = 8.0, 4.0
"""The speed changes on a straight line only, 4 m from any turn of more than 8°: at corners it was not measured (docs/drive-model.md)."""

STOP_S = 1.0  # param1 of a waypoint: any delay stops the rover, and one second is what was measured (rows ``delay`` of benchmarks/data)

# Chosen, not measured; the drive model judges what comes of them.
CRAWL_M = 18.0  # before and after a spot that is crawled past
HEAD_M = (5.0, 9.0, 15.0)  # lengths of a first leg the way the vehicle faces
SIDE_DEG = (0.0, 35.0, -35.0, 70.0, -70.0)  # and how far to a side of that it leads
APPROACHES = 8  # sides from which a fixed point is approached, evenly all round
APPROACH_M = (8.0, 16.0)  # and from how far
SHARP_DEG = 110.0  # a sharper corner may be split into three; beyond 115° on short legs the drive model gives no bound


def moved(drawing: Drawing, index: int, missing_m: float) -> Iterator[Drawing]:
    """Move a corner outwards; where that does not help, inwards or sideways."""
    if drawn.is_end_or_fixed(drawing, index):
        return
    out = drawn.outward(drawing, index)
    if out is None:
        ahead = drawn.direction(drawing[index - 1], drawing[index])
        out = (-ahead[1], ahead[0])
    along = (-out[1], out[0])
    ways = (out, (-out[0], -out[1]), *(_between(out, side) for side in (along, (-along[0], -along[1]))))
    half_rad = math.radians(abs(drawn.turn_deg(drawing, index))) / 2
    # Moved out by d, a corner takes its legs d cos(half the turn) away; 5 cm more, so that little missing moves it too.
    unit_m = missing_m / max(math.cos(half_rad), 0.4) + 0.05
    for way in (*ways, along, (-along[0], -along[1])):
        for share in MOVES:
            yield _with(drawing, index, shifted(drawing[index].place, way, unit_m * share))


def eased(drawing: Drawing, index: int, step_m: float) -> Iterator[Drawing]:
    """Move a corner a step back towards the straight line, or along its legs; a change of speed along its line."""
    if drawn.is_end_or_fixed(drawing, index):
        return
    out = drawn.outward(drawing, index)
    if out is None or abs(drawn.turn_deg(drawing, index)) < CHANGE_TURN_DEG:
        for other in (index - 1, index + 1):
            if math.dist(drawing[index].place, drawing[other].place) > step_m + APART_M:
                way = drawn.direction(drawing[index], drawing[other])
                yield _with(drawing, index, shifted(drawing[index].place, way, step_m))
    if out is None:
        return
    along = (-out[1], out[0])
    back = (-out[0], -out[1])
    for way in (back, along, (out[1], -out[0])):
        yield _with(drawing, index, shifted(drawing[index].place, way, step_m))


def bent(
    drawing: Drawing, index: int, place: LocalPoint, away: Vector, missing_m: float
) -> Iterator[Drawing]:
    """Bend the leg to a point, or the one after it, away from a fence by a corner at a place beside it."""
    along = drawn.distances_m(drawing)
    longer, there = drawn.with_point_at(drawing, _along_m(drawing, along, place, index), APART_M)
    if len(longer) > len(drawing):
        for share in (1.0, 1.6, 2.5):  # as coarse as `MOVES`, and 5 cm on top
            yield _with(longer, there, shifted(longer[there].place, away, share * missing_m + 0.05))


def together(drawing: Drawing, index: int, missing_m: float) -> Iterator[Drawing]:
    """Move a corner and the next one, or the one before, the same way."""
    for other in (index - 1, index + 1):
        if drawn.is_end_or_fixed(drawing, index) or drawn.is_end_or_fixed(drawing, other):
            continue
        for number in range(8):
            way = heading_vector(45.0 * number)
            for share in (0.7, 1.5, 3.0):  # as coarse as `MOVES`, in eight directions
                by_m = share * missing_m + 0.02
                both = _with(drawing, index, shifted(drawing[index].place, way, by_m))
                yield _with(both, other, shifted(drawing[other].place, way, by_m))


def prolonged(drawing: Drawing, index: int) -> Iterator[Drawing]:
    """Turn later, or earlier, on the line of one of its legs; the corner itself may stay as a point of the line."""
    if drawn.is_end_or_fixed(drawing, index):
        return
    here = drawing[index]
    before, after = drawn.directions(drawing, index)
    for length_m in PROLONGED_M:
        later = here.at(shifted(here.place, before, length_m))
        earlier = here.at(shifted(here.place, after, -length_m))
        yield (*drawing[:index], later, *drawing[index + 1 :])
        yield (*drawing[:index], earlier, *drawing[index + 1 :])
        yield (*drawing[:index], earlier, later, *drawing[index + 1 :])
        yield (*drawing[:index], here, later, *drawing[index + 1 :])
        yield (*drawing[:index], earlier, here, *drawing[index + 1 :])


def without(drawing: Drawing, index: int) -> Iterator[Drawing]:
    """Leave a corner out."""
    if not drawn.is_end_or_fixed(drawing, index):
        yield (*drawing[:index], *drawing[index + 1 :])


def merged(drawing: Drawing, index: int) -> Iterator[Drawing]:
    """Make one corner of this one and the next: where the outer legs meet, or half-way."""
    if drawn.is_end_or_fixed(drawing, index) or drawn.is_end_or_fixed(drawing, index + 1):
        return
    here, following = drawing[index], drawing[index + 1]
    (east_a, north_a), (east_b, north_b) = here.place, following.place
    middle = LocalPoint((east_a + east_b) / 2, (north_a + north_b) / 2)
    meeting = drawn.crossing(drawing[index - 1], here, following, drawing[index + 2])
    for place in (meeting, middle):
        if place is not None and math.dist(place, middle) < 3 * math.dist(here.place, following.place):
            yield (*drawing[:index], following.at(place), *drawing[index + 2 :])


def rejoined(drawing: Drawing, index: int) -> Iterator[Drawing]:
    """Make one corner of this one and the next, or the next two, farther out than where the outer legs meet.

    Short legs are slow, and one corner farther out is often quicker than two that keep close to a fence.
    """
    for last in range(index + 1, min(index + 3, len(drawing) - 1)):
        if any(drawn.is_end_or_fixed(drawing, number) for number in range(index, last + 1)):
            return
        first, final = drawing[index], drawing[last]
        meeting = drawn.crossing(drawing[index - 1], first, final, drawing[last + 1])
        spread_m = math.dist(first.place, final.place)
        if meeting is None or math.dist(meeting, first.place) > 3 * spread_m + REJOINED_M[-1]:
            continue
        single = (*drawing[:index], final.at(meeting), *drawing[last + 1 :])
        yield single
        if (out := drawn.outward(single, index)) is not None:
            for out_m in REJOINED_M:
                yield _with(single, index, shifted(meeting, out, out_m))


def quickened(drawing: Drawing, index: int, speed_mps: float) -> Iterator[Drawing]:
    """Drive the slow stretch that begins with the leg to a point faster: all of it, this leg, or the middle of this leg."""
    slow_mps = drawing[index].speed_mps
    if slow_mps is None:
        return
    ends = (number for number in range(index, len(drawing)) if drawing[number].speed_mps != slow_mps)
    end = next(ends, len(drawing))
    faster = [None, *(other for other in SLOW_MPS if slow_mps < other < speed_mps)]
    is_first = drawing[index - 1].speed_mps != slow_mps or index == 1
    for quick_mps in faster:
        quick = [point._replace(speed_mps=quick_mps) for point in drawing]
        if is_first and end > index + 1:
            yield (*drawing[:index], *quick[index:end], *drawing[end:])
        yield (*drawing[:index], quick[index], *drawing[index + 1 :])
    length_m = math.dist(drawing[index - 1].place, drawing[index].place)
    ahead = drawn.direction(drawing[index - 1], drawing[index])
    for after_m, before_m in itertools.product(QUICK_AFTER_M, QUICK_BEFORE_M):
        if length_m - after_m - before_m < APART_M:
            continue
        points = [
            drawing[index].at(place)._replace(is_fixed=False, stop_s=None)
            for place in (
                shifted(drawing[index - 1].place, ahead, after_m),
                shifted(drawing[index].place, ahead, -before_m),
            )
        ]
        for quick_mps in faster:
            if after_m or before_m:
                slow = points[:1] if after_m else []
                last, rest = (points[1], index) if before_m else (drawing[index], index + 1)
                yield (*drawing[:index], *slow, last._replace(speed_mps=quick_mps), *drawing[rest:])


def split(drawing: Drawing, index: int, spacings_m: tuple[float, ...] = SPACINGS_M) -> Iterator[Drawing]:
    """Make two gentler corners of one, or three: round the outside of it."""
    out = None if drawn.is_end_or_fixed(drawing, index) else drawn.outward(drawing, index)
    if out is None:
        return
    turn_deg = abs(drawn.turn_deg(drawing, index))
    before, after = drawn.directions(drawing, index)
    middle = _between(before, after) if turn_deg < 175 else (-out[1], out[0])
    here = drawing[index]
    # The shares of a spacing below are chosen, not measured: shapes to try.
    for spacing_m in spacings_m:
        for out_m in (0.0, 0.35 * spacing_m):
            first = shifted(shifted(here.place, out, out_m), middle, -spacing_m / 2)
            second = shifted(shifted(here.place, out, out_m), middle, spacing_m / 2)
            yield (*drawing[:index], here.at(first), here.at(second), *drawing[index + 1 :])
        if turn_deg > SHARP_DEG:
            top = here.at(shifted(here.place, out, spacing_m * 0.7))
            sides = [here.at(shifted(here.place, middle, side * spacing_m * 0.7)) for side in (-1, 1)]
            yield (*drawing[:index], sides[0], top, sides[1], *drawing[index + 1 :])
    for side in (-1, 1):  # round by one side: off one leg, and back across the corner
        for spacing_m in SPACINGS_M[1:]:
            other = shifted(shifted(here.place, out, spacing_m / 2), middle, side * spacing_m)
            pair = (here, here.at(other)) if side > 0 else (here.at(other), here)
            yield (*drawing[:index], *pair, *drawing[index + 1 :])


def slowed(drawing: Drawing, index: int, place: LocalPoint, speed_mps: float) -> Iterator[Drawing]:
    """Drive a stretch slower than at a speed: from before a place near a point, or the leg to it, to behind it."""
    along = drawn.distances_m(drawing)
    at_m = _along_m(drawing, along, place, index)
    for slow_mps, after_m in itertools.product((slow for slow in SLOW_MPS if slow < speed_mps), SLOW_AFTER_M):
        begin_m = max(at_m - max(SLOW_BEFORE_M[slow_mps], after_m - 1.0), 0.0)
        end_m = min(at_m + after_m, along[-1])
        longer, first = _with_change(drawing, begin_m, -1.0)
        longer, last = _with_change(longer, end_m, 1.0)
        if last > first:
            yield tuple(
                _slower(point, slow_mps) if first < number <= last else point
                for number, point in enumerate(longer)
            )


def crawling(drawing: Drawing, spots: list[LocalPoint], speed_mps: float) -> Drawing:
    """Drive at the slowest speed for a good way about each of some spots near the lines."""
    slow_mps = min(SLOW_MPS)
    if slow_mps >= speed_mps:
        return drawing
    stretches = []
    for spot in spots:
        along = drawn.distances_m(drawing)
        at_m = min(
            (_along_m(drawing, along, spot, index) for index in range(1, len(drawing))),
            key=lambda there_m: math.dist(drawn.place_at(drawing, there_m), spot),
        )
        begin_m, end_m = max(at_m - CRAWL_M, 0.0), min(at_m + CRAWL_M, along[-1])
        drawing, first = _with_change(drawing, begin_m, -1.0)
        drawing, last = _with_change(drawing, end_m, 1.0)
        along = drawn.distances_m(drawing)
        stretches.append((along[first] - 0.01, along[last] + 0.01))
    along = drawn.distances_m(drawing)
    return tuple(
        _slower(point, slow_mps)
        if number
        and any(begin_m <= along[number - 1] and along[number] <= end_m for begin_m, end_m in stretches)
        else point
        for number, point in enumerate(drawing)
    )


def stopped(drawing: Drawing, index: int) -> Iterator[Drawing]:
    """Stop at a corner (for rovers that turn on the spot)."""
    if 0 < index < len(drawing) - 1:
        yield (*drawing[:index], drawing[index]._replace(stop_s=STOP_S), *drawing[index + 1 :])


def headed(drawing: Drawing, heading_deg: float) -> Iterator[Drawing]:
    """Begin with a leg the way the vehicle faces, or with two that bring it round."""
    start = drawing[0]
    for length_m in HEAD_M:
        for side_deg in SIDE_DEG:
            first = start.at(shifted(start.place, heading_vector(heading_deg + side_deg), length_m))
            first = first._replace(is_fixed=False)
            yield (start, first, *drawing[1:])
            if side_deg:
                # Chosen: on round to the same side, to come back to the route behind.
                second = first.at(
                    shifted(first.place, heading_vector(heading_deg + 2.5 * side_deg), length_m)
                )
                yield (start, first, second, *drawing[1:])


def approached(drawing: Drawing, index: int) -> Iterator[Drawing]:
    """Come to a fixed point, or leave it, from another side."""
    here = drawing[index]
    for number in range(APPROACHES):
        way = heading_vector(360.0 * number / APPROACHES)
        for length_m in APPROACH_M:
            point = here.at(shifted(here.place, way, length_m))._replace(is_fixed=False, stop_s=None)
            if index:
                yield (*drawing[:index], point, *drawing[index:])
            if index < len(drawing) - 1:
                yield (*drawing[: index + 1], point, *drawing[index + 1 :])


def _with(drawing: Drawing, index: int, place: LocalPoint) -> Drawing:
    return (*drawing[:index], drawing[index].at(place), *drawing[index + 1 :])


def _between(a: Vector, b: Vector) -> Vector:
    length = math.hypot(a[0] + b[0], a[1] + b[1]) or 1.0
    return ((a[0] + b[0]) / length, (a[1] + b[1]) / length)


def _with_change(drawing: Drawing, along_m: float, way: float) -> tuple[Drawing, int]:
    """Return the lines with a point where the speed may change, and its number: on a straight line, beyond any corner nearby."""
    for _ in drawing:
        along = drawn.distances_m(drawing)
        corner_m = next(
            (
                along[index]
                for index in range(1, len(drawing) - 1)
                if abs(along[index] - along_m) < CHANGE_AWAY_M
                and abs(drawn.turn_deg(drawing, index)) > CHANGE_TURN_DEG
            ),
            None,
        )
        if corner_m is None:
            break
        along_m = corner_m + way * (CHANGE_AWAY_M + 0.01)
    return drawn.with_point_at(drawing, min(max(along_m, 0.0), along[-1]), APART_M)


def _slower(point: drawn.DrawnPoint, speed_mps: float) -> drawn.DrawnPoint:
    return point._replace(speed_mps=speed_mps if point.speed_mps is None else min(speed_mps, point.speed_mps))


def _along_m(drawing: Drawing, along: list[float], place: LocalPoint, index: int) -> float:
    """Return how far a place lies along the leg to a point, or along the one after it."""
    best = (math.inf, along[index])
    for leg in (index - 1, index):
        if 0 <= leg < len(drawing) - 1:
            ahead = drawn.direction(drawing[leg], drawing[leg + 1])
            length_m = along[leg + 1] - along[leg]
            here = drawing[leg].place
            off = (place[0] - here[0], place[1] - here[1])
            there_m = min(max(off[0] * ahead[0] + off[1] * ahead[1], 0.0), length_m)
            away_m = math.dist(place, shifted(here, ahead, there_m))
            best = min(best, (away_m, along[leg] + there_m))
    return best[1]
