"""Interactive pages of plans, drawn with plotly: one file that needs no network."""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go

from missions.fence import ZoneKind
from missions.harmless import harmless
from missions.picture import style
from missions.picture.labels import short_name
from missions.picture.scene import polygons

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.picture.scene import Scene

_HOVERS_PER_LEG = 25  # so that any place of a leg answers the pointer
_HATCH = {
    "shape": "/",
    "fgcolor": style.EXCLUSION,
    "bgcolor": style.EXCLUSION_FILL,
    "size": 8,
    "solidity": 0.25,
}
_BODY = '<body style="margin: 0; overflow: hidden">'
_CONFIG = {
    "displaylogo": False,
    "scrollZoom": True,
    "responsive": True,
    # Nobody's field belongs on plotly's server: plotly 7 has a button for that by default.
    "showSendToCloud": False,
    "modeBarButtonsToRemove": ["sendChartToCloud", "sendDataToCloud", "select2d", "lasso2d"],
}


# The picture's size and place in pixels and shares of it: by eye.
_NORTH = {
    "text": "<b>N</b><br>↑",
    "showarrow": False,
    "xref": "paper",
    "yref": "paper",
    "x": 1,
    "y": 1,
    "xanchor": "right",
    "yanchor": "bottom",
    "font": {"size": 14, "color": "black"},
}


def html_page(scene: Scene, *, title: str | None = None, blocks: bool = False) -> bytes:
    """Return a scene as a page."""
    figure = html_figure(scene, title=title, blocks=blocks)
    page = figure.to_html(
        include_plotlyjs=True,
        full_html=True,
        div_id="plan",
        default_height="100vh",
        config=_CONFIG,
    ).replace("<body>", _BODY, 1)
    return bytes(page, "utf-8")


def plain_text(text: str) -> str:
    """Return a text as plotly shows it as it stands: no tags, no links, no control characters."""
    return escape(harmless(text), quote=False)


def html_figure(scene: Scene, *, title: str | None = None, blocks: bool = False) -> go.Figure:
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
    plotly.graph_objects.Figure
        In local metres.
    """
    west, south, east, north = scene.bounds_m
    traces = [*_ground(scene, blocks=blocks), *_lines(scene), _names(scene), _scale(scene)]
    layout = go.Layout(
        title={"text": plain_text(title or scene.title())},
        xaxis={
            "title": {"text": "east (m)"},
            "range": [west, east],
            "constrain": "domain",
            "zeroline": False,
        },
        yaxis={
            "title": {"text": "north (m)"},
            "range": [south, north],
            "scaleanchor": "x",
            "constrain": "domain",
            "zeroline": False,
        },
        plot_bgcolor="white",
        hovermode="closest",
        dragmode="pan",
        margin={"l": 70, "r": 30, "t": 70, "b": 20},
        legend={"orientation": "h", "yanchor": "top", "y": -0.09, "xanchor": "center", "x": 0.5},
        annotations=[_NORTH],
    )
    return go.Figure(traces, layout)


def _ground(scene: Scene, *, blocks: bool) -> Iterator[go.Scatter]:
    yield _area(scene.outside, "outside", fillcolor=style.OUTSIDE)
    yield _area(scene.margin, "nearer to a fence than the route", fillcolor=style.MARGIN)
    if blocks:
        rings = [np.vstack((ring, ring[:1])) for ring in scene.blocks()]
        yield _line(_joined(rings), "block", color=style.BLOCK, width=0.5)
    exclusions = [zone for zone in scene.plan.ground.barriers if zone.kind is ZoneKind.EXCLUSION]
    for number, zone in enumerate(exclusions):
        yield _area(
            zone.area.intersection(scene.frame),
            "exclusion",
            text=zone.name,
            line={"color": style.EXCLUSION, "width": 1.5},
            fillpattern=_HATCH,
            legendgroup="exclusion",
            showlegend=number == 0,
        )
    if scene.has_inclusion:
        edges = _coordinates(scene.inner_edges)
        yield _line(edges, "inclusion", color=style.INCLUSION, width=1.5, dash="dot", showlegend=False)
        yield _area(
            scene.plan.ground.keep_in.intersection(scene.frame),
            "inclusion",
            line={"color": style.INCLUSION, "width": 3},
            fill="none",
        )


def _lines(scene: Scene) -> Iterator[go.Scatter]:
    yield _area(
        scene.envelope,
        "predicted track",
        fillcolor=_transparent(style.ENVELOPE, 0.45),
        line={"color": style.ROUTE, "width": 0.5},
    )
    yield _line(scene.route, "route", color=style.ROUTE, width=2.5)
    yield _leg_hovers(scene)
    if len(scene.track):
        yield _line(scene.track, "driven", color=style.TRACK, width=1.5, dash="dash")
    arrivals_s = scene.plan.envelope.arrivals_s
    texts = [
        f"waypoint {number}<br>{position}<br>after {arrivals_s[number]:.0f} s"
        for number, position in enumerate(scene.plan.path)
    ]
    yield _points(scene.route[1:-1], "waypoint", texts[1:-1], "circle", "white", 8)
    yield _points(scene.route[:1], "start", [f"start<br>{scene.plan.start}"], "square", style.ROUTE, 12)
    targets = [f"target {number}<br>{at}" for number, at in enumerate(scene.plan.targets, start=1)]
    numbers = [f"<b>{number}</b>" for number in range(1, len(targets) + 1)]
    if len(targets) > 1:
        yield _points(scene.targets, "target", targets, "circle", style.TARGET, 22, numbers)
    else:
        yield _points(scene.targets, "target", targets, "star", style.TARGET, 16)


def _leg_hovers(scene: Scene) -> go.Scatter:
    """Return invisible points along the legs that show the legs' figures on hovering."""
    arrivals_s = scene.plan.envelope.arrivals_s
    points, texts = [], []
    for leg, clearance_m in enumerate(scene.leg_clearances_m):
        a, b = scene.route[leg], scene.route[leg + 1]
        clearance = f"{clearance_m:.2f} m from any fence" if math.isfinite(clearance_m) else "no fence near"
        points.append(np.linspace(a, b, _HOVERS_PER_LEG + 2)[1:-1])
        passing = f"from {arrivals_s[leg]:.0f} s to {arrivals_s[leg + 1]:.0f} s"
        text = f"leg {leg + 1}: {math.dist(a, b):.1f} m<br>{clearance}<br>{passing}"
        texts += [text] * _HOVERS_PER_LEG
    return go.Scatter(
        **_east_north(np.concatenate(points)),
        mode="markers",
        marker={"size": 9, "color": style.ROUTE, "opacity": 0},
        name="leg",
        text=texts,
        hoverinfo="text",
        showlegend=False,
    )


