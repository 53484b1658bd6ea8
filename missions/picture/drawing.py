"""What is drawn on a page, with nothing left to decide: lines, areas, discs and words, each with its place, size and colour.

Whatever makes a file of it (`figure` by matplotlib, `svg` by the standard library) only writes it down. Places are points of 1/72 inch from
the page's upper left corner, x to the right, y down. What comes later lies above what came before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Look:
    """How something is painted; a colour that is None is not painted.

    Parameters
    ----------
    fill, line : str or None
        The colours of the area and of the line, ``#RRGGBB``. Lines have round corners and end where they end.
    width_pt : float
        Of the line.
    dashes_pt : tuple of float
        Line and gap by turns; a whole line if empty.
    opacity : float
        Of both.
    """

    fill: str | None = None
    line: str | None = None
    width_pt: float = 1.0
    dashes_pt: tuple[float, ...] = ()
    opacity: float = 1.0


@dataclass(frozen=True, eq=False, slots=True)
class Outlines:
    """Lines, or the outlines of one area: holes run the other way round than what they are holes of.

    Parameters
    ----------
    name : str
        What it stands for, in one word.
    lines : tuple of ndarray of float, shape (n, 2)
        The points of each.
    look : Look
    is_closed : bool
        Whether the last point of each is joined to the first.
    """

    name: str
    lines: tuple[NDArray[np.float64], ...]
    look: Look
    is_closed: bool = False


@dataclass(frozen=True, slots=True)
class Spot:
    """A circle of a size that no scale changes."""

    name: str
    middle: tuple[float, float]
    radius_pt: float
    look: Look


@dataclass(frozen=True, slots=True)
class Words:
    """One line of text, in DejaVu Sans or what is most like it.

    Parameters
    ----------
    name : str
        What it stands for, in one word.
    text : str
        Harmless.
    at : tuple of float
        The middle of its baseline, or where that begins.
    size_pt : float
    is_centred, is_bold : bool
    is_upward : bool
        Whether it is read from below, turned left.
    color : str
    """

    name: str
    text: str
    at: tuple[float, float]
    size_pt: float
    is_centred: bool = True
    is_bold: bool = False
    is_upward: bool = False
    color: str = "#000000"


Part: TypeAlias = "Outlines | Spot | Words"
"""What a drawing is made of."""


@dataclass(frozen=True, eq=False, slots=True)
class DrawnPage:
    """A page.

    Parameters
    ----------
    width_pt, height_pt : float
        Its size; it is white.
    title, description : str
        What is on it, for those who do not see it.
    frame : tuple of float
        Left, top, right and bottom of the map.
    inside : tuple of Part
        What the map shows, cut off at the frame.
    around : tuple of Part
        What lies above and around the map.
    """

    width_pt: float
    height_pt: float
    title: str
    description: str
    frame: tuple[float, float, float, float]
    inside: tuple[Part, ...]
    around: tuple[Part, ...]
