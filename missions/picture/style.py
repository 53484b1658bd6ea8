"""Colours of all pictures: Okabe and Ito's, distinguishable for the colour-blind, and by lightness, line or hatching without colour."""

from __future__ import annotations

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

MOST_LOOKS: Final = len(TRACKS) * len(TRACK_DASHES)
"""So many driven lines can be told apart."""


def track_look(number: int) -> tuple[str, str]:
    """Return the colour and the dashes of a driven line, counted from 0."""
    rounds, place = divmod(number, len(TRACKS))
    return TRACKS[place], TRACK_DASHES[rounds % len(TRACK_DASHES)]
