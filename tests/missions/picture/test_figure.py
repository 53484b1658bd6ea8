"""Pictures: everything is inside the frame, nothing covers anything; words are measured by matplotlib's own renderer."""

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
from missions.picture.drawing import Outlines, Spot, Words
from missions.picture.figure import drawn_figure
from missions.picture.page import scene_drawing
from missions.picture.plans import plan_scene
from missions.picture.scene import TrackLine

if TYPE_CHECKING:
    from pathlib import Path

    from missions.ground.frame import LocalFrame
    from missions.picture.drawing import DrawnPage
    from missions.picture.scene import PictureScene
    from missions.planned import Plan

TOUCH_PT = 0.25
SIGN_PT = 0.8  # from a sign to the middle of its box, which has room for letters that reach below the line
NAMES = ("zone", "number", "width", "mark")


def positions(frame: LocalFrame, points: np.ndarray) -> list[LatLon]:
    return [frame.to_lat_lon(LocalPoint(*point)) for point in points.tolist()]


def parts_of(drawing: DrawnPage, kind: type, *names: str) -> list:
    parts = (*drawing.inside, *drawing.around)
    return [part for part in parts if isinstance(part, kind) and (not names or part.name in names)]


def word_boxes(drawing: DrawnPage) -> dict[int, Polygon]:
    """Return the room that words take up, by their place among the parts, on the page."""
    figure = drawn_figure(drawing)
    figure.canvas.draw()
    found = {}
    for number, part in enumerate((*drawing.inside, *drawing.around)):
        if isinstance(part, Words):
            (artist,) = (artist for artist in figure.artists if artist.get_zorder() == number)
            west, south, east, north = artist.get_window_extent().extents * 72 / figure.dpi
            found[number] = shapely.box(west, drawing.height_pt - north, east, drawing.height_pt - south)
    return found


def names_with_boxes(drawing: DrawnPage) -> list[tuple[str, str, Polygon]]:
    """Return the names in a picture, each with its kind and what its lines take up together."""
    boxes = word_boxes(drawing)
    found: list[tuple[str, str, Polygon]] = []
    for number, part in enumerate(drawing.inside):
        if isinstance(part, Words) and part.name in NAMES:
            if drawing.inside[number - 1].name == "behind":
                found.append((part.name, part.text, boxes[number]))
            else:
                kind, text, box = found.pop()
                found.append((kind, f"{text}\n{part.text}", box.union(boxes[number]).envelope))
    return found


def texts_of(drawing: DrawnPage, name: str) -> list[str]:
    return [text for kind, text, _ in names_with_boxes(drawing) if kind == name]


def on_page(drawing: DrawnPage, scene: PictureScene, points: np.ndarray) -> np.ndarray:
    left, top, right, bottom = drawing.frame
    west, south, east, north = scene.bounds_m
    x = np.interp(points[:, 0], (west, east), (left, right), left=np.nan, right=np.nan)
    y = np.interp(points[:, 1], (south, north), (bottom, top), left=np.nan, right=np.nan)
    return np.column_stack((x, y))


def problems(drawing: DrawnPage, scene: PictureScene) -> list[str]:
    """Return what is out of the frame or covered."""
    page, frame = shapely.box(0, 0, drawing.width_pt, drawing.height_pt), shapely.box(*drawing.frame)
    field = frame.buffer(TOUCH_PT)
    starts = [] if scene.start is None else [scene.start]
    places = on_page(drawing, scene, np.array([*starts, *scene.targets]).reshape(-1, 2))
    markers = [Point(place).buffer(6) for place in places]
    points = on_page(drawing, scene, scene.route)
    route = LineString(points) if len(points) else LineString()
    zones = shapely.get_coordinates([zone.area for zone in scene.ground.barriers[: scene.zone_count]])
    found = ["zone out of the frame"] * bool(np.isnan(on_page(drawing, scene, zones)).any())
    found += ["route out of the frame"] * bool(np.isnan(points).any())
    names = [(f"{kind} {text}", box) for kind, text, box in names_with_boxes(drawing)]
    found += [f"{name} out of the frame" for name, box in names if not field.covers(box)]
    found += [f"{name} on the route" for name, box in names if box.intersects(route)]
    found += [f"{name} on a marker" for name, box in names if any(map(box.intersects, markers))]
    found += [
        f"{a} on {b}" for i, (a, box) in enumerate(names) for b, other in names[:i] if box.intersects(other)
    ]
    boxes = word_boxes(drawing)
    around = [
        (part.text, boxes[number])
        for number, part in enumerate(drawing.around, start=len(drawing.inside))
        if isinstance(part, Words)
    ]
    for name in ("north-arrow", "scale-bar"):
        lines = [line for part in parts_of(drawing, Outlines, name) for line in part.lines]
        around.append((name, shapely.MultiPoint(np.concatenate(lines)).envelope))
    found += [f"{text} off the page" for text, box in around if not page.covers(box)]
    found += [f"{text} on the field" for text, box in around if box.intersects(frame)]
    found += [
        f"{a} on {b}" for i, (a, box) in enumerate(around) for b, other in around[:i] if box.intersects(other)
    ]
    return found


