"""Colours of all pictures: Okabe and Ito's, distinguishable for the colour-blind, and by lightness, line or hatching without colour."""

from __future__ import annotations

from typing import Final

INCLUSION: Final = "#009E73"
EXCLUSION: Final = "#D55E00"
EXCLUSION_FILL: Final = "#F7D9C4"
OUTSIDE: Final = "#DDDDDD"
MARGIN: Final = "#F8E7BF"
ROUTE: Final = "#0072B2"
ENVELOPE: Final = "#56B4E9"
TRACK: Final = "#000000"
TARGET: Final = "#F0E442"
BLOCK: Final = "#8A8A8A"
