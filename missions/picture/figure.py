"""Images of plans, drawn with matplotlib."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.transforms import ScaledTranslation, Transform

from missions.harmless import harmless
from missions.picture import style
from missions.picture.labels import place_labels
from missions.picture.scene import polygons

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from missions.picture.scene import Scene

_WIDTH_IN = 8.0  # of a page's text
_NARROWEST, _TALLEST = 0.45, 1.5  # height to width; what is narrower gets room beside it
_DPI = 150  # 1,200 pixels across
_UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""A picture of the same plan is the same file."""


def figure_image(scene: Scene, suffix: str, *, title: str | None = None, blocks: bool = False) -> bytes:
    """Return a scene as an image of the format that a suffix names."""
    return image_of(plan_figure(scene, title=title, blocks=blocks), suffix)


def image_of(figure: Figure, suffix: str) -> bytes:
    """Return a figure as an image: the same bytes for the same picture."""
    kind = suffix.lower()[1:]
    image = BytesIO()
    with rc_context({"svg.hashsalt": "pbpp"}):
        figure.savefig(image, format=kind, dpi=_DPI, metadata=_UNDATED.get(kind))
    return image.getvalue()


def plan_figure(scene: Scene, *, title: str | None = None, blocks: bool = False) -> Figure:
    """Draw a scene.

    Parameters
    ----------
    scene : Scene
        What is shown.
    title : str, optional
        Default: length, time and clearance.
    blocks : bool
        Whether to draw the blocks of the free space's partition too.

    Returns
    -------
    matplotlib.figure.Figure
        With one axes, in local metres.
    """
    west, south, east, north = scene.bounds_m
    shape = min(_TALLEST, max(_NARROWEST, (north - south) / (east - west)))
    figure = Figure(figsize=(_WIDTH_IN, _WIDTH_IN * shape + 1.4), layout="constrained", dpi=_DPI)
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xlim=(west, east), ylim=(south, north), aspect="equal", xlabel="east (m)", ylabel="north (m)")
    axes.set_title(harmless(title or scene.title()), fontsize=11, pad=34, parse_math=False)
    _draw_ground(axes, scene)
    if blocks:
        outlines = PolyCollection(scene.blocks(), facecolor="none", edgecolor=style.BLOCK, linewidth=0.4)
        axes.add_collection(outlines, autolim=False)
        outlines.set(zorder=2.5, label="block")
    _draw_lines(axes, scene)
    _draw_scale(axes, scene)
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    place_labels(axes, scene)
    return figure


def _draw_ground(axes: Any, scene: Scene) -> None:  # noqa: ANN401 - matplotlib is untyped
    _fill(axes, scene.outside, facecolor=style.OUTSIDE, edgecolor="none", zorder=1, label="outside")
    _fill(
        axes,
        scene.margin,
        facecolor=style.MARGIN,
        edgecolor="none",
        zorder=2,
        label="nearer to a fence than the route",
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
        keep_in = scene.plan.ground.keep_in
        _fill(
            axes,
            keep_in,
            facecolor="none",
            edgecolor=style.INCLUSION,
            linewidth=2.2,
            zorder=4,
            label="inclusion",
        )


def _draw_lines(axes: Any, scene: Scene) -> None:  # noqa: ANN401
    route = scene.route
    _fill(
        axes,
        scene.envelope,
        facecolor=style.ENVELOPE,
        edgecolor=style.ROUTE,
        linewidth=0.5,
        alpha=0.45,
        zorder=5,
        label="predicted track",
    )
    axes.plot(*route.T, "-", color=style.ROUTE, linewidth=1.8, zorder=6, label="route")
    axes.plot(*route[1:-1].T, "o", color="white", mec=style.ROUTE, markersize=4.5, zorder=7, label="waypoint")
    if len(scene.track):
        axes.plot(*scene.track.T, "--", color=style.TRACK, linewidth=1.2, zorder=8, label="driven")
    axes.plot(*route[0], "s", color=style.ROUTE, mec="black", markersize=9, zorder=9, label="start")
    several = len(scene.targets) > 1
    look: dict[str, Any] = {"color": style.TARGET, "mec": "black", "zorder": 9, "label": "target"}
    axes.plot(*scene.targets.T, "o" if several else "*", markersize=13 if several else 15, **look)
    for number, target in enumerate(scene.targets if several else (), start=1):
        axes.annotate(
            str(number), target, ha="center", va="center_baseline", fontsize=8, weight="bold", zorder=10
        )


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


def _draw_scale(axes: Any, scene: Scene) -> None:  # noqa: ANN401
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
