from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from strategies import fences

from missions.errors import FenceError
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind, fence_from_items, fence_to_items
from missions.geo import LatLon
from missions.items import Command, MissionItem

VERTEX_IN, VERTEX_OUT = Command.FENCE_POLYGON_VERTEX_INCLUSION, Command.FENCE_POLYGON_VERTEX_EXCLUSION
CIRCLE_IN, CIRCLE_OUT = Command.FENCE_CIRCLE_INCLUSION, Command.FENCE_CIRCLE_EXCLUSION


def item(
    command: int, param1: float = 0, lat_e7: int = 400_713_740, lon_e7: int = -1_052_299_300
) -> MissionItem:
    return MissionItem(command, 0, (param1, 0, 0, 0), lat_e7, lon_e7)


def ring(command: int, count: int, first: int = 0) -> list[MissionItem]:
    return [item(command, count, 400_000_000 + (first + i) ** 2, 1000 * (first + i)) for i in range(count)]


@given(fences)
def test_items_round_trip(fence: Fence) -> None:
    items = fence_to_items(fence)
    assert fence_from_items(items) == fence
    assert fence_to_items(fence_from_items(items)) == items
    assert all((one.frame, one.alt_m, one.params[1:]) == (0, 0.0, (0, 0, 0)) for one in items)


def test_neighbours_of_equal_kind_and_count_stay_apart() -> None:
    items = [*ring(VERTEX_OUT, 4), *ring(VERTEX_OUT, 4, 10), *ring(VERTEX_IN, 3), *ring(VERTEX_IN, 3, 20)]
    fence = fence_from_items(items)
    assert [(zone.kind, len(zone.vertices)) for zone in fence.zones if isinstance(zone, PolygonZone)] == [
        (ZoneKind.EXCLUSION, 4), (ZoneKind.EXCLUSION, 4), (ZoneKind.INCLUSION, 3), (ZoneKind.INCLUSION, 3)
    ]  # fmt: skip
    assert fence.zones[1].vertices[0] == LatLon(40.00001, 0.001)
    assert fence.vertex_count == 14


def test_zones_are_counted_and_named_as_people_do() -> None:
    items = [
        *ring(VERTEX_OUT, 3),
        item(CIRCLE_OUT, 5),
        *ring(VERTEX_IN, 3),
        *ring(VERTEX_OUT, 4),
        item(CIRCLE_IN, 9),
    ]
    fence = fence_from_items([*items, item(Command.FENCE_RETURN_POINT)])
    assert fence.zone_names() == (
        "exclusion polygon 1", "exclusion circle 1", "inclusion polygon 1", "exclusion polygon 2", "inclusion circle 1"
    )  # fmt: skip
    assert fence.count(ZoneKind.EXCLUSION, PolygonZone) == 2
    assert fence.count(ZoneKind.INCLUSION, CircleZone) == 1
    assert fence.return_point == LatLon(40.071374, -105.22993)


def test_no_items_are_an_empty_fence() -> None:
    assert fence_from_items([]) == Fence()
    assert fence_to_items(Fence()) == ()


@pytest.mark.parametrize(
    ("items", "number", "problem"),
    [
        (ring(VERTEX_OUT, 2), 0, "exclusion polygon with 2 vertices; at least 3 are needed"),
        ([item(CIRCLE_OUT, 4), item(VERTEX_IN, 0)], 1, "inclusion polygon with 0 vertices"),
        ([item(VERTEX_IN, math.nan)], 0, "inclusion polygon with 0 vertices"),
        ([item(VERTEX_IN, -4)] * 4, 0, "inclusion polygon with -4 vertices"),
        ([item(VERTEX_IN, 3.5)] * 4, 0, r"vertex count 3\.5 is not a whole number"),
        (ring(VERTEX_OUT, 5)[:4], 0, "with 5 vertices, but only 4 are given"),
        ([*ring(VERTEX_OUT, 4)[:3], *ring(VERTEX_OUT, 3)], 0, "with 4 vertices, but only 3 are given"),
        (
            [*ring(VERTEX_OUT, 3), *ring(VERTEX_OUT, 4)[:2], *ring(VERTEX_IN, 4)],
            3,
            "with 4 vertices, but only 2 are given",
        ),
        (
            [*ring(VERTEX_OUT, 3)[:2], replace(item(VERTEX_OUT), params=(math.nan, 0, 0, 0))],
            0,
            "only 2 are given",
        ),
        ([item(CIRCLE_OUT, 0)], 0, "circle radius 0 m; it must be greater than 0"),
        ([*ring(VERTEX_IN, 3), item(CIRCLE_IN, -3)], 3, "circle radius -3 m"),
        ([item(CIRCLE_IN, math.nan)], 0, "circle radius nan m"),
        ([item(CIRCLE_IN, math.inf)], 0, "circle radius inf m"),
        ([item(CIRCLE_OUT, 3, 910_000_000)], 0, "latitude 91° is beyond ±90°"),
        (
            [item(VERTEX_OUT, 3), item(VERTEX_OUT, 3), item(VERTEX_OUT, 3, 0, 1_900_000_000)],
            2,
            "longitude 190°",
        ),
        ([item(Command.FENCE_RETURN_POINT), item(Command.FENCE_RETURN_POINT)], 1, "second return point"),
        ([item(Command.FENCE_RETURN_POINT, 0, -910_000_000)], 0, "latitude -91°"),
        ([*ring(VERTEX_IN, 3), item(Command.NAV_WAYPOINT)], 3, "command 16 is not a fence item"),
        ([item(5005, 30)], 0, "command 5005 is a circle around home"),
    ],
)
def test_unusable_fences_name_the_item(items: list[MissionItem], number: int, problem: str) -> None:
    with pytest.raises(FenceError, match=rf"^fence item {number}: .*{problem}") as caught:
        fence_from_items(items)
    assert caught.value.details["item"] == number
