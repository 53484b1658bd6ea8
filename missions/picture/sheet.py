"""Where on a page the map lies: from local metres to points of the page."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import affinity

from missions.picture.drawing import Look, Outlines
from missions.picture.scene import polygons

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

EVEN_PT = 0.05  # what may be left out of a line that is only looked at; chosen: a tenth of a pixel
_HATCH_PT = 6.0  # between two lines of a hatched area, along the page


@dataclass(frozen=True, slots=True)
class Sheet:
    """A map's place on the page.

    Parameters
    ----------
    west_m, north_m : float
        The map's upper left corner in local metres.
    left_pt, top_pt : float
        The same corner on the page.
    pt_per_m : float
        The scale.
    """

    west_m: float
    north_m: float
    left_pt: float
    top_pt: float
    pt_per_m: float

    def points(self, places: Sequence[NDArray[np.float64]] | NDArray[np.float64]) -> NDArray[np.float64]:
        """Return places in local metres as points of the page, shape (n, 2)."""
        local_m = np.asarray(places, dtype=np.float64).reshape(-1, 2)
        return (local_m - (self.west_m, self.north_m)) * (self.pt_per_m, -self.pt_per_m) + (
            self.left_pt,
            self.top_pt,
        )

    def on_page(self, geometry: BaseGeometry) -> BaseGeometry:
        """Return a geometry in local metres as one on the page, without what is too small to be seen."""
        scale = self.pt_per_m
        shift = (self.left_pt - self.west_m * scale, self.top_pt + self.north_m * scale)
        return affinity.affine_transform(geometry, (scale, 0, 0, -scale, *shift)).simplify(EVEN_PT)


def area_outlines(name: str, area: BaseGeometry, look: Look) -> Outlines:
    """Return an area of the page as a shape."""
    rings = [ring for polygon in polygons(area) for ring in (polygon.exterior, *polygon.interiors)]
    return Outlines(name, tuple(shapely.get_coordinates(ring)[:-1] for ring in rings), look, is_closed=True)


def line_outlines(name: str, lines: BaseGeometry, look: Look) -> Outlines:
    """Return the lines of a geometry of the page as a shape."""
    parts = [part for part in shapely.get_parts(lines) if part.geom_type == "LineString" and part.length]
    return Outlines(name, tuple(shapely.get_coordinates(part) for part in parts), look)


def hatched(area: BaseGeometry) -> BaseGeometry:
    """Return the lines, rising to the right, that hatch an area of the page."""
    if area.is_empty:
        return area
    left, top, right, bottom = area.bounds
    rows = (
        np.arange(math.floor((left + top) / _HATCH_PT) + 1, math.ceil((right + bottom) / _HATCH_PT))
        * _HATCH_PT
    )
    ends = [((row - top, top), (row - bottom, bottom)) for row in rows.tolist()]
    return shapely.MultiLineString(ends).intersection(area)
