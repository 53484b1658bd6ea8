"""Images of scenes, drawn with matplotlib."""

from __future__ import annotations

import math
import textwrap
from io import BytesIO
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import MarkerStyle
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.patheffects import Normal, Stroke
from matplotlib.transforms import Affine2D, ScaledTranslation, Transform

from missions.picture import style
from missions.picture.labels import place_labels
from missions.picture.scene import arrow_place, polygons
from missions.words import harmless

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.picture.scene import PictureScene

_WIDTH_IN = 8.0  # of a page's text
_NARROWEST, _TALLEST = 0.45, 1.5  # height to width; what is narrower gets room beside it
_DPI = 150  # 1,200 pixels across
_TITLE_COLUMNS = 82  # of its font across the page
_LINE_IN = 0.2  # of the title
UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""A picture of the same plan is the same file."""

_HALO = [Stroke(linewidth=5.0, foreground="white"), Normal()]
_ARROW = Outline([(-0.5, -0.5), (0.0, 0.6), (0.5, -0.5), (0.0, -0.2), (-0.5, -0.5)], closed=True)
_ARROW_PT = 10.0
_LEGEND_PT = 9.0  # of a marker in the legend, at most
_SHORT_PX = 40.0  # a leg that is shorter has no arrow
_MOST_ARROWS = 100  # chosen: more cannot be told apart


def scene_image(scene: PictureScene, suffix: str) -> bytes:
    """Return a scene as an image of the format that a suffix names: the same bytes for the same scene."""
    kind = suffix.lower()[1:]
    image = BytesIO()
    with rc_context({"svg.hashsalt": "pbpp"}):
        scene_figure(scene).savefig(image, format=kind, dpi=_DPI, metadata=UNDATED.get(kind))
    return image.getvalue()


def scene_figure(scene: PictureScene) -> Figure:
    """Draw a scene: a figure with one axes, in local metres."""
    west, south, east, north = scene.bounds_m
    shape = min(_TALLEST, max(_NARROWEST, (north - south) / (east - west)))
    title = [part for line in scene.title for part in textwrap.wrap(harmless(line), _TITLE_COLUMNS)]
    height_in = _WIDTH_IN * shape + 1.1 + _LINE_IN * len(title)
    figure = Figure(figsize=(_WIDTH_IN, height_in), layout="constrained", dpi=_DPI)
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xlim=(west, east), ylim=(south, north), aspect="equal", xlabel="east (m)", ylabel="north (m)")
    axes.set_title("\n".join(title), fontsize=11, pad=34, parse_math=False)
    _draw_ground(axes, scene)
    if scene.blocks:
        outlines = PolyCollection(scene.blocks, facecolor="none", edgecolor=style.BLOCK, linewidth=0.4)
        axes.add_collection(outlines, autolim=False)
        outlines.set(zorder=2.5, label="block")
    _draw_route(axes, scene)
    _draw_tracks(axes, scene)
    _draw_ends(axes, scene)
    _draw_scale(axes, scene)
    legend = figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    for text in legend.get_texts():
        text.set_parse_math(False)
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D):
            handle.set_markersize(min(handle.get_markersize(), _LEGEND_PT))
    place_labels(axes, scene)
    return figure


def _draw_ground(axes: Any, scene: PictureScene) -> None:  # noqa: ANN401 - matplotlib is untyped
    if scene.has_inclusion:
        look = {"facecolor": style.OUTSIDE, "edgecolor": "none", "zorder": 1}
        _fill(axes, scene.outside, label="outside the fence", **look)
    _fill(
        axes,
        scene.kept_off,
        facecolor=style.MARGIN,
        edgecolor=style.MARGIN_EDGE,
        linestyle=(0, (4, 3)),
        linewidth=0.6,
        zorder=2,
        label=f"clearance, {scene.clearance_m:.4g} m",
    )
    _fill(
        axes,
        scene.exclusions,
        facecolor=style.EXCLUSION_FILL,
        edgecolor=style.EXCLUSION,
        hatch="////",
        linewidth=1.2,
        zorder=3,
        label="exclusion",
    )
    if scene.has_inclusion:
        _outline(axes, scene.inner_edges, color=style.INCLUSION, linestyle=":", linewidth=1.2, zorder=4)
        look = {"facecolor": "none", "edgecolor": style.INCLUSION, "linewidth": 2.2, "zorder": 4}
        _fill(axes, scene.ground.keep_in, label="inclusion", **look)


def _draw_route(axes: Any, scene: PictureScene) -> None:  # noqa: ANN401
    _fill(
        axes,
        scene.band.intersection(scene.frame),
        facecolor=style.BAND,
        edgecolor=style.ROUTE,
        linewidth=0.5,
        alpha=0.45,
        zorder=5,
        label="predicted corridor",
    )
    route = scene.route
    if not len(route):
        return
    width = 1.0 if scene.band.is_empty else 1.8  # a mission that was recorded stands behind what was driven
    axes.plot(*route.T, "-", color=style.ROUTE, linewidth=width, zorder=6, label=scene.route_name)
    for count, leg in enumerate(scene.unsafe_legs):
        look = {"color": style.UNSAFE, "linewidth": 2.8, "path_effects": _HALO, "zorder": 6.5}
        axes.plot(*route[leg : leg + 2].T, "-", label=None if count else "unsafe leg", **look)
    px_per_m = _WIDTH_IN * _DPI / (scene.bounds_m[2] - scene.bounds_m[0])
    long = [leg for leg, ends in enumerate(pairwise(route)) if math.dist(*ends) * px_per_m >= _SHORT_PX]
    for leg in long[:: 1 + len(long) // _MOST_ARROWS]:
        color = style.UNSAFE if leg in scene.unsafe_legs else style.ROUTE
        marks = [mark.point for mark in scene.marks]
        at = arrow_place(route[leg], route[leg + 1], marks, _SHORT_PX / 2 / px_per_m)
        _draw_arrow(axes, at, route[leg + 1] - route[leg], color)
    points = np.array([point for _, point, _ in scene.waypoints])
    axes.plot(*points.T, "o", color="white", mec=style.ROUTE, markersize=4.5, zorder=7, label="waypoint")
    if scene.narrowest is not None:
        look = {"color": "black", "linewidth": 1.0, "zorder": 6.8, "markersize": 7, "mew": 1.0}
        axes.plot(*scene.narrowest.ends.T, "-|", label="narrowest place", **look)


def _draw_arrow(axes: Any, at: NDArray[np.float64], way: NDArray[np.float64], color: str) -> None:  # noqa: ANN401
    """Show which way a leg is driven."""
    turned = Affine2D().rotate(math.atan2(way[1], way[0]) - math.pi / 2)
    marker = MarkerStyle(_ARROW.transformed(turned))
    look = {"color": color, "mec": "white", "mew": 0.5, "markersize": _ARROW_PT, "zorder": 6.6}
    axes.plot(*at, marker=marker, linestyle="none", gid="direction", **look)


def _draw_tracks(axes: Any, scene: PictureScene) -> None:  # noqa: ANN401
    looks = style.track_looks(track.name for track in scene.tracks)
    order = list(looks)
    drawn: set[str] = set()
    for track in scene.tracks:
        color, dashes = looks[track.name]
        label = None if track.name in drawn else harmless(track.name)
        # One drive over another: the first is seen on both sides of the next.
        width = 1.4 + 0.6 * min(3, len(order) - 1 - order.index(track.name))
        axes.plot(*track.points.T, dashes, color=color, linewidth=width, zorder=8, label=label)
        drawn.add(track.name)
    if scene.marks:
        points = np.array([mark.point for mark in scene.marks])
        look = {"color": style.UNSAFE, "markersize": 8, "mew": 2.2, "path_effects": _HALO, "zorder": 8.5}
        axes.plot(*points.T, "x", label=scene.marks_name, **look)


def _draw_ends(axes: Any, scene: PictureScene) -> None:  # noqa: ANN401
    """Draw start and targets, each with its sign; a start that lies under a target is the larger one."""
    sign: dict[str, Any] = {"ha": "center", "va": "center_baseline", "fontsize": 7, "weight": "bold"}
    moved = ~np.isnan(scene.asked).any(axis=1)
    for count, (asked, reached) in enumerate(zip(scene.asked[moved], scene.targets[moved], strict=True)):
        axes.plot(*np.array((asked, reached)).T, ":", color="black", linewidth=1.2, zorder=8.8)
        look = {"color": "white", "mec": "black", "markersize": 13, "zorder": 8.9}
        axes.plot(*asked, "o", label=None if count else "target as asked", **look)
        axes.text(*asked, "?", zorder=8.95, gid="asked", **sign)
    if scene.start is not None:
        px_per_m = _WIDTH_IN * _DPI / (scene.bounds_m[2] - scene.bounds_m[0])
        is_under = any(math.dist(target, scene.start) * px_per_m < 15 for target in scene.targets)
        look = {"color": style.ROUTE, "mec": "black", "markersize": 21 if is_under else 12, "zorder": 9}
        axes.plot(*scene.start, "s", label="start", **look)
        if not is_under:
            axes.text(*scene.start, "S", color="white", zorder=9.2, gid="start", **sign)
    for number, target in enumerate(scene.targets):
        look = {"color": style.TARGET, "mec": "black", "markersize": 14, "zorder": 9.4}
        axes.plot(*target, "o", label=None if number else "target", **look)
        axes.text(*target, scene.target_sign(number), zorder=9.5, gid="target", **sign)


def _fill(axes: Any, area: BaseGeometry, *, label: str | None = None, **look: Any) -> None:  # noqa: ANN401
    for part in polygons(area):
        rings = (part.exterior, *part.interiors)
        outlines = (Outline(np.asarray(ring.coords), closed=True) for ring in rings)
        axes.add_patch(PathPatch(Outline.make_compound_path(*outlines), label=label, **look))
        label = None


def _outline(axes: Any, lines: BaseGeometry, **look: Any) -> None:  # noqa: ANN401
    for line in getattr(lines, "geoms", [lines]):
        if line.geom_type == "LineString" and not line.is_empty:
            axes.plot(*np.asarray(line.coords).T, **look)


def _draw_scale(axes: Any, scene: PictureScene) -> None:  # noqa: ANN401
    """Draw a scale bar and a north arrow above the field's upper corners, clear of the route."""

    def above(points: float) -> Transform:
        shift: Transform = axes.transAxes + ScaledTranslation(0, points / 72, axes.figure.dpi_scale_trans)
        return shift

    length_m = scene.scale_m()
    left, right = 0.01, 0.01 + length_m / (scene.bounds_m[2] - scene.bounds_m[0])
    axes.plot([left, right], [1, 1], "k-", linewidth=3, transform=above(10), clip_on=False)
    axes.text(right + 0.01, 1, f"{length_m} m", va="center", fontsize=9, transform=above(10), gid="scale")
    axes.text(0.98, 1, "N", ha="center", fontsize=9, transform=above(3), gid="north")
    axes.annotate(
        "",
        xy=(0.98, 1),
        xytext=(0.98, 1),
        xycoords=above(29),
        textcoords=above(11),
        annotation_clip=False,
        gid="north",
        arrowprops={"arrowstyle": "-|>", "linewidth": 1.5, "color": "black", "shrinkA": 0, "shrinkB": 0},
    )
