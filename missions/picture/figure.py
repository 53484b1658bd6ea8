"""Drawings as PNG and PDF, by matplotlib."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch, Rectangle
from matplotlib.path import Path as Curve
from matplotlib.text import Text
from matplotlib.transforms import Affine2D

from missions.picture.drawing import Outlines, Spot
from missions.picture.font import FAMILY

if TYPE_CHECKING:
    from matplotlib.artist import Artist

    from missions.picture.drawing import DrawnPage, Look, Part

_DPI = 150  # 1,200 pixels across
_PT_PER_IN = 72
UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""A picture of the same plan is the same file."""


def image_bytes(drawing: DrawnPage, suffix: str) -> bytes:
    """Return a drawing as an image of the format that a suffix names, PNG or PDF: the same bytes for the same drawing."""
    kind = suffix.lower()[1:]
    image = BytesIO()
    drawn_figure(drawing).savefig(image, format=kind, dpi=_DPI, metadata=UNDATED.get(kind))
    return image.getvalue()


def drawn_figure(drawing: DrawnPage) -> Figure:
    """Draw a drawing: a figure without axes, its parts in turn; a name is an artist's gid."""
    size_in = (drawing.width_pt / _PT_PER_IN, drawing.height_pt / _PT_PER_IN)
    figure = Figure(figsize=size_in, dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    to_page = Affine2D().scale(1, -1).translate(0, drawing.height_pt).scale(1 / _PT_PER_IN)
    place = to_page + figure.dpi_scale_trans
    left, top, right, bottom = drawing.frame
    frame = Rectangle((left, top), right - left, bottom - top, transform=place)
    for order, part in enumerate((*drawing.inside, *drawing.around)):
        artist = _artist(part, place)
        artist.set(gid=part.name, zorder=order)
        figure.add_artist(artist)
        if order < len(drawing.inside):
            artist.set_clip_path(frame)
    return figure


def _artist(part: Part, place: Any) -> Artist:  # noqa: ANN401 - matplotlib is untyped
    if isinstance(part, Outlines):
        lines = (
            Curve([*line, line[0]] if part.is_closed else line, closed=part.is_closed) for line in part.lines
        )
        return PathPatch(
            Curve.make_compound_path(*lines), transform=place, joinstyle="round", **_look(part.look)
        )
    if isinstance(part, Spot):
        return Circle(part.middle, part.radius_pt, transform=place, **_look(part.look))
    return Text(
        *part.at,
        part.text,
        transform=place,
        fontfamily=FAMILY,
        fontsize=part.size_pt,
        fontweight="bold" if part.is_bold else "normal",
        color=part.color,
        ha="center" if part.is_centred else "left",
        va="baseline",
        rotation=90 if part.is_upward else 0,
        rotation_mode="anchor",
        parse_math=False,
    )


def _look(look: Look) -> dict[str, object]:
    dashes = [part / look.width_pt for part in look.dashes_pt]  # matplotlib counts them in widths of the line
    return {
        "facecolor": look.fill or "none",
        "edgecolor": look.line or "none",
        "linewidth": look.width_pt if look.line else 0,
        "linestyle": (0, dashes) if dashes else "-",
        "alpha": look.opacity,
    }
