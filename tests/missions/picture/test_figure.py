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
from missions.picture.figure import scene_figure
from missions.picture.plans import plan_scene

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

    from missions.ground.frame import LocalFrame
    from missions.picture.scene import PictureScene
    from missions.planned import Plan

TOUCH_PX = 0.5
NAMES = ("zone", "number", "width", "mark")


def positions(frame: LocalFrame, points: np.ndarray) -> list[LatLon]:
    return [frame.to_lat_lon(LocalPoint(*point)) for point in points.tolist()]


def box_of(bbox: Bbox) -> Polygon:
    return shapely.box(*bbox.extents)


def texts_of(figure: Figure, *gids: str) -> dict[str, Polygon]:
    (axes,) = figure.axes
    return {
        f"{text.get_gid()} {text.get_text()}": box_of(text.get_window_extent())
        for text in axes.texts
        if text.get_gid() in gids
    }


def problems(figure: Figure, scene: PictureScene) -> list[str]:
    """Return what is out of the frame or covered, in pixels."""
    figure.canvas.draw()
    (axes,) = figure.axes
    to_px = axes.transData.transform
    page, field = box_of(figure.bbox), box_of(axes.bbox).buffer(TOUCH_PX)
    route = LineString(to_px(scene.route)) if len(scene.route) else LineString()
    starts = [] if scene.start is None else [scene.start]
    markers = [Point(to_px(place)).buffer(8 * figure.dpi / 100) for place in (*starts, *scene.targets)]
    zones = {
        zone.name: shapely.transform(zone.area, to_px) for zone in scene.ground.barriers[: scene.zone_count]
    }
    texts = texts_of(figure, *NAMES)
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


def legend_of(figure: Figure) -> set[str]:
    (legend,) = figure.legends
    return {text.get_text() for text in legend.get_texts()}


def signs_of(figure: Figure, gid: str) -> dict[str, tuple[float, float]]:
    return {text.get_text(): text.get_position() for text in figure.axes[0].texts if text.get_gid() == gid}


def lines_of(figure: Figure, label: str) -> list[np.ndarray]:
    lines = figure.axes[0].get_lines()
    color = next(line.get_color() for line in lines if line.get_label() == label)
    return [
        line.get_xydata() for line in lines if line.get_color() == color and line.get_linestyle() != "None"
    ]


def test_everything_is_inside_and_nothing_is_covered(scene: PictureScene) -> None:
    assert problems(scene_figure(scene), scene) == []


def test_the_check_finds_what_is_wrong(plans: dict[str, Plan]) -> None:
    scene = plan_scene(plans["yard"])
    figure = scene_figure(scene)
    (axes,) = figure.axes
    label, other = [text for text in axes.texts if text.get_gid() == "zone"][:2]
    label.set_position(scene.route[1:3].mean(axis=0))
    assert problems(figure, scene) == [f"zone {label.get_text()} on the route"]
    label.set_position(scene.targets[0])
    assert f"zone {label.get_text()} on a marker" in problems(figure, scene)
    label.set_position(other.get_position())
    assert problems(figure, scene) == [f"zone {other.get_text()} on zone {label.get_text()}"]
    axes.set_xlim(0, 50)
    assert {"route out of the frame", "inclusion polygon 1 out of the frame"} <= set(problems(figure, scene))


@pytest.mark.parametrize(("east_m", "north_m"), [(15.0, 200.0), (400.0, 20.0)])
def test_long_fields(plans: dict[str, Plan], east_m: float, north_m: float) -> None:
    plan = plans["maze"]
    frame = plan.ground.frame
    corners = np.array([(-east_m, -north_m), (east_m, -north_m), (east_m, north_m), (-east_m, north_m)])
    fence = Fence((PolygonZone(ZoneKind.INCLUSION, tuple(positions(frame, corners))),))
    path = tuple(positions(frame, 0.9 * corners[[0, 2]]))
    long = replace(
        plan,
        fence=fence,
        ground=lay_out(fence, frame),
        path=path,
        targets=path[1:],
        asked_targets=path[1:],
        seqs=(0, 1),
        envelope=replace(plan.envelope, arrivals_s=plan.envelope.arrivals_s[:2]),
    )
    scene = plan_scene(long)
    assert problems(scene_figure(scene), scene) == []


