"""JSON read with care: every value knows where it stands, so that errors can name the place."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from missions.errors import InvalidPositionError, MissionFormatError
from missions.formats.bounds import MOST_JSON_VALUES, check_bound
from missions.formats.numbers import swapped_hint, whole
from missions.geo import checked_lat_lon

if TYPE_CHECKING:
    from missions.geo import LatLon


def parse_json(text: str, source: str) -> JsonNode:
    """Read a JSON text.

    Raises
    ------
    MissionFormatError
        The text is not JSON, or too large; the message names the line or the bound.
    """
    check_bound(sum(map(text.count, ",[{")), MOST_JSON_VALUES, "JSON values", source)
    try:
        return JsonNode(json.loads(text), source, "")
    except json.JSONDecodeError as error:
        raise MissionFormatError(
            f"{source}: line {error.lineno}: not JSON: {error.msg}", file=source
        ) from None
    except (RecursionError, ValueError) as error:
        reason = (
            "nested too deeply (about 1,000 levels)"
            if isinstance(error, RecursionError)
            else str(error).partition(" for integer")[0]
        )
        raise MissionFormatError(f"{source}: not JSON: {reason}", file=source) from None


class JsonNode:
    """A JSON value and its path.

    Parameters
    ----------
    value : object
        The value as ``json`` reads it.
    source : str
        The file.
    where : str
        The path, like ``mission.items[3]``; empty at the top.
    """

    def __init__(self, value: Any, source: str, where: str) -> None:  # noqa: ANN401 - JSON is anything
        self.value, self.source, self.where = value, source, where

    def error(self, problem: str, **details: object) -> MissionFormatError:
        """Return an error that names file and path."""
        where = self.where or "top level"
        return MissionFormatError(
            f"{self.source}: {where}: {problem}", file=self.source, where=where, **details
        )

    def __contains__(self, key: str) -> bool:
        return isinstance(self.value, dict) and key in self.value

    def __getitem__(self, key: str | int) -> JsonNode:
        step = f"[{key}]" if isinstance(key, int) else f".{key}" if self.where else key
        where = f"{self.where}{step}"
        try:
            return JsonNode(self.value[key], self.source, where)
        except (KeyError, IndexError, TypeError):
            raise JsonNode(None, self.source, where).error("missing") from None

    def members(self) -> list[JsonNode]:
        """Return the members of this list."""
        if not isinstance(self.value, list):
            raise self.error("expected a list")
        return [self[i] for i in range(len(self.value))]

    def number(self) -> float:
        """Return a number; one that is not finite only where the file has it so."""
        if isinstance(self.value, str):
            raise self.error(
                f"expected a number, found the text {self.value[:40]!r}; write it without quotation marks"
            )
        if isinstance(self.value, bool) or not isinstance(self.value, (int, float)):
            raise self.error("expected a number")
        try:
            return float(self.value)
        except OverflowError:
            raise self.error("expected a number of less than 300 digits") from None

    def whole(self, name: str, most: int) -> int:
        """Return a whole number from 0 to ``most``."""
        try:
            return whole(self.number(), name, most)
        except ValueError as error:
            raise self.error(str(error)) from None

    def lat_lon(self) -> LatLon:
        """Return the position of a list that begins with latitude and longitude."""
        if not isinstance(self.value, list) or len(self.value) < 2:
            raise self.error("expected [latitude, longitude]")
        return self._checked(self[0], self[1], "latitude, longitude")

    def lon_lat(self) -> LatLon:
        """Return the position of a list that begins with longitude and latitude."""
        if not isinstance(self.value, list) or len(self.value) < 2:
            raise self.error("expected [longitude, latitude]")
        return self._checked(self[1], self[0], "longitude, latitude")

    def _checked(self, lat_deg: JsonNode, lon_deg: JsonNode, order: str) -> LatLon:
        lat, lon = lat_deg.number(), lon_deg.number()
        try:
            return checked_lat_lon(lat, lon)
        except InvalidPositionError as error:
            raise self.error(f"{error}{swapped_hint(lat, lon, order)}") from None
