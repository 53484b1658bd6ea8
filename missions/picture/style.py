"""Colours of all pictures: Okabe and Ito's, distinguishable for the colour-blind, and by lightness, line or hatching without colour."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

INCLUSION: Final = "#009E73"
EXCLUSION: Final = "#D55E00"
EXCLUSION_FILL: Final = "#F7D9C4"
OUTSIDE: Final = "#DDDDDD"
MARGIN: Final = "#FCF3DC"
MARGIN_EDGE: Final = "#C9A227"
ROUTE: Final = "#0072B2"
UNSAFE: Final = "#B00020"
BAND: Final = "#56B4E9"
TARGET: Final = "#F0E442"
BLOCK: Final = "#8A8A8A"
TRACKS: Final = ("#000000", "#7A4A00", "#5B3FB5", "#2E7F8E", "#AA3377", "#8A6A00")
"""Driven lines, in turn: darker than the grounds, and none of them the route's, the fence's or the targets'."""

TRACK_DASHES: Final = ("-", "--", "-.", ":")
"""Their dashes, one after the other where the colours have been used."""

DASHES: Final = {"-": (), "--": (3.7, 1.6), "-.": (6.4, 1.6, 1.0, 1.6), ":": (1.0, 1.65)}
"""Line and gap by turns, in widths of the line: those of matplotlib, which draws charts with the same."""

MOST_LOOKS: Final = len(TRACKS) * len(TRACK_DASHES)
"""So many driven lines can be told apart."""


def track_looks(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return the colour and the dashes of driven lines by their names; one alone is dashed, so that the route is seen under it."""
    different = list(dict.fromkeys(names))
    if len(different) == 1:
        return {different[0]: (TRACKS[0], "--")}
    places = (divmod(number, len(TRACKS)) for number in range(len(different)))
    return {
        name: (TRACKS[place], TRACK_DASHES[rounds % len(TRACK_DASHES)])
        for name, (rounds, place) in zip(different, places, strict=True)
    }
