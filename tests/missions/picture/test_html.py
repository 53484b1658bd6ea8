"""Interactive pages: one file, no network, and what hovering tells."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest
from shapely import LineString, Point

from missions.fence import Fence
from missions.geo import distance_m
from missions.ground.ground import lay_out
from missions.picture import draw_plan, style
from missions.picture.html import scene_html_figure
from missions.picture.plans import plan_scene

if TYPE_CHECKING:
    from pathlib import Path

    from missions.planned import Plan


def test_a_page_needs_no_network(plans: dict[str, Plan], tmp_path: Path) -> None:
    path = tmp_path / "plan.html"
    draw_plan(plans["yard"], path)
    page = path.read_text(encoding="utf-8")
    assert (
        re.findall(
            r"<(?:script|link|img|iframe)[^>]*(?:src|href)=",
            page.partition("<body>")[2].replace(_library(page), ""),
        )
        == []
    )
    assert 'src="http' not in page[:2000]
    assert len(page) > 1_000_000  # the library stands in it
    assert '"showSendToCloud": false' in page
    assert re.search(r'"modeBarButtonsToRemove": \["sendChartToCloud"', page)
    assert page.count('id="plan"') == 1


def _library(page: str) -> str:
    """Return the text of the longest script, plotly itself."""
    return max(re.findall(r"<script[^>]*>(.*?)</script>", page, flags=re.DOTALL), key=len)


def test_the_same_plan_gives_the_same_page(plans: dict[str, Plan], tmp_path: Path) -> None:
    for name in ("a.html", "b.HTML"):
        draw_plan(
            plans["union"], str(tmp_path / name), title="A field", blocks=True, track=plans["union"].path
        )
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.HTML").read_bytes()


def test_hovering_over_a_leg_tells_its_length_clearance_and_time(any_plan: Plan) -> None:
    plan = any_plan
    (legs,) = (trace for trace in scene_html_figure(plan_scene(plan)).data if trace.name == "leg")
    texts = list(dict.fromkeys(legs.text))
    assert len(texts) == len(plan.path) - 1
    points = np.column_stack((legs.x, legs.y)).reshape(len(texts), -1, 2)
    local = plan.ground.frame.to_local_array(plan.path)
    for number, (text, (a, b)) in enumerate(zip(texts, pairwise(plan.path), strict=True), start=1):
        said = re.fullmatch(
            r"leg (\d+): ([\d.]+) m<br>([\d.]+) m from any fence<br>from (\d+) s to (\d+) s", text
        )
        assert said is not None
        assert int(said[1]) == number
        assert float(said[2]) == pytest.approx(distance_m(a, b), abs=0.06)
        line = LineString(local[number - 1 : number + 1])
        nearest_m = min(
            line.distance(barrier.area if barrier.kind == "exclusion" else plan.ground.keep_in.boundary)
            for barrier in plan.ground.barriers
        )
        assert float(said[3]) == pytest.approx(nearest_m, abs=0.006)
        assert [float(said[4]), float(said[5])] == pytest.approx(
            plan.envelope.arrivals_s[number - 1 : number + 1], abs=0.5
        )
        assert line.buffer(0.01).covers(LineString(points[number - 1]))


def test_what_is_drawn_where(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    scene = plan_scene(plan, track=plan.path[:3], blocks=True)
    figure = scene_html_figure(scene)
    named: dict[str, list] = {}
    for trace in figure.data:
        named.setdefault(trace.name, []).append(trace)
    assert np.allclose(np.column_stack((named["route"][0].x, named["route"][0].y)), scene.route, atol=0.001)
    assert [trace.text for trace in named["exclusion"]] == [
        "exclusion polygon 1",
        "exclusion polygon 2",
        "exclusion circle 1",
    ]
    assert [trace.showlegend for trace in named["exclusion"]] == [True, False, False]
    assert named["target"][0].text == ("<b>T1</b>", "<b>T2</b>")
    assert named["target"][0].hovertext[1] == f"target 2<br>{plan.targets[1]}"
    assert len(named["waypoint"][0].x) == len(scene.route) - 1
    assert named["waypoint"][0].hovertext[0].startswith(f"waypoint 1<br>{plan.path[1]}<br>after ")
    assert {"block", "driven", "predicted corridor", "start", "outside the fence", "inclusion"} <= set(named)
    single = scene_html_figure(plan_scene(plans["maze"]))
    assert [trace.text for trace in single.data if trace.name == "target"] == [("<b>T</b>",)]
    assert not {"block", "driven"} & {trace.name for trace in single.data}


def test_without_a_fence_near(plans: dict[str, Plan]) -> None:
    plan = plans["maze"]
    empty = replace(
        plan,
        fence=Fence(),
        ground=lay_out(Fence(), plan.ground.frame, around=plan.path),
        keeps=replace(plan.keeps, drawn_m=float("inf")),
    )
    (legs,) = (trace for trace in scene_html_figure(plan_scene(empty)).data if trace.name == "leg")
    assert all("no fence near" in text for text in legs.text)


def test_zones_are_named_and_the_scale_is_true(plans: dict[str, Plan]) -> None:
    scene = plan_scene(plans["yard"])
    figure = scene_html_figure(scene)
    (names,) = (trace for trace in figure.data if trace.name == "name")
    assert names.text == ("exclusion<br>polygon 1", "exclusion<br>polygon 2", "exclusion<br>circle 1")
    zones = [zone for zone in scene.ground.barriers if zone.kind == "exclusion"]
    for x, y, zone in zip(names.x, names.y, zones, strict=True):
        assert zone.area.buffer(0.01).covers(Point(x, y))
    (scale,) = (trace for trace in figure.data if trace.name == "scale")
    assert scale.text[1] == f" {scale.x[1] - scale.x[0]:.0f} m"
    west, south, east, north = scene.bounds_m
    assert west < min(scale.x) < max(scale.x) < east
    assert south < scale.y[0] < north
    assert any("N" in one.text for one in figure.layout.annotations)


def test_the_page_has_a_title_fits_a_phone_and_keeps_its_scale(
    plans: dict[str, Plan], tmp_path: Path
) -> None:
    path = tmp_path / "plan.html"
    draw_plan(plans["yard"], path, title="<b>Yard</b> & barn\n1 of 2")
    page = path.read_text(encoding="utf-8")
    head, _, body = page.partition("<body>")
    assert "<title>&lt;b&gt;Yard&lt;/b&gt; &amp; barn – PBPP Rover</title>" in head
    assert '<meta name="viewport" content="width=device-width, initial-scale=1">' in head
    assert "<h1>&lt;b&gt;Yard&lt;/b&gt; &amp; barn<br>1 of 2</h1>" in body
    scales = [
        number
        for number, trace in enumerate(scene_html_figure(plan_scene(plans["yard"])).data)
        if trace.name == "scale"
    ]
    assert re.search(rf"bar = {scales[0]};\s+plot.on\(.plotly_relayout.", page)


def test_unsafe_legs_are_red_and_marked(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    scene = plan_scene(plan, unsafe={1: plan.path[2]})
    named = {trace.name: trace for trace in scene_html_figure(scene).data}
    assert named["unsafe leg"].line.color == named["crossed or too near"].marker.color == style.UNSAFE
    assert np.allclose(
        np.column_stack((named["unsafe leg"].x, named["unsafe leg"].y))[:2].astype(float),
        scene.route[1:3],
        atol=1e-3,
    )
    assert named["direction"].marker.color[1] == style.UNSAFE
    assert any(text.endswith("<br>unsafe") for text in named["leg"].text)
    headings = [np.degrees(np.arctan2(*(b - a))) for a, b in pairwise(scene.route)]
    assert np.allclose(named["direction"].marker.angle, headings, atol=0.06)


def test_a_moved_target_and_a_narrow_place_are_shown(plans: dict[str, Plan]) -> None:
    plan = plans["maze"]
    asked = plan.path[0]
    named = {
        trace.name: trace
        for trace in scene_html_figure(plan_scene(replace(plan, asked_targets=(asked,)))).data
    }
    assert np.allclose(
        [named["target as asked"].x[0], named["target as asked"].y[0]],
        plan.ground.frame.to_local(asked),
        atol=1e-3,
    )
    width = named["narrowest place"]
    assert width.text[1] == f" {np.hypot(width.x[1] - width.x[0], width.y[1] - width.y[0]):.1f} m"