@pytest.mark.parametrize("name", ["maze", "yard", "union"])
def test_zones_are_named_in_one_style_inside_or_next_to_them(plans: dict[str, Plan], name: str) -> None:
    scene = plan_scene(plans[name])
    figure = scene_figure(scene)
    (axes,) = figure.axes
    areas = {barrier.name: barrier.area for barrier in scene.ground.barriers}
    labels = {text.get_text().replace("\n", " "): text for text in axes.texts if text.get_gid() == "zone"}
    exclusions = {zone for zone in areas if zone.startswith("exclusion")}
    assert labels.keys() == exclusions | (
        {"inclusion polygon 1", "inclusion polygon 2"} if name == "union" else set()
    )
    for words, text in labels.items():
        corners = axes.transData.inverted().transform(text.get_window_extent().corners())
        box = shapely.MultiPoint(corners).envelope
        others = [area for zone, area in areas.items() if zone in exclusions - {words}]
        assert not any(box.intersects(area) for area in others)
        assert areas[words].covers(box) or (
            not box.intersects(areas[words]) and box.distance(areas[words].envelope) < 7.0
        )


def test_what_the_legend_tells(plans: dict[str, Plan]) -> None:
    track = plans["yard"].path[:3]
    scene = plan_scene(plans["yard"], track=track, blocks=True)
    figure = scene_figure(scene)
    assert legend_of(figure) == {
        "outside the fence", "clearance, 2 m", "exclusion", "inclusion", "block", "predicted corridor",
        "route", "waypoint", "narrowest place", "driven", "start", "target",
    }  # fmt: skip
    assert problems(figure, scene) == []
    assert not legend_of(scene_figure(plan_scene(plans["yard"]))) & {
        "block",
        "driven",
        "unsafe leg",
        "target as asked",
    }


def test_start_targets_and_waypoints_carry_signs(plans: dict[str, Plan]) -> None:
    scene = plan_scene(plans["yard"])
    figure = scene_figure(scene)
    assert np.allclose([signs_of(figure, "target")[sign] for sign in ("T1", "T2")], scene.targets)
    assert np.allclose(signs_of(figure, "start")["S"], scene.route[0])
    numbers = signs_of(figure, "number")
    assert set(numbers) == {str(seq) for seq in plans["yard"].seqs[1:]}
    nearest = {sign: int(np.hypot(*(scene.route - place).T).argmin()) for sign, place in numbers.items()}
    assert nearest == {str(seq): point for point, seq in enumerate(plans["yard"].seqs) if point}
    assert signs_of(scene_figure(plan_scene(plans["maze"])), "target").keys() == {"T"}


def test_arrows_point_the_way(plans: dict[str, Plan]) -> None:
    scene = plan_scene(plans["yard"])
    arrows = [line for line in scene_figure(scene).axes[0].get_lines() if line.get_gid() == "direction"]
    assert len(arrows) == len(scene.route) - 1  # every leg of the yard is long enough
    for arrow, leg in zip(arrows, scene.legs, strict=True):
        assert np.allclose(arrow.get_xydata()[0], leg.interpolate(0.5, normalized=True).coords[0])
        tip = arrow.get_marker().vertices[1]
        begin, end = np.asarray(leg.coords)
        assert np.dot(tip, end - begin) == pytest.approx(np.hypot(*tip) * leg.length)


