"""Pictures of plans (extra ``plot``): fence, clearance, route, start, targets, and the driven track where there is one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely import Polygon

from missions.errors import MissionFormatError
from missions.fence import ZoneKind

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from shapely.geometry.base import BaseGeometry

    from missions.geo import LatLon
    from missions.plan import Plan

PICTURE_SUFFIXES = (".png", ".svg", ".pdf")

# Okabe and Ito's colours: told apart by the colour-blind, and by their lightness in black and white.
_EXCLUSION = "#D55E00"
_INCLUSION = "#009E73"
_MARGIN = "#E69F00"
_ROUTE = "#0072B2"
_TRACK = "#000000"
_SIZE_IN = 8.0
_SCALE_STEPS_M = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)


def check_picture_format(path: Path) -> None:
    """Check, before any work is done, that a picture can be drawn to a path.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, or matplotlib is not installed.
    """
    if path.suffix.lower() not in PICTURE_SUFFIXES:
        raise MissionFormatError(
            f"{path}: no picture format for the suffix {path.suffix!r}; known are {', '.join(PICTURE_SUFFIXES)}"
        )
    try:
        import matplotlib as mpl  # noqa: F401, PLC0415 - an extra
    except ImportError:
        raise MissionFormatError("pictures need matplotlib: pip install 'pbpp-rover[plot]'") from None


def draw_plan(plan: Plan, path: Path, *, track: Sequence[LatLon] = (), title: str | None = None) -> None:
    """Draw a plan to a file.

    Parameters
    ----------
    plan : Plan
        What was planned.
    path : Path
        The suffix chooses the format.
    track : sequence of LatLon
        Where the vehicle drove, if it did.
    title : str, optional
        Default: length and clearance.

    Raises
    ------
    MissionFormatError
        The file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415 - slow to come, an extra
    from matplotlib.figure import Figure  # noqa: PLC0415

    view = _view(plan)
    width_m, height_m = view[1] - view[0], view[3] - view[2]
    figure = Figure(
        figsize=(_SIZE_IN, _SIZE_IN * min(1.6, max(0.5, height_m / width_m)) + 1.1), layout="constrained"
    )
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xlim=view[:2], ylim=view[2:], aspect="equal", xlabel="east (m)", ylabel="north (m)")
    axes.set_title(title or _title(plan), fontsize=11, pad=26)
    _draw_ground(axes, plan, view)
    _draw_lines(axes, plan, track)
    _draw_scale(axes, view)
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    try:
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise MissionFormatError(f"{path} cannot be written: {error.strerror}", file=str(path)) from None


def _title(plan: Plan) -> str:
    promised = "" if plan.clearance_m is None else f", {plan.clearance_m:g} m promised while driving"
    return f"{plan.length_m:.1f} m, drawn clearance {plan.drawn_clearance_m:.2f} m{promised}"


def _view(plan: Plan) -> tuple[float, float, float, float]:
    """Give the limits east and north: the fence's zones and the route, with a border."""
    route = plan.ground.frame.to_local_array(plan.path)
    shapes = [barrier.area for barrier in plan.ground.barriers if not _is_vast(plan, barrier.area)]
    west, south, east, north = shapely.union_all([*shapes, shapely.MultiPoint(route)]).bounds
    border_m = 0.06 * max(east - west, north - south)
    return west - border_m, east + border_m, south - border_m, north + border_m


def _is_vast(plan: Plan, area: BaseGeometry) -> bool:
    """Tell a home circle larger than the rest, which would shrink the picture."""
    others = [b.area for b in plan.ground.barriers if b.area is not area]
    return bool(others) and area.area > 3 * shapely.union_all(others).envelope.area


def _draw_ground(axes: Any, plan: Plan, view: tuple[float, float, float, float]) -> None:  # noqa: ANN401 - matplotlib is untyped
    ground = plan.ground
    frame = shapely.box(view[0], view[2], view[1], view[3])
    outside = frame.difference(ground.keep_in)
    _fill(axes, outside, facecolor="#DDDDDD", edgecolor="none", zorder=1)
    if math.isfinite(plan.drawn_clearance_m) and plan.drawn_clearance_m > 0:
        margin = ground.edge.buffer(plan.drawn_clearance_m).intersection(ground.allowed)
        _fill(
            axes,
            margin,
            facecolor=_MARGIN,
            alpha=0.25,
            edgecolor="none",
            zorder=2,
            label="nearer than the drawn clearance",
        )
    exclusions = shapely.union_all(ground.areas(ZoneKind.EXCLUSION))
    _fill(
        axes,
        exclusions,
        facecolor="#F7D9C4",
        edgecolor=_EXCLUSION,
        hatch="///",
        linewidth=1.2,
        zorder=3,
        label="exclusion",
    )
    if any(barrier.kind is ZoneKind.INCLUSION for barrier in ground.barriers):
        _fill(
            axes,
            ground.keep_in,
            facecolor="none",
            edgecolor=_INCLUSION,
            linewidth=2.0,
            zorder=4,
            label="inclusion",
        )


def _fill(axes: Any, area: BaseGeometry, *, label: str | None = None, **style: Any) -> None:  # noqa: ANN401
    from matplotlib.patches import PathPatch  # noqa: PLC0415
    from matplotlib.path import Path as Outline  # noqa: PLC0415

    parts = [part for part in shapely.get_parts(area) if isinstance(part, Polygon) and not part.is_empty]
    for part in parts:
        rings = [part.exterior, *part.interiors]
        outline = Outline.make_compound_path(
            *(Outline(np.asarray(ring.coords), closed=True) for ring in rings)
        )
        axes.add_patch(PathPatch(outline, label=label, **style))
        label = None


def _draw_lines(axes: Any, plan: Plan, track: Sequence[LatLon]) -> None:  # noqa: ANN401
    frame = plan.ground.frame
    route = frame.to_local_array(plan.path)
    axes.plot(*route.T, "-", color=_ROUTE, linewidth=2.2, zorder=6, label="route")
    axes.plot(
        *route[1:-1].T, "o", color="white", markeredgecolor=_ROUTE, markersize=5, zorder=7, label="waypoint"
    )
    if track:
        driven = frame.to_local_array(track)
        axes.plot(*driven.T, "--", color=_TRACK, linewidth=1.2, zorder=8, label="driven")
    start, targets = route[0], frame.to_local_array(plan.targets)
    axes.plot(*start, "s", color=_ROUTE, markeredgecolor="black", markersize=9, zorder=9, label="start")
    axes.plot(
        *targets.T, "*", color="#F0E442", markeredgecolor="black", markersize=15, zorder=9, label="target"
    )


def _draw_scale(axes: Any, view: tuple[float, float, float, float]) -> None:  # noqa: ANN401
    """Draw a scale bar and a north arrow above the field's upper corners, clear of the route."""
    width_m = view[1] - view[0]
    length_m = max((step for step in _SCALE_STEPS_M if step <= width_m / 5), default=1)
    left = 0.02
    right = left + length_m / width_m
    style: dict[str, Any] = {"transform": axes.transAxes, "clip_on": False, "zorder": 10}
    axes.plot([left, right], [1.02, 1.02], color="black", linewidth=3, **style)
    axes.text(right + 0.01, 1.02, f"{length_m} m", va="center", fontsize=9, transform=axes.transAxes)
    axes.annotate(
        "N",
        xy=(0.97, 1.06),
        xytext=(0.97, 1.005),
        xycoords="axes fraction",
        ha="center",
        va="bottom",
        fontsize=9,
        annotation_clip=False,
        arrowprops={"arrowstyle": "-|>", "linewidth": 1.5, "color": "black"},
    )
