"""Inclusions that overlap made one polygon: never more ground than was drawn, hardly less."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from charts import IN, OUT, box, place
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from missions.errors import FenceError
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.geo import LatLon
from missions.ground.frame import LocalFrame
from missions.ground.merged_fence import merged_fence

FRAME = LocalFrame(place(0, 0))


def area_of(fence: Fence) -> shapely.Geometry:
    """Give what a fence with circles as they are and one inclusion, or any one of several, allows."""

    def shape(zone):
        if isinstance(zone, CircleZone):
            return shapely.Point(FRAME.to_local(zone.centre)).buffer(zone.radius_m, quad_segs=256)
        return Polygon(FRAME.to_local_array(zone.vertices))

    kinds = {
        kind: shapely.union_all([shape(zone) for zone in fence.zones if zone.kind is kind])
        for kind in ZoneKind
    }
    return kinds[ZoneKind.INCLUSION].difference(kinds[ZoneKind.EXCLUSION])


def check(fence: Fence) -> Fence:
    merged = merged_fence(fence)
    assert sum(zone.kind is ZoneKind.INCLUSION for zone in merged.zones) == 1
    before, after = area_of(fence), area_of(merged)
    assert after.difference(before.buffer(0.002)).area < 1e-6
    assert before.difference(after.buffer(0.4)).area < 0.01  # circles are drawn inside, at the least metre
    return merged


def test_two_fields_and_a_path_between_them() -> None:
    fence = Fence(
        (
            box(IN, -50, -20, -5, 20),
            box(OUT, -30, -5, -20, 5),
            box(IN, -10, -3, 40, 3),
            box(IN, 30, -30, 80, 30),
        )
    )
    merged = check(fence)
    assert [zone.kind for zone in merged.zones] == [IN, OUT]
    assert merged.zones[1] == fence.zones[1]
    assert len(merged.zones[0].vertices) == 12


def test_circles_and_a_return_point_are_kept() -> None:
    home = place(1, 2)
    fence = Fence(
        (CircleZone(IN, place(0, 0), 30.0), CircleZone(OUT, place(5, 5), 3.0), box(IN, 20, -10, 90, 10)), home
    )
    merged = check(fence)
    assert merged.return_point == home
    assert merged.zones[1] == fence.zones[1]


def test_ground_that_they_go_around_becomes_an_exclusion() -> None:
    ring = Fence(
        (box(IN, 0, 0, 60, 10), box(IN, 0, 50, 60, 60), box(IN, 0, 0, 10, 60), box(IN, 50, 0, 60, 60))
    )
    merged = check(ring)
    assert [zone.kind for zone in merged.zones] == [IN, OUT]


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(st.integers(-40, 10), st.integers(-40, 10), st.integers(15, 60), st.integers(15, 60)),
        min_size=2,
        max_size=5,
    )
)
def test_any_rectangles_about_one_place(sides) -> None:
    boxes = [
        box(IN, west, south, max(11, west + wide), max(11, south + high)) for west, south, wide, high in sides
    ]
    check(Fence(tuple(boxes)))


def test_long_edges_bow_and_still_nothing_is_won() -> None:
    def far(*corners: tuple[float, float]) -> PolygonZone:
        return PolygonZone(
            IN, tuple(LatLon(60 + north_deg, 10 + east_deg) for east_deg, north_deg in corners)
        )

    fence = Fence(
        (far((0, 0), (0.2, 0), (0.2, 0.1), (0, 0.1)), far((0.1, 0.05), (0.4, 0.05), (0.4, 0.15), (0.1, 0.15)))
    )
    merged = merged_fence(fence)
    assert sum(zone.kind is IN for zone in merged.zones) == 1


def test_one_inclusion_stays_as_it_is() -> None:
    for zones in ((), (box(OUT, 0, 0, 5, 5),), (box(IN, 0, 0, 5, 5), box(OUT, 1, 1, 2, 2))):
        assert merged_fence(Fence(zones)) == Fence(zones)


def test_inclusions_apart_are_named_with_their_distance() -> None:
    zones = (box(IN, 0, 0, 20, 20), box(IN, 10, 0, 30, 20), box(OUT, 0, 0, 2, 2), box(IN, 33, 0, 50, 20))
    with pytest.raises(
        FenceError,
        match=r"form 2 separate areas, 3\.0\d m apart: inclusion polygon 3 and inclusion polygon 1;",
    ):
        merged_fence(Fence(zones))
    touching = (box(IN, 0, 0, 20, 20), box(IN, 20, 20, 40, 40))  # in one corner
    with pytest.raises(FenceError, match="2 separate areas"):
        merged_fence(Fence(touching))
    with pytest.raises(FenceError, match="no area"):
        merged_fence(Fence((box(IN, 0, 0, 0.01, 5), box(IN, 0, 0, 0.01, 9))))


def test_what_comes_out_is_what_a_wire_carries() -> None:
    merged = merged_fence(Fence((box(IN, 0, 0, 20, 20), box(IN, 10, 5, 33.3333, 11.11111))))
    degrees = np.array(merged.zones[0].vertices) * 1e7
    assert np.allclose(degrees, degrees.round(), atol=1e-6)
