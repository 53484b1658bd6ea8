"""Interactive pages of scenes, drawn with plotly: one file that needs no network."""

from __future__ import annotations

import math
from html import escape
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go

from missions.fence import ZoneKind
from missions.picture import style
from missions.picture.scene import arrow_place, polygons
from missions.words import harmless

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.picture.scene import PictureScene

_ARROW_SHARE = 0.02  # of the width: half an arrow's length on a page
_HOVERS_PER_LEG = 25  # so that any place of a leg answers the pointer
_BESIDE_SIGN = "\u00a0" * 4
_SAME_M = 0.02  # rounding to degE7
_DASHES = {"-": "solid", "--": "dash", "-.": "dashdot", ":": "dot"}
_HATCH = {
    "shape": "/",
    "fgcolor": style.EXCLUSION,
    "bgcolor": style.EXCLUSION_FILL,
    "size": 8,
    "solidity": 0.25,
}
_CONFIG = {
    "displaylogo": False,
    "scrollZoom": True,
    "responsive": True,
    # Nobody's field belongs on plotly's server: plotly 7 has a button for that by default.
    "showSendToCloud": False,
    "modeBarButtonsToRemove": ["sendChartToCloud", "sendDataToCloud", "select2d", "lasso2d"],
}
_PAGE, _RESCALE = (
    Template(Path(__file__).with_name(name).read_text(encoding="utf-8"))
    for name in ("page.html", "scale_bar.js")
)
"""The page, and what keeps the scale bar in the corner, and of a round length, wherever the page is moved and zoomed to."""

# The picture's size and place in pixels and shares of it: by eye.
_NORTH = {
    "text": "<b>N</b><br>↑",
    "showarrow": False,
    "xref": "paper",
    "yref": "paper",
    "x": 1,
    "y": 1,
    "xanchor": "right",
    "yanchor": "top",
    "font": {"size": 14, "color": "black"},
}


def scene_page(scene: PictureScene) -> bytes:
    """Return a scene as a page."""
    figure = scene_html_figure(scene)
    bar = next(number for number, trace in enumerate(figure.data) if trace.name == "scale")
    plot = figure.to_html(
        include_plotlyjs=True,
        full_html=False,
        div_id="plan",
        default_height="100%",
        config=_CONFIG,
        post_script=_RESCALE.substitute(bar=bar),
    )
    lines = [plain_text(line) for line in scene.title]
    page = _PAGE.substitute(title=f"{lines[0]} – PBPP Rover", heading="<br>".join(lines), plot=plot)
    return bytes(page, "utf-8")


def plain_text(text: str) -> str:
    """Return a text as a page shows it as it stands: no tags, no links, no control characters."""
    return escape(harmless(text), quote=False)


def scene_html_figure(scene: PictureScene) -> go.Figure:
    """Draw a scene as a plotly figure, in local metres."""
    west, south, east, north = scene.bounds_m
    traces = [*_ground(scene), *_route(scene), *_tracks(scene), *_ends(scene), _names(scene), _scale(scene)]
    axis = {"constrain": "domain", "zeroline": False, "automargin": True}
    layout = go.Layout(
        xaxis={"title": {"text": "east (m)", "standoff": 5}, "range": [west, east], **axis},
        yaxis={
            "title": {"text": "north (m)", "standoff": 5},
            "range": [south, north],
            "scaleanchor": "x",
            **axis,
        },
        plot_bgcolor="white",
        hovermode="closest",
        dragmode="pan",
        margin={"l": 10, "r": 10, "t": 30, "b": 10},
        legend={"orientation": "h", "yanchor": "top", "y": -0.12, "xanchor": "center", "x": 0.5},
        annotations=[_NORTH],
    )
    return go.Figure(traces, layout)


def _ground(scene: PictureScene) -> Iterator[go.Scatter]:
    if scene.has_inclusion:
        yield _area(scene.outside, "outside the fence", fillcolor=style.OUTSIDE)
    if not (kept_off := scene.kept_off).is_empty:
        line = {"color": style.MARGIN_EDGE, "width": 0.8, "dash": "dash"}
        yield _area(kept_off, f"clearance, {scene.clearance_m:.4g} m", fillcolor=style.MARGIN, line=line)
    if scene.blocks:
        rings = [np.vstack((ring, ring[:1])) for ring in scene.blocks]
        yield _line(_joined(rings), "block", color=style.BLOCK, width=0.5)
    exclusions = [zone for zone in scene.ground.barriers if zone.kind is ZoneKind.EXCLUSION]
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
            scene.ground.keep_in.intersection(scene.frame),
            "inclusion",
            line={"color": style.INCLUSION, "width": 3},
            fill="none",
        )