def legend_of(drawing: DrawnPage) -> set[str]:
    return {words.text for words in parts_of(drawing, Words, "legend")}


def signs_of(drawing: DrawnPage, name: str) -> dict[str, np.ndarray]:
    """Return the middles of signs as they are drawn."""
    boxes = word_boxes(drawing)
    return {
        part.text: np.array(boxes[number].centroid.coords[0])
        for number, part in enumerate(drawing.inside)
        if isinstance(part, Words) and part.name == name
    }


def test_everything_is_inside_and_nothing_is_covered(scene: PictureScene) -> None:
    assert problems(scene_drawing(scene), scene) == []


def test_the_check_finds_what_is_wrong(plans: dict[str, Plan]) -> None:
    scene = plan_scene(plans["yard"])
    drawing = scene_drawing(scene)
    names = [number for number, part in enumerate(drawing.inside) if part.name == "zone"]
    first, other = names[:2], names[2:4]  # a name has two lines

    def moved(*place: float) -> DrawnPage:
        at = dict(zip(first, (place, (place[0], place[1] + 10)), strict=True))
        parts = [
            replace(part, at=at.get(number, getattr(part, "at", None))) if isinstance(part, Words) else part
            for number, part in enumerate(drawing.inside)
        ]
        return replace(drawing, inside=tuple(parts))

    text = "\n".join(drawing.inside[number].text for number in first)
    on_leg, on_target = on_page(drawing, scene, np.array((scene.route[1:3].mean(axis=0), scene.targets[0])))
    assert problems(moved(*on_leg), scene) == [f"zone {text} on the route"]
    assert f"zone {text} on a marker" in problems(moved(*on_target), scene)
    text_of_other = "\n".join(drawing.inside[number].text for number in other)
    assert f"zone {text_of_other} on zone {text}" in problems(moved(*drawing.inside[other[0]].at), scene)
    assert f"zone {text} out of the frame" in problems(moved(0.0, 0.0), scene)
    cut = replace(drawing, frame=(*drawing.frame[:2], 300.0, drawing.frame[3]))
    assert problems(cut, scene)
    around = [
        replace(part, at=(1.0, part.at[1])) if part.name == "title" else part for part in drawing.around
    ]
    assert any("off the page" in one for one in problems(replace(drawing, around=tuple(around)), scene))


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
    assert problems(scene_drawing(scene), scene) == []


@pytest.mark.parametrize("name", ["maze", "yard", "union"])
def test_zones_are_named_in_one_style_inside_or_next_to_them(plans: dict[str, Plan], name: str) -> None:
    scene = plan_scene(plans[name])
    drawing = scene_drawing(scene)
    to_page = lambda points: on_page(drawing, scene, points)  # noqa: E731 - a word for it
    areas = {
        barrier.name: shapely.transform(barrier.area.intersection(scene.frame), to_page)
        for barrier in scene.ground.barriers
    }
    labels = {text.replace("\n", " "): box for kind, text, box in names_with_boxes(drawing) if kind == "zone"}
    exclusions = {zone for zone in areas if zone.startswith("exclusion")}
    assert labels.keys() == exclusions | (
        {"inclusion polygon 1", "inclusion polygon 2"} if name == "union" else set()
    )
    for words, box in labels.items():
        assert not any(box.intersects(areas[zone]) for zone in exclusions - {words})
        assert areas[words].covers(box) or (
            not box.intersects(areas[words]) and box.distance(areas[words].envelope) < 16.0
        )


def test_what_the_legend_tells(plans: dict[str, Plan]) -> None:
    track = plans["yard"].path[:3]
    scene = plan_scene(plans["yard"], track=track, blocks=True)
    drawing = scene_drawing(scene)
    assert legend_of(drawing) == {
        "outside the fence", "clearance, 2 m", "exclusion", "inclusion", "block", "predicted corridor",
        "route", "waypoint", "narrowest place", "driven", "start", "target",
    }  # fmt: skip
    assert problems(drawing, scene) == []
    assert not legend_of(scene_drawing(plan_scene(plans["yard"]))) & {
        "block",
        "driven",
        "unsafe leg",
        "target as asked",
    }


def test_long_names_in_the_legend_take_fewer_columns(scene: PictureScene) -> None:
    name = "a-log-with-a-name-that-says-where-and-when-it-was-recorded-and-by-whom.tlog"
    tracks = [TrackLine(f"{number} {name}", scene.route) for number in range(3)]
    long = replace(scene, tracks=tuple(tracks))
    assert problems(scene_drawing(long), long) == []


