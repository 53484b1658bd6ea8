"""Two missions, fences or lists of rally points told apart: what one has and the other has not, and what of the rest is otherwise.

Items are compared in order (`difflib`), so that one that is put in makes no difference of those behind it; a jump is the same where it leads to the same
item, whatever that item's number. Zones are compared whatever their order: alike ones first, of the rest those that cover most of each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from enum import StrEnum
from itertools import zip_longest
from typing import TYPE_CHECKING

import shapely
from shapely import Point, Polygon

from missions.errors import MissionFormatError
from missions.fence import CircleZone, Fence, PolygonZone
from missions.formats.numbers import has_place, without_nan
from missions.formats.parts import Part
from missions.geo import distance_and_bearing, path_length_m
from missions.ground.frame import frame_around
from missions.items import Command, file_frame
from missions.situation import Mission
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from shapely.geometry.base import BaseGeometry

    from missions.fence import Zone
    from missions.geo import LatLon
    from missions.ground.frame import LocalFrame
    from missions.items import MissionItem
    from missions.rally import RallyPoint
    from missions.situation import Situation

_SAME_ZONE = 0.2
"""Zones that share less of the ground that both cover together are two zones (chosen): one was taken away, the other drawn."""

_ROUNDED_M = 0.02
"""Positions nearer than this are the same: formats round to degE7 or to some more digits, which is 11 mm."""

_SINGLE = 2.0**-23
"""Between neighbours of the 32-bit numbers that vehicles keep, as a share of them."""

_PARAMS: dict[tuple[int, int], str] = {
    (Command.NAV_WAYPOINT, 1): "stop (s)",
    (Command.NAV_LOITER_TIME, 1): "time (s)",
    (Command.NAV_LOITER_TURNS, 1): "turns",
    (Command.DO_CHANGE_SPEED, 2): "speed (m/s)",
    (Command.DO_JUMP, 1): "jump to item",
    (Command.DO_JUMP, 2): "times",
}
"""What people call a parameter; the others are called param1 to param4."""

_JUMPS = (Command.DO_JUMP, Command.DO_SET_MISSION_CURRENT)


class ChangeKind(StrEnum):
    """How two files differ at a place, as differences of texts are marked."""

    ONLY_A = "-"
    ONLY_B = "+"
    OTHER = "~"


@dataclass(frozen=True, slots=True)
class FileDifference:
    """One thing that two files do not have alike.

    Parameters
    ----------
    part : Part
        Of what it is a part.
    change : ChangeKind
        Whether only one has it, or both have it otherwise.
    text : str
        In words.
    name_a, name_b : str or None
        The item's number, the zone's or the point's name in each file; None where it has none.
    a, b : tuple of LatLon
        Where it is in each file.
    moved_m : float or None
        How far it was moved; None where it was not, or is only in one.
    """

    part: Part
    change: ChangeKind
    text: str
    name_a: str | None = None
    name_b: str | None = None
    a: tuple[LatLon, ...] = ()
    b: tuple[LatLon, ...] = ()
    moved_m: float | None = None


def differences(a: Situation, b: Situation, parts: Sequence[Part]) -> tuple[FileDifference, ...]:
    """Return what two files do not have alike, in the order of the parts; nothing where they hold the same.

    Parameters
    ----------
    a, b : Situation
        What the files hold.
    parts : sequence of Part
        Which of mission, fence and rally points are compared.
    """
    found: list[FileDifference] = []
    if Part.MISSION in parts:
        found += _of_missions(*(one.mission.value if one.mission else Mission(()) for one in (a, b)))
    if Part.FENCE in parts:
        found += _of_fences(*(one.fence.value if one.fence else Fence() for one in (a, b)))
    if Part.RALLY in parts:
        found += _of_rally(*(one.rally.value if one.rally else () for one in (a, b)))
    return tuple(found)


def summary(situation: Situation, part: Part) -> str:
    """Return in words how much of a part a file holds."""
    if part is Part.MISSION:
        if situation.mission is None:
            return "no mission"
        items = situation.mission.value.items
        length_m = path_length_m([item.position for item in items if item.is_placed])
        return f"{counted(len(items), 'item')}, {length_m:.1f} m between its places"
    if part is Part.FENCE:
        return counted(len(situation.fence.value.zones), "zone") if situation.fence else "no fence"
    return counted(len(situation.rally.value), "rally point") if situation.rally else "no rally points"


def _of_missions(a: Mission, b: Mission) -> list[FileDifference]:
    found = []
    if (a.home is None) != (b.home is None):
        only = "A" if a.home else "B"
        found.append(
            FileDifference(
                Part.MISSION, ChangeKind.ONLY_A if a.home else ChangeKind.ONLY_B, f"home {a.home or b.home}: only in {only}",
                a=(a.home,) if a.home else (), b=(b.home,) if b.home else (),
            )
        )  # fmt: skip
    elif a.home is not None and b.home is not None:
        moved = _moved("home", a.home, b.home)
        if moved is not None:
            text, moved_m = moved
            found.append(
                FileDifference(Part.MISSION, ChangeKind.OTHER, text, "0", "0", (a.home,), (b.home,), moved_m)
            )
    items_a, items_b = (tuple(map(_plain, mission.items)) for mission in (a, b))
    pairs = _aligned(items_a, items_b)
    same_place = {in_a: in_b for in_a, in_b in pairs if in_a is not None and in_b is not None}
    for in_a, in_b in pairs:
        one = items_a[in_a] if in_a is not None else None
        other = items_b[in_b] if in_b is not None else None
        found += _of_items(one, other, in_a, in_b, same_place)
    return found


def _plain(item: MissionItem) -> MissionItem:
    """Return an item as it is compared: as files name its frame, and without what formats cannot write."""
    item = replace(item, frame=file_frame(item.frame), current=False)
    try:
        return without_nan(item)
    except MissionFormatError:
        return item


def _aligned(a: Sequence[MissionItem], b: Sequence[MissionItem]) -> list[tuple[int | None, int | None]]:
    """Return which item of one mission is which of the other; None where there is none."""
    found: list[tuple[int | None, int | None]] = []
    matcher = SequenceMatcher(None, [_key(item) for item in a], [_key(item) for item in b], autojunk=False)
    for _, a_from, a_to, b_from, b_to in matcher.get_opcodes():
        found += zip_longest(range(a_from, a_to), range(b_from, b_to))
    return found


def _key(item: MissionItem) -> tuple[object, ...]:
    """Return what makes an item the same: of a jump not the number of the item that it leads to."""
    params = item.params[1:] if item.command in _JUMPS else item.params
    return (item.command, item.frame, str(params), item.lat_e7, item.lon_e7, item.alt_m, item.autocontinue)


def _of_items(
    a: MissionItem | None,
    b: MissionItem | None,
    in_a: int | None,
    in_b: int | None,
    same_place: dict[int, int],
) -> list[FileDifference]:
    number_a, number_b = (None if index is None else str(index + 1) for index in (in_a, in_b))
    places_a, places_b = _places(a), _places(b)
    if a is None or b is None:
        item, number, only = (a, number_a, "A") if b is None else (b, number_b, "B")
        assert item is not None
        change = ChangeKind.ONLY_A if b is None else ChangeKind.ONLY_B
        at = f" at {item.position}" if _places(item) else ""
        text = f"item {number} ({_name(item)}){at}: only in {only}"
        return [FileDifference(Part.MISSION, change, text, number_a, number_b, places_a, places_b)]
    number = number_a if number_a == number_b else f"{number_a} (in B {number_b})"
    subject = f"item {number} ({_name(a)})"
    if a.command != b.command:
        text = f"item {number}: {_name(a)} in A, {_name(b)} in B"
        return [FileDifference(Part.MISSION, ChangeKind.OTHER, text, number_a, number_b, places_a, places_b)]
    moved_m, texts = None, []
    if places_a and places_b:
        moved = _moved("", places_a[0], places_b[0])
        if moved is not None:
            text, moved_m = moved
            texts.append(text)
    elif (a.lat_e7, a.lon_e7) != (b.lat_e7, b.lon_e7):
        texts.append(f"param5 and param6 {a.lat_e7}, {a.lon_e7} → {b.lat_e7}, {b.lon_e7}")
    texts += _of_params(a, b, same_place)
    if not texts:
        return []
    text = f"{subject}: {'; '.join(texts)}"
    return [
        FileDifference(Part.MISSION, ChangeKind.OTHER, text, number_a, number_b, places_a, places_b, moved_m)
    ]


def _of_params(a: MissionItem, b: MissionItem, same_place: dict[int, int]) -> list[str]:
    texts = []
    for number, (one, other) in enumerate(zip(a.params, b.params, strict=True), start=1):
        if number == 1 and a.command in _JUMPS and same_place.get(round(one) - 1, -1) == round(other) - 1:
            continue
        if not _are_close(one, other):
            name = _PARAMS.get((a.command, number), f"param{number}")
            texts.append(f"{name} {one:g} → {other:g}")
    if not _are_close(a.alt_m, b.alt_m):
        texts.append(f"altitude {a.alt_m:g} → {b.alt_m:g} m")
    if a.frame != b.frame:
        texts.append(f"frame {a.frame} → {b.frame}")
    if a.autocontinue != b.autocontinue:
        texts.append(f"autocontinue {int(a.autocontinue)} → {int(b.autocontinue)}")
    return texts


def _are_close(a: float, b: float) -> bool:
    """Return whether two numbers are the same, as files write them; or neither is set. Whole ones are numbers of something: any other is another."""
    if a.is_integer() and b.is_integer():
        return a == b
    return math.isclose(a, b, rel_tol=_SINGLE, abs_tol=1e-6) or (math.isnan(a) and math.isnan(b))


def _places(item: MissionItem | None) -> tuple[LatLon, ...]:
    if item is None or not has_place(item.command, item.frame) or (item.lat_e7, item.lon_e7) == (0, 0):
        return ()
    return (item.position,)


def _name(item: MissionItem) -> str:
    try:
        return Command(item.command).name.removeprefix("NAV_")
    except ValueError:
        return f"command {item.command}"


def _moved(name: str, a: LatLon, b: LatLon) -> tuple[str, float] | None:
    """Return in words how far a place was moved, and in metres; None where it was not."""
    away_m, bearing_deg = distance_and_bearing(a, b)
    if away_m < _ROUNDED_M:
        return None
    return f"{name} moved {away_m:.2f} m, bearing {bearing_deg:.0f}°, to {b}".strip(), away_m


def _of_fences(a: Fence, b: Fence) -> list[FileDifference]:
    names_a, names_b = a.zone_names(), b.zone_names()
    found = []
    if a.zones or b.zones:
        frame = frame_around([*a.places, *b.places])
        pairs = _paired(a.zones, b.zones, lambda zone: _area(zone, frame))
        rest_a, rest_b = set(range(len(a.zones))), set(range(len(b.zones)))
        for in_a, in_b in pairs:
            rest_a.discard(in_a)
            rest_b.discard(in_b)
            text, moved_m = _of_zones(a.zones[in_a], b.zones[in_b], frame)
            if text:
                name = (
                    names_a[in_a]
                    if names_a[in_a] == names_b[in_b]
                    else f"{names_a[in_a]} (in B {names_b[in_b]})"
                )
                found.append(
                    FileDifference(
                        Part.FENCE, ChangeKind.OTHER, f"{name}: {text}", names_a[in_a], names_b[in_b],
                        a.zones[in_a].places, b.zones[in_b].places, moved_m,
                    )
                )  # fmt: skip
        for index in sorted(rest_a):
            text = f"{names_a[index]}, {_size(a.zones[index], frame)}: only in A"
            found.append(
                FileDifference(Part.FENCE, ChangeKind.ONLY_A, text, names_a[index], a=a.zones[index].places)
            )
        for index in sorted(rest_b):
            text = f"{names_b[index]}, {_size(b.zones[index], frame)}: only in B"
            found.append(
                FileDifference(
                    Part.FENCE, ChangeKind.ONLY_B, text, name_b=names_b[index], b=b.zones[index].places
                )
            )
    return found + _of_return_points(a.return_point, b.return_point)


def _of_return_points(a: LatLon | None, b: LatLon | None) -> list[FileDifference]:
    if a is not None and b is not None:
        moved = _moved("return point", a, b)
        if moved is None:
            return []
        return [FileDifference(Part.FENCE, ChangeKind.OTHER, moved[0], a=(a,), b=(b,), moved_m=moved[1])]
    if a is not None:
        return [FileDifference(Part.FENCE, ChangeKind.ONLY_A, f"return point {a}: only in A", a=(a,))]
    if b is not None:
        return [FileDifference(Part.FENCE, ChangeKind.ONLY_B, f"return point {b}: only in B", b=(b,))]
    return []


def _paired(
    a: Sequence[Zone], b: Sequence[Zone], area: Callable[[Zone], BaseGeometry]
) -> list[tuple[int, int]]:
    """Return which zone of one fence is which of the other: those that share most of their ground first."""
    areas_a, areas_b = list(map(area, a)), list(map(area, b))
    tree = shapely.STRtree(areas_b)
    shares = []
    for in_a, one in enumerate(areas_a):
        for in_b in tree.query(one).tolist():
            if a[in_a].kind is not b[in_b].kind or type(a[in_a]) is not type(b[in_b]):
                continue
            joined_m2 = one.union(areas_b[in_b]).area
            share = (
                one.intersection(areas_b[in_b]).area / joined_m2 if joined_m2 else float(a[in_a] == b[in_b])
            )
            if share >= _SAME_ZONE:
                shares.append((-share, in_a, in_b))
    pairs: dict[int, int] = {}
    for _, in_a, in_b in sorted(shares):
        if in_a not in pairs and in_b not in pairs.values():
            pairs[in_a] = in_b
    return sorted(pairs.items())


def _of_zones(a: Zone, b: Zone, frame: LocalFrame) -> tuple[str, float | None]:
    """Return in words how a zone was changed, and how far its edge was moved; no words where it was not."""
    if isinstance(a, CircleZone) and isinstance(b, CircleZone):
        moved = _moved("centre", a.centre, b.centre)
        texts = [] if moved is None else [moved[0]]
        if abs(a.radius_m - b.radius_m) >= _ROUNDED_M:
            texts.append(f"radius {a.radius_m:.2f} → {b.radius_m:.2f} m")
        return "; ".join(texts), None if moved is None else moved[1]
    area_a, area_b = _area(a, frame), _area(b, frame)
    moved_m = float(shapely.hausdorff_distance(area_a.boundary, area_b.boundary, densify=0.05))
    if moved_m < _ROUNDED_M:
        return "", None
    corners = [len(zone.places) for zone in (a, b)]
    vertices = "" if corners[0] == corners[1] else f"{corners[0]} → {corners[1]} vertices; "
    return (
        f"{vertices}its edge moved by up to {moved_m:.2f} m; area {area_a.area:.1f} → {area_b.area:.1f} m²",
        moved_m,
    )


def _size(zone: Zone, frame: LocalFrame) -> str:
    if isinstance(zone, CircleZone):
        return f"radius {zone.radius_m:g} m around {zone.centre}"
    return f"{_area(zone, frame).area:.1f} m² from {zone.vertices[0]}"


def _area(zone: Zone, frame: LocalFrame) -> BaseGeometry:
    if isinstance(zone, PolygonZone):
        return shapely.make_valid(Polygon(frame.to_local_array(zone.vertices)))
    return Point(frame.to_local_array([zone.centre])[0]).buffer(zone.radius_m, quad_segs=64)


def _of_rally(a: Sequence[RallyPoint], b: Sequence[RallyPoint]) -> list[FileDifference]:
    found = []
    keys_a, keys_b = ([(*point.position, point.alt_m) for point in points] for points in (a, b))
    for _, a_from, a_to, b_from, b_to in SequenceMatcher(None, keys_a, keys_b, autojunk=False).get_opcodes():
        for in_a, in_b in zip_longest(range(a_from, a_to), range(b_from, b_to)):
            found += _of_points(a, b, in_a, in_b)
    return found


def _of_points(
    a: Sequence[RallyPoint], b: Sequence[RallyPoint], in_a: int | None, in_b: int | None
) -> list[FileDifference]:
    name_a, name_b = (None if index is None else f"rally point {index + 1}" for index in (in_a, in_b))
    if in_b is None:
        assert in_a is not None
        place = a[in_a].position
        return [
            FileDifference(
                Part.RALLY, ChangeKind.ONLY_A, f"{name_a} at {place}: only in A", name_a, a=(place,)
            )
        ]
    if in_a is None:
        place = b[in_b].position
        return [
            FileDifference(
                Part.RALLY, ChangeKind.ONLY_B, f"{name_b} at {place}: only in B", name_b=name_b, b=(place,)
            )
        ]
    one, other = a[in_a], b[in_b]
    name = name_a if name_a == name_b else f"{name_a} (in B {name_b})"
    moved = _moved("", one.position, other.position)
    texts = [] if moved is None else [moved[0]]
    if not _are_close(one.alt_m, other.alt_m):
        texts.append(f"altitude {one.alt_m:g} → {other.alt_m:g} m")
    if not texts:
        return []
    text = f"{name}: {'; '.join(texts)}"
    moved_m = None if moved is None else moved[1]
    return [
        FileDifference(
            Part.RALLY, ChangeKind.OTHER, text, name_a, name_b, (one.position,), (other.position,), moved_m
        )
    ]
