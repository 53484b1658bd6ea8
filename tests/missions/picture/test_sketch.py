"""Terminal sketches: plain text that fits, with everything in its place."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from shapely import LineString, Point, box

from missions.fence import Fence, PolygonZone, ZoneKind
from missions.geo import LocalPoint
from missions.ground.ground import lay_out
from missions.picture import sketch_plan
from missions.picture.plans import plan_scene
from missions.picture.sketch import sketch

if TYPE_CHECKING:
    from missions.picture.scene import PictureScene
    from missions.planned import Plan


def cells_of(text: str) -> list[str]:
    """Return the picture's rows without the legend."""
    lines = text.splitlines()
    legend = next(i for i, line in enumerate(lines) if "north up" in line)
    return lines[:legend]


def cell_boxes(scene: PictureScene, rows: list[str]) -> tuple[float, dict[tuple[int, int], box]]:
    """Lay the picture over the field: cells twice as high as wide, from the upper left corner."""
    west, south, east, north = scene.bounds_m
    wide = max(map(len, rows))
    cell_m = max((east - west) / wide, (north - south) / (2 * len(rows)))
    boxes = {
        (row, column): box(
            west + column * cell_m,
            north - (row + 1) * 2 * cell_m,
            west + (column + 1) * cell_m,
            north - row * 2 * cell_m,
        )
        for row, line in enumerate(rows)
        for column in range(len(line))
    }
    return cell_m, boxes


@pytest.mark.parametrize("columns", [40, 80, 120])
def test_it_fits(any_plan: Plan, columns: int) -> None:
    text = sketch_plan(any_plan, columns=columns, track=any_plan.path, unsafe={0: any_plan.path[0]})
    assert max(map(len, text.splitlines())) <= columns
    assert len(text.splitlines()) <= 46
    assert text.endswith("\n")
    assert not text.endswith("\n\n")


def test_every_sign_stands_where_it_belongs(any_plan: Plan, scene: PictureScene) -> None:
    rows = cells_of(sketch_plan(any_plan))
    cell_m, boxes = cell_boxes(scene, rows)
    route = LineString(scene.route)
    slack_m = 0.1 * cell_m
    seen = set()
    for (row, column), cell in boxes.items():
        sign = rows[row][column]
        seen.add(sign)
        if "\u2800" <= sign <= "\u28ff":
            assert cell.buffer(slack_m).intersects(route)
        elif sign == "S":
            assert cell.buffer(slack_m).covers(Point(scene.route[0]))
        elif sign in "T12":
            assert any(cell.buffer(slack_m).covers(Point(target)) for target in scene.targets)
        elif sign == "▓":
            assert cell.intersection(scene.exclusions).area > 0.03 * cell.area
        elif sign == "░":
            assert cell.difference(scene.ground.keep_in).area > 0.03 * cell.area
        else:
            assert sign == " "
            assert cell.intersection(scene.ground.allowed).area > 0.55 * cell.area
    assert {"▓", "░", " ", "S"} <= seen
    dotted = [
        cell
        for (row, column), cell in boxes.items()
        if "\u2800" <= rows[row][column] <= "\u28ff" or rows[row][column] in "ST12"
    ]
    assert all(any(cell.buffer(slack_m).intersects(Point(at)) for cell in dotted) for at in scene.route)


def test_a_terminal_without_blocks_gets_plain_signs(plans: dict[str, Plan]) -> None:
    for encoding in ("ascii", "cp1252", "no-such-encoding"):
        text = sketch_plan(plans["yard"], track=plans["yard"].path[:2], encoding=encoding)
        assert text.isascii()
        assert {"#", ".", "*", "S", "1", "2"} <= set("".join(cells_of(text)))
        assert "# exclusion" in text
    assert not sketch_plan(plans["yard"]).isascii()


def test_a_thin_wall_is_seen(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    frame = plan.ground.frame
    for corners in (
        [(-70, 50), (70, 50), (70, 50.3), (-70, 50.3)],
        [(-10, -60), (-9.7, -60), (-9.7, 60), (-10, 60)],
    ):
        wall = PolygonZone(
            ZoneKind.EXCLUSION, tuple(frame.to_lat_lon(LocalPoint(*corner)) for corner in corners)
        )
        fence = Fence((plan.fence.zones[0], wall))
        scene = plan_scene(replace(plan, fence=fence, ground=lay_out(fence, frame)))
        rows = cells_of(sketch(scene))
        length_m = max(np.ptp(np.array(corners), axis=0))
        cell_m, _ = cell_boxes(scene, rows)
        signs = sum(row.count("▓") for row in rows)
        assert signs >= length_m / (2 * cell_m) - 3


def test_the_scale_bar_is_as_long_as_it_says(scene: PictureScene) -> None:
    text = sketch(scene)
    (legend,) = (line for line in text.splitlines() if "north up" in line)
    bar, length = legend.split("┤")[0] + "┤", int(legend.split("┤")[1].split()[0])
    cell_m, _ = cell_boxes(scene, cells_of(text))
    assert len(bar) * cell_m == pytest.approx(length, abs=1.5 * cell_m)


def test_the_legend_names_what_is_there(plans: dict[str, Plan]) -> None:
    plain = Fence(plans["yard"].fence.zones[:1])
    ground = lay_out(plain, plans["yard"].ground.frame)
    text = sketch_plan(replace(plans["yard"], fence=plain, ground=ground))
    assert "exclusion" not in text
    assert "driven" not in text
    assert "outside" in text
    only_exclusions = Fence(plans["yard"].fence.zones[1:])
    ground = lay_out(only_exclusions, plans["yard"].ground.frame)
    assert "outside" not in sketch_plan(replace(plans["yard"], fence=only_exclusions, ground=ground))


def test_unsafe_legs_and_crossings_are_seen(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    text = sketch_plan(plan, unsafe={1: plan.path[2]})
    rows = cells_of(text)
    assert sum(row.count("▪") for row in rows) > 10
    assert sum(row.count("✗") for row in rows) == 1
    assert "▪ unsafe leg" in text
    assert "✗ crossed or too near" in text
    plain = sketch_plan(plan, unsafe={1: plan.path[2]}, encoding="ascii")
    assert "! unsafe leg" in plain
    assert "X crossed or too near" in plain
    assert "▪" not in sketch_plan(plan)


def test_start_target_and_what_was_asked_are_all_seen(plans: dict[str, Plan]) -> None:
    plan = plans["yard"]
    home = replace(plan, targets=(plan.targets[0], plan.path[0]), asked_targets=(plan.path[2], plan.path[0]))
    text = sketch_plan(home)
    (row,) = (row for row in cells_of(text) if "S" in row)
    assert "S2" in row
    assert sum(row.count("?") for row in cells_of(text)) == 1
    assert "? target as asked" in text
