"""Pictures of what was driven: the fence, the track coloured by mode, the mission, the targets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely

from missions.errors import MissionFormatError
from missions.fence import PolygonZone, ZoneKind
from missions.formats.files import write_file
from missions.ground.frame import frame_around
from missions.ground.ground import lay_out
from missions.harmless import harmless
from missions.picture import check_picture_format, style
from missions.picture.scene import polygons

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray
    from shapely import Polygon

    from missions.fence import Fence
    from missions.formats.files import Writer
    from missions.geo import LatLon
    from missions.ground.frame import LocalFrame
    from missions.ground.ground import Ground

_BORDER_SHARE = 0.06  # as in `scene`
_MODE_COLOURS: Final = ("#0072B2", "#CC79A7", "#000000", "#56B4E9", "#E69F00", "#8A8A8A")
"""Okabe and Ito's, without those that the fence and the targets have."""

_MODE_LINES: Final = ("-", "--", "-.", ":", "-", "--")
_PLOTLY_LINES: Final = {"-": "solid", "--": "dash", "-.": "dashdot", ":": "dot"}


@dataclass(frozen=True, eq=False)
class TrackPicture:
    """What a picture of a drive shows.

    Parameters
    ----------
    fence : Fence or None
        The zones.
    parts : tuple of (str, sequence of LatLon)
        The track in stretches, each with its mode.
    mission : tuple of LatLon
        The mission's waypoints.
    targets : tuple of LatLon
        Where somebody sent the vehicle to.
    title : str
        Above the picture.
    union : bool
        Whether one inclusion is enough.

    Raises
    ------
    MissionFormatError
        There is nothing to draw.
    """

    fence: Fence | None
    parts: tuple[tuple[str, tuple[LatLon, ...]], ...]
    mission: tuple[LatLon, ...] = ()
    targets: tuple[LatLon, ...] = ()
    title: str = ""
    union: bool = False

    def __post_init__(self) -> None:
        if not self._places:
            raise MissionFormatError("there is nothing to draw: no fence, no track, no mission and no target")

    @cached_property
    def _places(self) -> list[LatLon]:
        zones = self.fence.zones if self.fence else ()
        corners = [
            place
            for zone in zones
            for place in (zone.vertices if isinstance(zone, PolygonZone) else (zone.centre,))
        ]
        driven = [place for _, positions in self.parts for place in positions]
        return [*corners, *driven, *self.mission, *self.targets]

    @cached_property
    def frame(self) -> LocalFrame:
        """The plane of the picture."""
        return frame_around(self._places)

    @cached_property
    def ground(self) -> Ground | None:
        """The fence laid out."""
        return lay_out(self.fence, self.frame, union=self.union, around=self._places) if self.fence else None

    @cached_property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """West, south, east, north, with a border."""
        areas = [barrier.area for barrier in self.ground.barriers] if self.ground else []
        points = shapely.MultiPoint(self.frame.to_local_array(self._places))
        west, south, east, north = shapely.union_all([*(area.envelope for area in areas), points]).bounds
        border_m = max(1.0, _BORDER_SHARE * max(east - west, north - south))
        return west - border_m, south - border_m, east + border_m, north + border_m

    def zones(self, kind: ZoneKind) -> list[Polygon]:
        """Return the polygons of one kind of zone."""
        barriers = self.ground.barriers if self.ground else ()
        return [part for barrier in barriers if barrier.kind is kind for part in polygons(barrier.area)]

    def lines(self) -> list[tuple[str, str, str, NDArray[np.float64]]]:
        """Return the track's stretches: mode, colour, line style and points (n, 2) in metres."""
        modes = list(dict.fromkeys(mode for mode, _ in self.parts))
        found = []
        for mode, positions in self.parts:
            number = modes.index(mode) % len(_MODE_COLOURS)
            points = self.frame.to_local_array(positions)
            found.append((mode, _MODE_COLOURS[number], _MODE_LINES[number], points))
        return found


def draw_track(picture: TrackPicture, path: Path, *, write: Writer = write_file) -> None:
    """Draw what was driven to a file.

    Parameters
    ----------
    picture : TrackPicture
    path : pathlib.Path
        The suffix chooses the format: .png, .svg, .pdf, .html.
    write : callable
        What puts the bytes into the file.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, a library is not installed, or the file cannot be written.
    """
    check_picture_format(path)
    if path.suffix.lower() == ".html":
        write(path, _page(picture))
    else:
        from missions.picture.figure import image_of  # noqa: PLC0415 - slow to come, an extra

        write(path, image_of(track_figure(picture), path.suffix))