def test_a_start_under_the_last_target_is_seen(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    home = replace(plan, targets=(*plan.targets[:1], plan.path[0]), asked_targets=())
    markers = {
        line.get_label(): line
        for line in scene_figure(plan_scene(home)).axes[0].get_lines()
        if line.get_markersize() > 8
    }
    assert markers["start"].get_markersize() > 1.3 * markers["target"].get_markersize()
    assert markers["start"].get_zorder() < markers["target"].get_zorder()


def test_titles(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    length = f"{plan.length_m:.1f} m, about {plan.duration_s:.0f} s"
    assert plan_scene(plan).title == (
        length,
        f"fence clearance: at least 2 m while driving ({plan.drawn_clearance_m:.2f} m along straight legs)",
    )
    drawn = replace(plan, keeps=replace(plan.keeps, promised_m=None))
    assert plan_scene(drawn).title[1].endswith("none promised while driving")
    extrapolated = replace(drawn, extrapolated=("OA_TYPE 2: not measured",))
    assert plan_scene(extrapolated).title == (f"{length}, extrapolated", plan_scene(drawn).title[1])
    free = replace(plan, keeps=replace(plan.keeps, drawn_m=float("inf"), promised_m=None))
    assert plan_scene(free).title == (f"{length}, no fence near",)
    assert (
        scene_figure(plan_scene(plan, title="A yard\nin a valley")).axes[0].get_title()
        == "A yard\nin a valley"
    )


def test_the_clearance_is_what_the_route_promises(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    plan = replace(plan, keeps=replace(plan.keeps, drawn_m=30.0))
    kept_off = plan_scene(plan).kept_off
    on_its_edge = shapely.get_coordinates(kept_off)
    distances_m = shapely.distance(shapely.points(on_its_edge), plan.ground.edge)
    assert distances_m.max() == pytest.approx(2.0, abs=0.01)
    assert (
        plan_scene(replace(plan, keeps=replace(plan.keeps, promised_m=None))).kept_off.area
        > 5 * kept_off.area
    )


def test_unsafe_legs_and_where_they_cross_the_fence(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    frame, zone = plan.ground.frame, plan.ground.barriers[1].area  # a rectangle
    west, south, east, north = zone.bounds
    middle_m = (south + north) / 2
    ends = positions(frame, np.array([(west - 10, middle_m), (east + 3, middle_m), (east + 3, north + 12)]))
    path = tuple(ends)
    through = replace(
        plan,
        path=path,
        seqs=(0, 1, 2),
        targets=path[2:],
        asked_targets=path[2:],
        envelope=replace(plan.envelope, arrivals_s=plan.envelope.arrivals_s[:3]),
    )
    scene = plan_scene(through)
    assert scene.unsafe_legs == (0,)
    assert np.allclose([mark.point for mark in scene.marks], [(west, middle_m), (east, middle_m)], atol=0.01)
    assert scene.narrowest is None
    figure = scene_figure(scene)
    assert {"unsafe leg", "crossed or too near"} <= legend_of(figure)
    assert np.allclose(lines_of(figure, "unsafe leg")[0], scene.route[:2])
    near = plan_scene(through, unsafe={1: path[1]})
    assert near.unsafe_legs == (1,)
    assert np.allclose([mark.point for mark in near.marks], [scene.route[1]])
    assert problems(scene_figure(near), near) == []


def test_what_is_too_much_to_read_is_left_out(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    ring = np.linspace(0, 40 * np.pi, 401)
    points = np.column_stack((np.cos(ring), np.sin(ring))) * np.linspace(20, 60, 401)[:, None]
    path = tuple(positions(plan.ground.frame, points))
    long = replace(
        plan,
        path=path,
        seqs=tuple(range(401)),
        targets=path[-1:],
        asked_targets=(),
        envelope=replace(plan.envelope, arrivals_s=np.arange(401.0)),
    )
    scene = plan_scene(long)
    assert len(scene.unsafe_legs) > 3
    assert scene.title[1] == f"{len(scene.unsafe_legs)} legs are unsafe: they cross the fence"
    figure = scene_figure(scene)
    assert sum(line.get_gid() == "direction" for line in figure.axes[0].get_lines()) <= 100
    assert len(texts_of(figure, "number")) <= 100
    assert problems(figure, scene) == []


def test_a_moved_target_is_shown_with_what_was_asked(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    asked = LatLon(plan.targets[1].lat_deg + 1e-4, plan.targets[1].lon_deg)
    scene = plan_scene(replace(plan, asked_targets=(plan.targets[0], asked)))
    assert np.isnan(scene.asked[0]).all()
    figure = scene_figure(scene)
    assert np.allclose(signs_of(figure, "asked")["?"], plan.ground.frame.to_local(asked))
    assert "target as asked" in legend_of(figure)


def test_the_narrowest_place_is_where_the_fences_face_each_other(plans: dict[str, Plan]) -> None:
    """Two blocks 5 m apart between start and goal, the way through them straight or along one of them."""
    plan = plans["yard"]
    frame = plan.ground.frame

    def block(west: float, south: float, east: float, north: float, kind: ZoneKind) -> PolygonZone:
        ring = np.array([(west, south), (east, south), (east, north), (west, north)], dtype=float)
        return PolygonZone(kind, tuple(positions(frame, ring)))

    fence = Fence(
        (
            block(-50, -50, 50, 50, ZoneKind.INCLUSION),
            block(-10, -40, 10, -2, ZoneKind.EXCLUSION),
            block(-10, 3, 10, 40, ZoneKind.EXCLUSION),
        )
    )
    for north_m in (0.5, -1.0, 2.0):
        path = tuple(positions(frame, np.array([(-30.0, north_m), (30.0, north_m)])))
        through = replace(
            plan,
            fence=fence,
            ground=lay_out(fence, frame),
            path=path,
            seqs=(0, 1),
            targets=path[1:],
            asked_targets=path[1:],
            envelope=replace(plan.envelope, arrivals_s=plan.envelope.arrivals_s[:2]),
        )
        scene = plan_scene(through)
        assert scene.narrowest is not None
        assert scene.narrowest.width_m == pytest.approx(5.0, abs=0.02)
        assert sorted(scene.narrowest.ends[:, 1]) == pytest.approx([-2.0, 3.0], abs=0.02)
        assert abs(scene.narrowest.ends[:, 0]).max() <= 10.01
        figure = scene_figure(scene)
        assert list(signs_of(figure, "width")) == [f"{scene.narrowest.width_m:.1f} m"]
        assert problems(figure, scene) == []
    alone = replace(through, fence=Fence(fence.zones[1:2]), ground=lay_out(Fence(fence.zones[1:2]), frame))
    assert plan_scene(alone).narrowest is None


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


def test_a_vast_home_circle_neither_shrinks_the_picture_nor_is_named_in_it(plans: dict[str, Plan]) -> None:
    plan = plans["maze"]
    ground = lay_out(plan.fence, plan.ground.frame, home=plan.start, home_radius_m=5000.0)
    assert len(ground.barriers) == len(plan.ground.barriers) + 1
    scene = plan_scene(replace(plan, ground=ground))
    assert scene.bounds_m == plan_scene(plan).bounds_m
    figure = scene_figure(scene)
    assert problems(figure, scene) == []
    assert not any("home circle" in text for text in texts_of(figure, "zone"))
    near = plan_scene(
        replace(plan, ground=lay_out(plan.fence, plan.ground.frame, home=plan.start, home_radius_m=120.0))
    )
    assert [zone.name for zone, _ in near.named_zones if "home circle" in zone.name]


def test_a_fence_without_inclusions_and_too_small_for_names(plans: dict[str, Plan]) -> None:
    plan = plans["maze"]
    dot = CircleZone(ZoneKind.EXCLUSION, plan.path[0], 0.5)
    fence = Fence((dot,))
    ground = lay_out(fence, plan.ground.frame)
    keeps = replace(plan.keeps, drawn_m=float("inf"))
    scene = plan_scene(replace(plan, fence=fence, ground=ground, keeps=keeps), blocks=True)
    figure = scene_figure(scene)
    assert not {"inclusion", "outside the fence"} & legend_of(figure)
    assert list(texts_of(figure, "zone")) == ["zone exclusion\ncircle 1"]
    assert problems(figure, scene) == []
    assert scene.blocks


def test_an_obstacle_is_named_by_one_word(plans: dict[str, Plan]) -> None:
    plan = plans["maze"]
    dot = CircleZone(ZoneKind.EXCLUSION, plan.path[0], 0.5)
    ground = lay_out(Fence((dot,)), plan.ground.frame)
    (barrier,) = ground.barriers
    known = replace(barrier, name="obstacle reported at 12:03:05 by OBSTACLE_DISTANCE (radius 0.5 m)")
    ground = replace(ground, barriers=(known,))
    keeps = replace(plan.keeps, drawn_m=float("inf"))
    figure = scene_figure(plan_scene(replace(plan, fence=Fence((dot,)), ground=ground, keeps=keeps)))
    assert list(texts_of(figure, "zone")) == ["zone obstacle"]


def test_blocks_fill_the_free_space(plans: dict[str, Plan]) -> None:
    plan = plans["union"]
    blocks = [Polygon(block) for block in plan_scene(plan, blocks=True).blocks]
    joined = shapely.union_all(blocks)
    assert sum(block.area for block in blocks) == pytest.approx(joined.area)
    free = plan.ground.allowed.buffer(-0.99 * plan.drawn_clearance_m, join_style="mitre")
    assert joined.symmetric_difference(free).area < 0.01 * free.area


def test_blocks_that_cannot_be_shown_are_left_out(
    plans: dict[str, Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plans["union"]
    blocked = replace(plan, targets=(plan.fence.zones[2].vertices[0],), asked_targets=())
    assert plan_scene(blocked, blocks=True).blocks == ()
    monkeypatch.setattr("missions.picture.plans._MOST_BLOCKS", 3)
    assert plan_scene(plan, blocks=True).blocks == ()


def lightness(color: str) -> float:
    red, green, blue = (int(color[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2


@pytest.mark.parametrize("ground", [style.OUTSIDE, style.MARGIN, "#FFFFFF"])
@pytest.mark.parametrize("line", [style.ROUTE, style.INCLUSION, style.EXCLUSION, style.UNSAFE, *style.TRACKS])
def test_lines_stand_out_from_grounds_without_colour(ground: str, line: str) -> None:
    """By WCAG's contrast, 2.4 at least for lines as wide as ours."""
    bright, dark = sorted((lightness(ground), lightness(line)), reverse=True)
    assert (bright + 0.05) / (dark + 0.05) > 2.4


def test_driven_lines_are_told_apart() -> None:
    looks = style.track_looks(f"drive {number}" for number in range(style.MOST_LOOKS))
    assert len(set(looks.values())) == style.MOST_LOOKS == 24
    assert style.track_looks(["driven", "driven"]) == {"driven": ("#000000", "--")}
    assert style.track_looks(["HOLD", "AUTO", "HOLD"])["AUTO"] == (style.TRACKS[1], "-")


def test_a_zone_far_from_all_others_is_inside_the_frame(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    away = tuple(LatLon(p.lat_deg + 0.002, p.lon_deg) for p in plan.fence.zones[1].vertices)
    fence = Fence((*plan.fence.zones, PolygonZone(ZoneKind.EXCLUSION, away)))
    scene = plan_scene(replace(plan, fence=fence, ground=lay_out(fence, plan.ground.frame)))
    assert problems(scene_figure(scene), scene) == []
