"""What is written is read again as it was, in every format that has both ways."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from formats.making import contents, fence_on_the_wire, known, mission_on_the_wire, missions, situations
from hypothesis import given
from hypothesis import strategies as st
from strategies import fences, wire_lat_lons

from missions.fence import Fence, PolygonZone, ZoneKind
from missions.formats import (
    FORMATS,
    Part,
    fen,
    geojson,
    kml,
    parameters,
    parts_of,
    poly,
    qgc_plan,
    read_situation,
    waypoints,
    write_situation,
)
from missions.geo import LatLon
from missions.situation import Mission, Situation

if TYPE_CHECKING:
    from pathlib import Path


@given(situations())
def test_geojson(situation: Situation) -> None:
    assert contents(geojson.read(geojson.write(situation), "f")) == contents(situation)


@given(situations())
def test_kml(situation: Situation) -> None:
    assert contents(kml.read(kml.write(situation), "f")) == contents(situation)


@given(missions())
def test_plan_with_jumps(mission: Mission) -> None:
    again = qgc_plan.read(qgc_plan.write(Situation(mission=known(mission))), "f")
    assert again.mission is not None
    assert again.mission.value == mission


@given(situations())
def test_waypoints_one_list_a_file(situation: Situation) -> None:
    for part in parts_of(situation):
        one = Situation(**{part: getattr(situation, part)})
        again = waypoints.read(waypoints.write(one), "f")
        assert parts_of(again) == (part,)
        if part is Part.FENCE:
            assert fence_on_the_wire(again.fence.value) == one.fence.value
        elif part is Part.MISSION:
            assert mission_on_the_wire(again.mission.value) == one.mission.value
        else:
            assert again.rally.value == one.rally.value


rings = st.lists(wire_lat_lons, min_size=3, max_size=8).filter(lambda ring: ring[0] != ring[-1])


@given(rings, wire_lat_lons)
def test_fen_and_poly(ring: list[LatLon], return_point: LatLon) -> None:
    fence = Fence((PolygonZone(ZoneKind.INCLUSION, tuple(ring)),), return_point)
    assert fen.read(fen.write(Situation(fence=known(fence))), "f").fence.value == fence
    assert poly.read(poly.write(Situation(fence=known(fence))), "f").fence.value == Fence(fence.zones)


names = st.from_regex(r"[A-Z][A-Z0-9_]{0,15}", fullmatch=True)


@given(st.dictionaries(names, st.floats(-1e9, 1e9, width=32)))
def test_parameters(values: dict[str, float]) -> None:
    again = parameters.read(parameters.write(Situation(parameters=values)), "f").parameters
    assert {name: pytest.approx(value, rel=2**-25) for name, value in values.items()} == again


@given(fences.filter(lambda fence: fence.zones))
@pytest.mark.parametrize("suffix", [".plan", ".waypoints", ".geojson", ".json", ".kml"])
def test_degrees_are_exact_through_any_format(suffix: str, fence: Fence) -> None:
    format_ = FORMATS[suffix]
    again = format_.read(format_.write(Situation(fence=known(fence))), "f").fence.value
    positions = {
        p for zone in fence.zones for p in (zone.vertices if isinstance(zone, PolygonZone) else [zone.centre])
    }
    read = {
        p for zone in again.zones for p in (zone.vertices if isinstance(zone, PolygonZone) else [zone.centre])
    }
    assert read == positions


@pytest.mark.parametrize("field", ["maze", "yard", "yard2", "union", "island"])
@pytest.mark.parametrize("suffix", [".plan", ".waypoints", ".txt", ".geojson", ".json", ".kml", ".KML"])
def test_the_recorded_fields_through_files(fields: Path, tmp_path: Path, field: str, suffix: str) -> None:
    situation = read_situation(fields / f"{field}-fence.waypoints")
    path = tmp_path / f"field{suffix}"
    assert write_situation(situation, path) == (Part.FENCE,)
    again = read_situation(path)
    assert contents(again)[0] == contents(situation)[0]
    assert again.fence.source == str(path)


def test_a_fence_of_circles_keeps_its_order() -> None:
    """Formats that have features keep the zones' order; a plan lists polygons first."""
    fence = read_zones("circle", "polygon", "circle")
    for format_ in (geojson, kml):
        assert format_.read(format_.write(Situation(fence=known(fence))), "f").fence.value == fence
    again = qgc_plan.read(qgc_plan.write(Situation(fence=known(fence))), "f").fence.value
    assert again.zones == (fence.zones[1], fence.zones[0], fence.zones[2])


def read_zones(*shapes: str) -> Fence:
    from formats.making import SQUARE

    from missions.fence import CircleZone

    zones = [
        CircleZone(ZoneKind.EXCLUSION, LatLon(40.0005, -104.9995), 5.0 + number)
        if shape == "circle"
        else PolygonZone(ZoneKind.INCLUSION, SQUARE)
        for number, shape in enumerate(shapes)
    ]
    return Fence(tuple(zones))


def test_parameters_not_a_number_stay_so_where_the_format_can_say_it() -> None:
    items = mission_with(float("nan"))
    for format_ in (geojson, kml, qgc_plan):
        again = format_.read(format_.write(Situation(mission=known(items))), "f").mission.value
        assert str(again.items[0].params[3]) == "nan"


def mission_with(param4: float) -> Mission:
    from missions.items import waypoint

    item = waypoint(LatLon(40.0, -105.0))
    return Mission((replace(item, params=(0.0, 0.0, 0.0, param4)),))