def _route(scene: PictureScene) -> Iterator[go.Scatter]:
    if not scene.band.is_empty:
        yield _area(
            scene.band.intersection(scene.frame),
            "predicted corridor",
            fillcolor=_transparent(style.BAND, 0.45),
            line={"color": style.ROUTE, "width": 0.5},
        )
    route = scene.route
    if not len(route):
        return
    yield _line(route, scene.route_name, color=style.ROUTE, width=2.5)
    if scene.unsafe_legs:
        unsafe = _joined([route[leg : leg + 2] for leg in scene.unsafe_legs])
        yield _line(unsafe, "unsafe leg", color=style.UNSAFE, width=4.5)
    yield from _legs(scene)
    if waypoints := scene.waypoints:
        points = np.array([point for _, point, _ in waypoints])
        at_target = [any(math.dist(point, target) < _SAME_M for target in scene.targets) for point in points]
        # Beside a target's sign, which would cover it.
        numbers = [
            f"{_BESIDE_SIGN if covered else ''}{number}"
            for (number, _, _), covered in zip(waypoints, at_target, strict=True)
        ]
        yield _points(
            points, "waypoint", [_lines(text) for _, _, text in waypoints], _marker("circle", "white", 8)
        )
        look: dict[str, Any] = {
            "mode": "text",
            "textposition": ["middle right" if covered else "top right" for covered in at_target],
            "hoverinfo": "skip",
            "showlegend": False,
        }
        yield go.Scatter(**_east_north(points), name="number", text=numbers, textfont={"size": 11}, **look)
    if (place := scene.narrowest) is not None:
        line = {"color": "black", "width": 1.5}
        text = ["", f" {place.width_m:.1f} m"]
        marker = {"symbol": "line-ns-open", "size": 8, "color": "black"}
        look = {"mode": "lines+markers+text", "textposition": "middle right", "hoverinfo": "skip"}
        yield go.Scatter(
            **_east_north(place.ends), name="narrowest place", line=line, marker=marker, text=text, **look
        )


def _legs(scene: PictureScene) -> Iterator[go.Scatter]:
    """Return arrows that show the way, and invisible points along the legs that show the legs' figures on hovering."""
    if len(scene.route) < 2:
        return
    a, b = scene.route[:-1], scene.route[1:]
    colors = [style.UNSAFE if leg in scene.unsafe_legs else style.ROUTE for leg in range(len(a))]
    headings_deg = np.degrees(np.arctan2(*(b - a).T)).round(1).tolist()
    edge = {"color": "white", "width": 1}
    marker = {"symbol": "arrow", "angle": headings_deg, "size": 13, "color": colors, "line": edge}
    look: dict[str, Any] = {"mode": "markers", "showlegend": False}
    west, _, east, _ = scene.bounds_m
    marks = [mark.point for mark in scene.marks]
    places = [arrow_place(*leg, marks, _ARROW_SHARE * (east - west)) for leg in zip(a, b, strict=True)]
    yield go.Scatter(
        **_east_north(np.array(places)), name="direction", marker=marker, hoverinfo="skip", **look
    )
    shares = np.linspace(0, 1, _HOVERS_PER_LEG + 2)[1:-1, None]
    points = np.concatenate([begin + shares * (end - begin) for begin, end in zip(a, b, strict=True)])
    texts = [_lines(text) for text in scene.leg_texts for _ in range(_HOVERS_PER_LEG)]
    marker = {"size": 9, "color": style.ROUTE, "opacity": 0}
    yield go.Scatter(**_east_north(points), name="leg", marker=marker, text=texts, hoverinfo="text", **look)


