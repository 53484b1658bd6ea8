"""Charts of numbers, for answers about many drives, as data: `chart_figure` draws them."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

CHART_SUFFIXES = (".png", ".svg", ".pdf")
"""The suffixes that a chart's file may have."""


@dataclass(frozen=True, slots=True)
class Series:
    """One line of a chart: its name, and its points; texts along x, or numbers."""

    name: str
    xs: tuple[Any, ...]
    ys: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Chart:
    """What is drawn.

    Parameters
    ----------
    title, x_label, y_label : str
    series : tuple of Series
        As many are drawn as can be told apart; the picture says how many are left out.
    bars : bool
        Bars upon one another, in place of points.
    diagonal : bool
        Draw the line on which x and y are equal.
    """

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    bars: bool = False
    diagonal: bool = False


def check_chart_formats(paths: Sequence[Path]) -> None:
    """Check that charts can have files of these names.

    Raises
    ------
    MissionFormatError
        A suffix is unknown, or the library that draws charts is not installed.
    """
    for path in paths:
        if path.suffix.lower() not in CHART_SUFFIXES:
            raise MissionFormatError(
                f"{path}: {path.suffix!r} is not a supported format of charts; supported: {', '.join(CHART_SUFFIXES)}",
                file=str(path),
                advice="choose another file extension",
            )
        if find_spec("matplotlib") is None:
            raise MissionFormatError(
                "charts need matplotlib: pip install 'pbpp-rover[plot]'", file=str(path), advice="install it"
            )
