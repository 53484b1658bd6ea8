"""Images: everything is inside the frame, nothing covers anything; asked of matplotlib's own renderer."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from shapely import LineString, Point, Polygon

from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.geo import LatLon, LocalPoint
from missions.ground.ground import lay_out
from missions.picture import draw_plan, style
from missions.picture import scene as scenes
from missions.picture.figure import plan_figure
from missions.picture.labels import _spellings
from missions.picture.scene import Scene

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

    from missions.planned import Plan

TOUCH_PX = 0.5


def box_of(bbox: Bbox) -> Polygon:
    return shapely.box(*bbox.extents)


def problems(figure: Figure, scene: Scene) -> list[str]:
    """Return what is out of the frame or covered, in pixels."""
    figure.canvas.draw()
    (axes,) = figure.axes
    to_px = axes.transData.transform
    page, field = box_of(figure.bbox), box_of(axes.bbox).buffer(TOUCH_PX)
    route = LineString(to_px(scene.route))
    places = [to_px(scene.route[0]), *to_px(scene.targets)]
    markers = [Point(place).buffer(8 * figure.dpi / 100) for place in places]
    zones = {
        name: Polygon(to_px(scene.plan.ground.frame.to_local_array(zone.vertices)))
        if isinstance(zone, PolygonZone)
        else Point(to_px(scene.plan.ground.frame.to_local_array([zone.centre]))[0]).buffer(1)
        for name, zone in zip(scene.plan.fence.zone_names(), scene.plan.fence.zones, strict=True)
    }
    texts = {
        text.get_text(): box_of(text.get_window_extent()) for text in axes.texts if text.get_gid() == "zone"
    }
    edges = [box_of(text.get_window_extent()) for text in axes.texts if text.get_gid() in ("scale", "north")]
    edges.append(box_of(axes.title.get_window_extent()))
    (legend,) = (box_of(legend.get_window_extent()) for legend in figure.legends)
    found = [f"{name} out of the frame" for name, shape in zones.items() if not field.covers(shape)]
    found += ["route out of the frame"] * (not field.covers(route))
    found += [f"{name} out of the frame" for name, box in texts.items() if not field.covers(box)]
    found += [f"{name} on the route" for name, box in texts.items() if box.intersects(route)]
    found += [
        f"{name} on a marker"
        for name, box in texts.items()
        if any(box.intersects(marker) for marker in markers)
    ]
    boxes = list(texts.items())
    found += [
        f"{a} on {b}" for i, (a, box) in enumerate(boxes) for b, other in boxes[:i] if box.intersects(other)
    ]
    found += ["legend off the page"] * (not page.covers(legend))
    found += ["legend on the field"] * legend.intersects(field)
    found += ["edge text off the page"] * (not all(page.covers(box) for box in edges))
    found += ["edge text on the field"] * any(box.intersects(box_of(axes.bbox)) for box in edges)
    found += ["edge texts on one another"] * any(
        box.intersects(other) for i, box in enumerate(edges) for other in edges[:i]
    )
    assert len(edges) == 4  # the scale, the N, its arrow, the title
    return found


def test_everything_is_inside_and_nothing_is_covered(scene: Scene) -> None:
    assert problems(plan_figure(scene), scene) == []


def test_the_check_finds_what_is_wrong(plans: dict[str, Plan]) -> None:
    scene = Scene(plans["yard"])
    figure = plan_figure(scene)
    (axes,) = figure.axes
    label, other = [text for text in axes.texts if text.get_gid() == "zone"][:2]
    label.set_position(scene.route[1:3].mean(axis=0))
    assert problems(figure, scene) == [f"{label.get_text()} on the route"]
    label.set_position(scene.targets[0])
    assert f"{label.get_text()} on a marker" in problems(figure, scene)
    label.set_position(other.get_position())
    assert problems(figure, scene) == [f"{other.get_text()} on {label.get_text()}"]
    axes.set_xlim(0, 50)
    assert {"route out of the frame", "inclusion polygon 1 out of the frame"} <= set(problems(figure, scene))


@pytest.mark.parametrize(("east_m", "north_m"), [(15.0, 200.0), (400.0, 20.0)])
def test_long_fields(plans: dict[str, Plan], east_m: float, north_m: float) -> None:
    frame = plans["maze"].ground.frame
    corners = np.array([(-east_m, -north_m), (east_m, -north_m), (east_m, north_m), (-east_m, north_m)])
    fence = Fence(
        (PolygonZone(ZoneKind.INCLUSION, tuple(frame.to_lat_lon(LocalPoint(*corner)) for corner in corners)),)
    )
    path = tuple(frame.to_lat_lon(LocalPoint(*corner)) for corner in 0.9 * corners[[0, 2]])
    ground = lay_out(fence, frame)
    scene = Scene(replace(plans["maze"], fence=fence, ground=ground, path=path, targets=path[1:]))
    assert problems(plan_figure(scene), scene) == []


@pytest.mark.parametrize("name", ["maze", "yard", "union"])
def test_names_stand_in_their_zones(plans: dict[str, Plan], name: str) -> None:
    scene = Scene(plans[name])
    figure = plan_figure(scene)
    (axes,) = figure.axes
    areas = {barrier.name: barrier.area for barrier in scene.plan.ground.barriers}
    labels = {text.get_text().replace("\n", " "): text for text in axes.texts if text.get_gid() == "zone"}
    exclusions = [zone for zone in areas if zone.startswith("exclusion")]
    assert len(labels) == len(exclusions) + (2 if name == "union" else 0)
    for words, text in labels.items():
        corners = axes.transData.inverted().transform(text.get_window_extent().corners())
        box = shapely.MultiPoint(corners).envelope
        (zone,) = (
            zone
            for zone in areas
            if zone.endswith(words)
            or (f"{zone.split()[1][0].upper()}{zone.split()[2]}" == words and zone.startswith("exclusion"))
        )
        assert areas[zone].covers(box)


def test_what_the_legend_tells(plans: dict[str, Plan]) -> None:
    track = plans["yard"].path[:3]
    figure = plan_figure(Scene(plans["yard"], track), blocks=True)
    (legend,) = figure.legends
    assert {text.get_text() for text in legend.get_texts()} == {
        "outside", "nearer to a fence than the route", "exclusion", "inclusion", "block",
        "predicted track", "route", "waypoint", "driven", "start", "target",
    }  # fmt: skip
    assert problems(figure, Scene(plans["yard"], track)) == []
    plain = {text.get_text() for text in plan_figure(Scene(plans["yard"])).legends[0].get_texts()}
    assert not plain & {"block", "driven"}


def test_several_targets_are_numbered(plans: dict[str, Plan]) -> None:
    scene = Scene(plans["yard"])
    (axes,) = plan_figure(scene).axes
    numbers = {text.get_text(): text.xy for text in axes.texts if text.get_text() in {"1", "2"}}
    assert np.allclose([numbers["1"], numbers["2"]], scene.targets)


def test_titles(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    assert Scene(plan).title() == (
        f"{plan.length_m:.1f} m, about {plan.duration_s:.0f} s, clearance {plan.drawn_clearance_m:.2f} m drawn, 2 m promised while driving"
    )
    free = replace(plan, drawn_clearance_m=float("inf"), clearance_m=None)
    assert Scene(free).title() == f"{plan.length_m:.1f} m, about {plan.duration_s:.0f} s"
    assert plan_figure(Scene(plan), title="A yard").axes[0].get_title() == "A yard"


@pytest.mark.parametrize(
    ("suffix", "begins"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF"), (".PNG", b"\x89PNG")]
)
def test_the_same_plan_gives_the_same_file(
    plans: dict[str, Plan], tmp_path: Path, suffix: str, begins: bytes
) -> None:
    files = [tmp_path / f"{name}{suffix}" for name in ("a", "b")]
    for path in files:
        draw_plan(plans["union"], path)
    first, second = (path.read_bytes() for path in files)
    assert first.startswith(begins)
    assert first == second


def test_a_vast_home_circle_does_not_shrink_the_picture(plans: dict[str, Plan]) -> None:
    plan = plans["maze"]
    ground = lay_out(plan.fence, plan.ground.frame, home=plan.start, home_radius_m=5000.0)
    assert len(ground.barriers) == len(plan.ground.barriers) + 1
    scene = Scene(replace(plan, ground=ground))
    assert scene.bounds_m == Scene(plan).bounds_m
    assert problems(plan_figure(scene), scene) == []


def test_a_fence_without_inclusions_and_too_small_for_names(plans: dict[str, Plan]) -> None:
    plan = plans["maze"]
    dot = CircleZone(ZoneKind.EXCLUSION, plan.path[0], 0.5)
    fence = Fence((dot,))
    ground = lay_out(fence, plan.ground.frame)
    scene = Scene(replace(plan, fence=fence, ground=ground, drawn_clearance_m=float("inf")))
    figure = plan_figure(scene)
    assert [text for text in figure.axes[0].texts if text.get_gid() == "zone"] == []
    assert "inclusion" not in {text.get_text() for text in figure.legends[0].get_texts()}
    assert scene.blocks()


def test_blocks_fill_the_free_space(plans: dict[str, Plan]) -> None:
    plan = plans["union"]
    blocks = [Polygon(block) for block in Scene(plan).blocks()]
    joined = shapely.union_all(blocks)
    assert sum(block.area for block in blocks) == pytest.approx(joined.area)
    free = plan.ground.allowed.buffer(-0.99 * plan.drawn_clearance_m, join_style="mitre")
    assert joined.symmetric_difference(free).area < 0.01 * free.area


def test_blocks_that_cannot_be_shown_are_left_out(
    plans: dict[str, Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plans["union"]
    blocked = replace(plan, targets=(plan.fence.zones[2].vertices[0],))
    assert Scene(blocked).blocks() == []
    monkeypatch.setattr(scenes, "_MOST_BLOCKS", 3)
    assert Scene(plan).blocks() == []


def test_a_name_in_ever_fewer_letters() -> None:
    assert list(_spellings("exclusion polygon 3")) == [
        "exclusion polygon 3",
        "exclusion\npolygon 3",
        "polygon 3",
        "P3",
    ]
    assert list(_spellings("home circle (FENCE_RADIUS 300 m)"))[-1] == "circle (FENCE_RADIUS 300 m)"


def lightness(color: str) -> float:
    red, green, blue = (int(color[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2


@pytest.mark.parametrize("ground", [style.OUTSIDE, style.MARGIN, "#FFFFFF"])
@pytest.mark.parametrize("line", [style.ROUTE, style.INCLUSION, style.TRACK, style.EXCLUSION])
def test_lines_stand_out_from_grounds_without_colour(ground: str, line: str) -> None:
    """By WCAG's contrast, 2.4 at least for lines as wide as ours."""
    bright, dark = sorted((lightness(ground), lightness(line)), reverse=True)
    assert (bright + 0.05) / (dark + 0.05) > 2.4


def test_a_zone_far_from_all_others_is_inside_the_frame(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    away = tuple(LatLon(p.lat_deg + 0.002, p.lon_deg) for p in plan.fence.zones[1].vertices)
    fence = Fence((*plan.fence.zones, PolygonZone(ZoneKind.EXCLUSION, away)))
    scene = Scene(replace(plan, fence=fence, ground=lay_out(fence, plan.ground.frame)))
    assert problems(plan_figure(scene), scene) == []