def _names(scene: Scene) -> go.Scatter:
    """Return the exclusions' short names; hovering shows the full ones."""
    shown = [
        (zone.area.intersection(scene.frame).representative_point(), short_name(zone.name))
        for zone in scene.plan.ground.barriers
        if zone.kind is ZoneKind.EXCLUSION and zone.area.intersects(scene.frame)
    ]
    return go.Scatter(
        **_east_north(np.array([(point.x, point.y) for point, _ in shown]).reshape(-1, 2)),
        mode="text",
        name="name",
        text=[f"<b>{name}</b>" for _, name in shown],
        hoverinfo="skip",
        showlegend=False,
    )


def _scale(scene: Scene) -> go.Scatter:
    """Return a scale bar that grows with the picture, in its lower left corner."""
    west, south, east, north = scene.bounds_m
    length_m = scene.scale_m()
    begin_m, height_m = west + (east - west) / 50, south + (north - south) / 50
    ends = np.array([(begin_m, height_m), (begin_m + length_m, height_m)])
    return go.Scatter(
        **_east_north(ends),
        mode="lines+text",
        name="scale",
        text=["", f" {length_m} m"],
        textposition="middle right",
        line={"color": "black", "width": 4},
        hoverinfo="skip",
        showlegend=False,
    )


def _area(area: BaseGeometry, name: str, *, text: str | None = None, **look: Any) -> go.Scatter:  # noqa: ANN401
    rings = [np.asarray(ring.coords) for part in polygons(area) for ring in (part.exterior, *part.interiors)]
    defaults: dict[str, Any] = {"fill": "toself", "line": {"width": 0}}
    return go.Scatter(
        **_east_north(_joined(rings)),
        mode="lines",
        name=name,
        text=text,
        hoverinfo="text" if text else "skip",
        hoveron="fills" if text else None,
        **{**defaults, **look},
    )


def _line(points: NDArray[np.float64], name: str, *, showlegend: bool = True, **line: Any) -> go.Scatter:  # noqa: ANN401
    return go.Scatter(
        **_east_north(points), mode="lines", name=name, line=line, hoverinfo="skip", showlegend=showlegend
    )


def _points(
    points: NDArray[np.float64],
    name: str,
    hovers: list[str],
    symbol: str,
    color: str,
    size: int,
    texts: list[str] | None = None,
) -> go.Scatter:
    edge = style.ROUTE if color == "white" else "black"
    return go.Scatter(
        **_east_north(points),
        mode="markers+text" if texts else "markers",
        name=name,
        text=texts,
        hovertext=hovers,
        hoverinfo="text",
        marker={"symbol": symbol, "color": color, "size": size, "line": {"color": edge, "width": 1.5}},
    )


def _east_north(points: NDArray[np.float64]) -> dict[str, list[float | None]]:
    """Return columns for plotly, rounded to millimetres, gaps as null."""
    rounded = np.round(points, 3)
    return {
        axis: [None if math.isnan(value) else value for value in column]
        for axis, column in zip("xy", rounded.T.tolist(), strict=True)
    }


def _joined(rings: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Put rings into one array with a gap after each."""
    gap = np.full((1, 2), np.nan)
    return np.concatenate([np.empty((0, 2)), *(part for ring in rings for part in (ring, gap))])


def _coordinates(lines: BaseGeometry) -> NDArray[np.float64]:
    parts = [part for part in getattr(lines, "geoms", [lines]) if not part.is_empty]
    return _joined([np.asarray(part.coords) for part in parts])


def _transparent(color: str, opacity: float) -> str:
    red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {opacity})"