def test_start_targets_and_waypoints_carry_signs(plans: dict[str, Plan]) -> None:
    scene = plan_scene(plans["yard"])
    drawing = scene_drawing(scene)
    targets = signs_of(drawing, "target")
    places = on_page(drawing, scene, scene.targets)
    assert np.allclose([targets["T1"], targets["T2"]], places, atol=SIGN_PT)
    route = on_page(drawing, scene, scene.route)
    assert np.allclose(signs_of(drawing, "start")["S"], route[0], atol=SIGN_PT)
    numbers = signs_of(drawing, "number")
    assert set(numbers) == {str(seq) for seq in plans["yard"].seqs[1:]}
    nearest = {sign: int(np.hypot(*(route - place).T).argmin()) for sign, place in numbers.items()}
    assert nearest == {str(seq): point for point, seq in enumerate(plans["yard"].seqs) if point}
    assert signs_of(scene_drawing(plan_scene(plans["maze"])), "target").keys() == {"T"}


def test_arrows_point_the_way(plans: dict[str, Plan]) -> None:
    scene = plan_scene(plans["yard"])
    drawing = scene_drawing(scene)
    arrows = parts_of(drawing, Outlines, "direction")
    route = on_page(drawing, scene, scene.route)
    assert len(arrows) == len(scene.route) - 1  # every leg of the yard is long enough
    for arrow, begin, end in zip(arrows, route[:-1], route[1:], strict=True):
        left, tip, right, notch = arrow.lines[0] - (begin + end) / 2
        way = (end - begin) / np.hypot(*(end - begin))
        assert np.dot(tip, way) == pytest.approx(np.hypot(*tip))
        assert np.dot(notch, way) < 0
        assert np.dot(left, way) == pytest.approx(np.dot(right, way))


def test_a_start_under_the_last_target_is_seen(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    home = replace(plan, targets=(*plan.targets[:1], plan.path[0]), asked_targets=())
    drawing = scene_drawing(plan_scene(home))
    (start,) = parts_of(drawing, Outlines, "start")
    target = parts_of(drawing, Spot, "target")[-1]
    assert np.ptp(start.lines[0][:, 0]) > 1.3 * 2 * target.radius_pt
    assert np.allclose(start.lines[0].mean(axis=0), target.middle)
    assert drawing.inside.index(start) < drawing.inside.index(target)
    assert not signs_of(drawing, "start")


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
    drawing = scene_drawing(plan_scene(plan, title="A yard\nin a valley"))
    assert [words.text for words in parts_of(drawing, Words, "title")] == ["A yard", "in a valley"]
    assert drawing.title == "A yard; in a valley"


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
    drawing = scene_drawing(scene)
    assert {"unsafe leg", "crossed or too near"} <= legend_of(drawing)
    _halo, red = parts_of(drawing, Outlines, "unsafe")
    assert red.look.line == style.UNSAFE
    assert np.allclose(red.lines[0], on_page(drawing, scene, scene.route[:2]))
    near = plan_scene(through, unsafe={1: path[1]})
    assert near.unsafe_legs == (1,)
    assert np.allclose([mark.point for mark in near.marks], [scene.route[1]])
    assert problems(scene_drawing(near), near) == []


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
    drawing = scene_drawing(scene)
    assert len(parts_of(drawing, Outlines, "direction")) <= 100
    assert len(texts_of(drawing, "number")) <= 100
    assert problems(drawing, scene) == []


def test_a_moved_target_is_shown_with_what_was_asked(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    asked = LatLon(plan.targets[1].lat_deg + 1e-4, plan.targets[1].lon_deg)
    scene = plan_scene(replace(plan, asked_targets=(plan.targets[0], asked)))
    assert np.isnan(scene.asked[0]).all()
    drawing = scene_drawing(scene)
    (place,) = on_page(drawing, scene, np.array([plan.ground.frame.to_local(asked)]))
    assert np.allclose(signs_of(drawing, "asked")["?"], place, atol=SIGN_PT)
    assert "target as asked" in legend_of(drawing)


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
        drawing = scene_drawing(scene)
        assert list(signs_of(drawing, "width")) == [f"{scene.narrowest.width_m:.1f} m"]
        assert problems(drawing, scene) == []
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
    drawing = scene_drawing(scene)
    assert problems(drawing, scene) == []
    assert not any("home circle" in text for text in texts_of(drawing, "zone"))
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
    drawing = scene_drawing(scene)
    assert not {"inclusion", "outside the fence"} & legend_of(drawing)
    assert texts_of(drawing, "zone") == ["exclusion\ncircle 1"]
    assert problems(drawing, scene) == []
    assert scene.blocks


def test_an_obstacle_is_named_by_one_word(plans: dict[str, Plan]) -> None:
    plan = plans["maze"]
    dot = CircleZone(ZoneKind.EXCLUSION, plan.path[0], 0.5)
    ground = lay_out(Fence((dot,)), plan.ground.frame)
    (barrier,) = ground.barriers
    known = replace(barrier, name="obstacle reported at 12:03:05 by OBSTACLE_DISTANCE (radius 0.5 m)")
    ground = replace(ground, barriers=(known,))
    keeps = replace(plan.keeps, drawn_m=float("inf"))
    drawing = scene_drawing(plan_scene(replace(plan, fence=Fence((dot,)), ground=ground, keeps=keeps)))
    assert texts_of(drawing, "zone") == ["obstacle"]


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
    assert problems(scene_drawing(scene), scene) == []