def track_figure(picture: TrackPicture) -> Any:  # noqa: ANN401 - matplotlib is untyped
    """Draw what was driven as a matplotlib figure with one axes, in local metres."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415 - slow to come, an extra
    from matplotlib.figure import Figure  # noqa: PLC0415

    west, south, east, north = picture.bounds_m
    shape = min(1.5, max(0.45, (north - south) / (east - west)))
    figure = Figure(figsize=(8.0, 8.0 * shape + 1.2), layout="constrained", dpi=150)
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xlim=(west, east), ylim=(south, north), aspect="equal", xlabel="east (m)", ylabel="north (m)")
    axes.set_title(harmless(picture.title), fontsize=11, parse_math=False)
    named: set[str] = set()

    def once(name: str) -> str | None:
        is_new = name not in named
        named.add(name)
        return name if is_new else None

    for ring in _rings(picture.zones(ZoneKind.INCLUSION)):
        axes.plot(*ring.T, color=style.INCLUSION, linewidth=2.2, zorder=2, label=once("inclusion"))
    for area in picture.zones(ZoneKind.EXCLUSION):
        axes.fill(
            *np.asarray(area.exterior.coords).T,
            facecolor=style.EXCLUSION_FILL,
            edgecolor=style.EXCLUSION,
            hatch="////",
            linewidth=1.2,
            zorder=1,
            label=once("exclusion"),
        )
    if picture.mission:
        look: dict[str, Any] = {"color": style.BLOCK, "linewidth": 1.2, "markersize": 5, "zorder": 3}
        axes.plot(*picture.frame.to_local_array(picture.mission).T, "o:", label="mission", **look)
    for mode, colour, line, points in picture.lines():
        axes.plot(*points.T, line, color=colour, linewidth=1.8, zorder=4, label=once(mode))
    if picture.targets:
        targets = picture.frame.to_local_array(picture.targets)
        axes.plot(*targets.T, "*", color=style.TARGET, mec="black", markersize=13, zorder=5, label="target")
    if named or picture.targets or picture.mission:
        figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    return figure


def _page(picture: TrackPicture) -> bytes:
    import plotly.graph_objects as go  # noqa: PLC0415 - slow to come, an extra

    from missions.picture.html import plain_text  # noqa: PLC0415 - as above

    figure = go.Figure()
    named: set[str] = set()

    def add(name: str, points: NDArray[np.float64], **look: Any) -> None:  # noqa: ANN401 - plotly is untyped
        is_new = name not in named
        named.add(name)
        east_m, north_m = points.round(3).T.tolist()
        figure.add_trace(
            go.Scatter(x=east_m, y=north_m, name=name, legendgroup=name, showlegend=is_new, **look)
        )

    for ring in _rings(picture.zones(ZoneKind.INCLUSION)):
        add("inclusion", ring, mode="lines", line={"color": style.INCLUSION, "width": 3})
    for ring in _rings(picture.zones(ZoneKind.EXCLUSION)):
        line = {"color": style.EXCLUSION, "width": 1.5}
        add("exclusion", ring, mode="lines", line=line, fill="toself", fillcolor=style.EXCLUSION_FILL)
    if picture.mission:
        line = {"color": style.BLOCK, "dash": "dot"}
        add("mission", picture.frame.to_local_array(picture.mission), mode="lines+markers", line=line)
    for mode, colour, dash, points in picture.lines():
        add(mode, points, mode="lines", line={"color": colour, "width": 2.5, "dash": _PLOTLY_LINES[dash]})
    if picture.targets:
        marker = {
            "symbol": "star",
            "size": 13,
            "color": style.TARGET,
            "line": {"color": "black", "width": 1},
        }
        add("target", picture.frame.to_local_array(picture.targets), mode="markers", marker=marker)
    figure.update_layout(
        title=plain_text(picture.title),
        template="plotly_white",
        xaxis_title="east (m)",
        yaxis_title="north (m)",
    )
    figure.update_yaxes(scaleanchor="x")
    # Nobody's field belongs on plotly's server: plotly 7 has a button for that by default.
    config = {"displaylogo": False, "scrollZoom": True, "showSendToCloud": False}
    page = figure.to_html(include_plotlyjs=True, full_html=True, div_id="track", config=config)
    return bytes(page, "utf-8")


def _rings(areas: list[Polygon]) -> list[NDArray[np.float64]]:
    return [np.asarray(ring.coords) for area in areas for ring in (area.exterior, *area.interiors)]