def _tracks(scene: PictureScene) -> Iterator[go.Scatter]:
    looks = style.track_looks(track.name for track in scene.tracks)
    drawn: set[str] = set()
    for track in scene.tracks:
        color, dashes = looks[track.name]
        line = {"color": color, "width": 2, "dash": _DASHES[dashes]}
        name = plain_text(track.name)
        look = {"legendgroup": name, "showlegend": track.name not in drawn}
        yield go.Scatter(
            **_east_north(track.points), mode="lines", name=name, line=line, hoverinfo="skip", **look
        )
        drawn.add(track.name)
    if scene.marks:
        marker = {"symbol": "x", "size": 11, "color": style.UNSAFE, "line": {"color": "white", "width": 1.5}}
        names = [f"  {plain_text(mark.name)}" for mark in scene.marks]
        yield go.Scatter(
            **_east_north(np.array([mark.point for mark in scene.marks])),
            mode="markers+text",
            name=scene.marks_name,
            marker=marker,
            text=names,
            textposition="middle right",
            hoverinfo="skip",
        )


def _ends(scene: PictureScene) -> Iterator[go.Scatter]:
    """Return start and targets with their signs; a start that lies under a target is the larger one."""
    moved = ~np.isnan(scene.asked).any(axis=1)
    if moved.any():
        asked, reached = scene.asked[moved], scene.targets[moved]
        lines = _joined(list(np.stack((asked, reached), axis=1)))
        yield _line(lines, "moved", color="black", width=1.5, dash="dot", showlegend=False)
        hovers, signs = ["target as asked"] * len(asked), ["?"] * len(asked)
        yield _points(asked, "target as asked", hovers, _marker("circle", "white", 18, "black"), signs)
    if scene.start is not None:
        text = [_lines(scene.point_texts[0]) if scene.numbers and scene.numbers[0] is None else "start"]
        marker = _marker("square", style.ROUTE, 24, "black")
        yield _points(scene.start[None], "start", text, marker, ["S"], ink="white")
    if len(scene.targets):
        signs = [scene.target_sign(number) for number in range(len(scene.targets))]
        texts = [f"target {sign[1:]}<br>{text}" for sign, text in zip(signs, scene.target_texts, strict=True)]
        yield _points(scene.targets, "target", texts, _marker("circle", style.TARGET, 20, "black"), signs)


def _names(scene: PictureScene) -> go.Scatter:
    """Return the zones' names."""
    shown = [
        (seen.representative_point(), zone.name.replace(" ", "<br>", 1)) for zone, seen in scene.named_zones
    ]
    return go.Scatter(
        **_east_north(np.array([(point.x, point.y) for point, _ in shown]).reshape(-1, 2)),
        mode="text",
        name="name",
        text=[name for _, name in shown],
        textfont={"size": 11},
        hoverinfo="skip",
        showlegend=False,
    )


def _scale(scene: PictureScene) -> go.Scatter:
    """Return a scale bar in the lower left corner; a script keeps it there."""
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
        cliponaxis=False,
    )


def _lines(text: str) -> str:
    return "<br>".join(map(plain_text, text.split("\n")))


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


def _marker(symbol: str, color: str, size: int, edge: str = style.ROUTE) -> dict[str, Any]:
    return {"symbol": symbol, "color": color, "size": size, "line": {"color": edge, "width": 1.5}}


def _points(
    points: NDArray[np.float64],
    name: str,
    hovers: list[str],
    marker: dict[str, Any],
    signs: list[str] | None = None,
    *,
    ink: str = "black",
) -> go.Scatter:
    return go.Scatter(
        **_east_north(points),
        mode="markers+text" if signs else "markers",
        name=name,
        text=[f"<b>{sign}</b>" for sign in signs] if signs else None,
        textfont={"size": 11, "color": ink},
        hovertext=hovers,
        hoverinfo="text",
        marker=marker,
    )


def _east_north(points: NDArray[np.float64]) -> dict[str, list[float | None]]:
    """Return columns for plotly, rounded to millimetres, gaps as null."""
    rounded = np.round(points, 3)
    return {
        axis: [None if math.isnan(value) else value for value in column]
        for axis, column in zip("xy", rounded.T.tolist(), strict=True)
    }


def _joined(rings: Iterable[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Put rings into one array with a gap after each."""
    gap = np.full((1, 2), np.nan)
    return np.concatenate([np.empty((0, 2)), *(part for ring in rings for part in (ring, gap))])


def _coordinates(lines: BaseGeometry) -> NDArray[np.float64]:
    parts = [part for part in getattr(lines, "geoms", [lines]) if not part.is_empty]
    return _joined([np.asarray(part.coords) for part in parts])


def _transparent(color: str, opacity: float) -> str:
    red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {opacity})"
