"""What GeoJSON and KML share: features, each a shape with properties and names (docs/files.md)."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field, replace
from enum import StrEnum
from shlex import quote
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError
from missions.formats.numbers import number, whole

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from missions.geo import LatLon


class Shape(StrEnum):
    """The shapes that are understood."""

    POINT = "point"
    LINE = "line"
    TRACK = "track"
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
        Its name, empty where only folders have one, and those of the folders it lies in, innermost first.
    where : str
        File and place, for errors.
    label : str
        Its shape and number in the file, such as ``polygon 2``.
    handle : str
        What ``--role`` calls it: its name where no other has that, else its label.
    fallback : Role, optional
        What it is where nothing is said of it.
    is_hidden : bool
        Whether the program that it comes from does not show it.
    """

    shape: Shape
    lines: tuple[tuple[LatLon, ...], ...] = ()
    properties: Mapping[str, object] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    where: str = ""
    label: str = ""
    handle: str = ""
    fallback: Role | None = None
    is_hidden: bool = False

    def error(self, problem: str, **details: object) -> MissionFormatError:
        """Return an error that names the place in the file."""
        return MissionFormatError(f"{self.where}: {problem}", where=self.where, **details)

    def role_option(self, role: str) -> str:
        """Return the command line's option that gives it a role."""
        word = "ignore" if role == Role.DRAWING else role
        return f"--role {quote(f'{self.handle}={word}')}"

    def __str__(self) -> str:
        return f"{self.shape} {self.names[0]!r}" if self.names and self.names[0] else self.label or self.shape

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


def numbered(features: Sequence[Feature]) -> list[Feature]:
    """Return features with what they are called."""
    names = Counter(name_key(feature.names[0]) for feature in features if feature.names)
    counts: Counter[Shape] = Counter()
    result = []
    for feature in features:
        counts[feature.shape] += 1
        label = f"{'feature' if feature.shape is Shape.NOWHERE else feature.shape} {counts[feature.shape]}"
        own = feature.names[0] if feature.names else ""
        is_unique = own.strip() and names[name_key(own)] == 1
        result.append(replace(feature, label=label, handle=own if is_unique else label))
    return result


def name_key(name: str) -> str:
    """Return what two spellings of a name have in common."""
    return " ".join(name.split()).casefold()


_RADIUS_KEYS = ("radius_m", "radius")
