"""The track as it is shown: thinned to what can be seen, however long the drive."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mavlink_bridge.console.view.sections import TrackRow
    from missions.geo import LatLon

MOST_ROWS = 20_000
"""Of a track: at 0.1 m apart 2 km. Beyond that every second row is left out, and rows come half as often. Chosen, not measured."""

_STEP_M = 0.1  # between rows: less than a rover's own width by far; chosen, not measured
_DEG_M = 111_320.0  # a degree of latitude, near enough to thin a line
_STANDING_S = 60.0  # a vehicle that stands gets a row so often, so that its time is known; chosen


class Track:
    """Rows of one vehicle, in time.

    Attributes
    ----------
    rows : list of TrackRow
        What is shown.
    generation : int
        Another one whenever rows before the last were changed.
    """

    def __init__(self) -> None:
        self.rows: list[TrackRow] = []
        self.generation = 0
        self._step_m = _STEP_M

    def add(self, time_s: float, position: LatLon, speed_mps: float, mode: int | None) -> TrackRow | None:
        """Take where the vehicle is; return the row, None where nobody could see it."""
        row = (
            round(time_s, 2),
            round(position.lon_deg, 8),
            round(position.lat_deg, 8),
            round(speed_mps, 2),
            mode,
        )
        if self.rows and not self._shows(self.rows[-1], row):
            return None
        self.rows.append(row)
        if len(self.rows) > MOST_ROWS:
            self.rows = self.rows[:-1:2] + self.rows[-1:]
            self._step_m *= 2
            self.generation += 1
        return row

    def _shows(self, before: TrackRow, row: TrackRow) -> bool:
        """Return whether a row adds something that can be seen."""
        north_m = (row[2] - before[2]) * _DEG_M
        east_m = (row[1] - before[1]) * _DEG_M * math.cos(math.radians(row[2]))
        has_moved = math.hypot(north_m, east_m) >= self._step_m
        return has_moved or row[4] != before[4] or row[0] - before[0] >= _STANDING_S
