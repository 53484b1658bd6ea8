"""What GeoJSON and KML share: features, each a shape with properties and names (docs/files.md)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError
from missions.formats.numbers import number, whole

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.geo import LatLon


class Shape(StrEnum):
    """The shapes that are understood."""

    POINT = "point"
    LINE = "line"
    POLYGON = "polygon"
    NOWHERE = "feature without a geometry"


class Role(StrEnum):
    """What a feature is."""

    INCLUSION = "inclusion"
    EXCLUSION = "exclusion"
    ROUTE = "route"
    WAYPOINT = "waypoint"
    HOME = "home"
    RALLY_POINT = "rally point"
    RETURN_POINT = "return point"
    DRAWING = "drawing"


@dataclass(frozen=True, slots=True)
class Feature:
    """A shape with its properties.

    Parameters
    ----------
    shape : Shape
        Of what kind it is.
    lines : tuple of tuples of LatLon
        A point's one position, a line's positions, a polygon's open rings (the outer one first).
    properties : mapping of str to object
        Numbers, texts or booleans by name.
    names : tuple of str
        Its name and those of the folders it lies in, innermost first.
    where : str
        File and place, for errors.
    """

    shape: Shape
    lines: tuple[tuple[LatLon, ...], ...] = ()
    properties: Mapping[str, object] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    where: str = ""

    def error(self, problem: str) -> MissionFormatError:
        """Return an error that names the place in the file."""
        return MissionFormatError(f"{self.where}: {problem}", where=self.where)

    @property
    def position(self) -> LatLon:
        """A point's position."""
        return self.lines[0][0]

    def radius_m(self) -> float | None:
        """Return a circle's radius; None where the feature is not a point or has no radius."""
        if self.shape is not Shape.POINT:
            return None
        said = (key for key in self.properties if key.lower() in _RADIUS_KEYS)
        key = next((key for key in said if self.properties[key] not in (None, "")), None)
        if key is None:
            return None
        radius_m = self.number(key, math.nan)
        if not (math.isfinite(radius_m) and radius_m > 0):
            raise self.error(f"{key} {radius_m:g}; a circle's radius must be positive")
        return radius_m

    def number(self, key: str, default: float) -> float:
        """Return a property that is a number; the default where it is missing or null."""
        value = self.properties.get(key)
        if value is None:
            return default
        try:
            return number(str(int(value) if isinstance(value, bool) else value))
        except ValueError:
            raise self.error(f"{key} {value!r}; expected a number") from None

    def whole(self, key: str, default: int) -> int:
        """Return a property that is a whole number from 0 to 65535."""
        try:
            return whole(self.number(key, default), key, 65535)
        except ValueError as error:
            raise self.error(str(error)) from None


_RADIUS_KEYS = ("radius_m", "radius")
