"""Three recorded starts and targets that cannot be as asked: the messages' numbers, checked in the test's own map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
import shapely
from charts import Chart
from shapely import Point, Polygon

from mavlink_bridge import situation_from_log
from missions.errors import NoRouteError, StartBlockedError
from missions.fence import PolygonZone, ZoneKind
from missions.geo import LatLon
from missions.planning.plan import plan
from missions.request import Request

if TYPE_CHECKING:
    from pathlib import Path

    from missions.situation import Situation


def chart_of(situation: Situation) -> Chart:
    return Chart(situation.fence.value.zones[0].vertices[0])


def point_of(chart: Chart, place: LatLon) -> Point:
    return Point(chart.points([place])[0])


def area_of(chart: Chart, zone: PolygonZone) -> Polygon:
    return shapely.make_valid(Polygon(chart.points(zone.vertices)))


def lines_of(situation: Situation) -> shapely.geometry.base.BaseGeometry:
    chart = chart_of(situation)
    polygons = [zone for zone in situation.fence.value.zones if isinstance(zone, PolygonZone)]
    return shapely.union_all([chart.zone_line(zone) for zone in polygons])


def test_a_start_in_the_margin_is_led_away_never_nearer(logs: Path) -> None:
    situation = situation_from_log(logs / "position-target-yard.tlog")
    chart, lines = chart_of(situation), lines_of(situation)
    result = plan(situation, Request(clearance_m=3.0))
    start_m = point_of(chart, result.start).distance(lines)
    assert start_m == pytest.approx(2.70, abs=0.02)
    (told,) = (warning for warning in result.warnings if "leaving it" in warning)
    assert f"the start is {start_m:.2f} m from a fence" in told
    first = shapely.LineString(chart.points(result.path[:2]))
    assert first.distance(lines) >= start_m - 0.02
    assert shapely.LineString(chart.points(result.path[2:])).distance(lines) >= 3.0
    assert 0 < result.start_clearance_m < 3.0 <= result.clearance_m
    assert result.driven_clearance_m >= result.start_clearance_m


def test_a_start_in_the_barn_tells_the_way_out(logs: Path) -> None:
    situation = situation_from_log(logs / "mission-yard.tlog")
    chart = chart_of(situation)
    barn = next(zone for zone in situation.fence.value.zones if zone.kind is ZoneKind.EXCLUSION)
    with pytest.raises(StartBlockedError, match="exclusion polygon 1") as caught:
        plan(situation, Request(clearance_m=2.0))
    details = caught.value.details
    here = point_of(chart, situation.pose.value.position)
    out_m = here.distance(area_of(chart, barn).exterior)
    assert area_of(chart, barn).contains(here)
    assert details["distance_m"] == pytest.approx(out_m, abs=0.02)
    assert f"the allowed area is {out_m:.2f} m away" in str(caught.value)
    free = point_of(chart, LatLon(*details["nearest_free"]))
    assert here.distance(free) == pytest.approx(out_m, abs=0.02)
    assert free.distance(area_of(chart, barn)) < 0.05
    assert details["bearing_deg"] % 360 == pytest.approx(0.0, abs=1.5)
    escape = plan(situation, Request(clearance_m=2.0, escape=True))
    out = shapely.LineString(chart.points(escape.path[:2]))
    assert out.intersection(area_of(chart, barn)).length == pytest.approx(out_m, abs=0.6)


def test_a_walled_target_names_the_wall(logs: Path) -> None:
    situation = situation_from_log(logs / "island-unreachable.tlog")
    chart = chart_of(situation)
    with pytest.raises(NoRouteError, match="enclosed by") as caught:
        plan(situation, Request(clearance_m=1.0))
    named = set(caught.value.details["fences"])
    zones = dict(zip(situation.fence.value.zone_names(), situation.fence.value.zones, strict=True))
    walls = shapely.union_all([area_of(chart, zones[name]) for name in named])
    target = point_of(chart, situation.target.value)
    start = point_of(chart, situation.pose.value.position)
    assert not walls.contains(target)
    field = shapely.union_all(
        [area_of(chart, zone) for zone in zones.values() if zone.kind is ZoneKind.INCLUSION]
    )
    parts = shapely.get_parts(field.difference(walls))
    holding = [[part.contains(one) for part in parts].index(True) for one in (start, target)]
    assert holding[0] != holding[1]
