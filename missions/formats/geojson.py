"""GeoJSON (RFC 7946): fences, missions, rally points and home as features; positions are longitude first."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from missions.formats.bounds import check_depth
from missions.formats.choices import NO_CHOICES
from missions.formats.feature_reading import situation_of
from missions.formats.feature_writing import features_of
from missions.formats.features import Feature, Shape
from missions.formats.json_node import parse_json

if TYPE_CHECKING:
    from missions.formats.choices import Choices
    from missions.formats.json_node import JsonNode
    from missions.geo import LatLon
    from missions.situation import Situation

_ONE_OF = {"MultiPoint": "Point", "MultiLineString": "LineString", "MultiPolygon": "Polygon"}
_GEOMETRIES = ("Point", "LineString", "Polygon", *_ONE_OF, "GeometryCollection")
_WGS84 = ("CRS84", "CRS84H", "EPSG::4326", "EPSG:4326", "EPSG::4979", "EPSG:4979")
_WGS84_CODES = (4326, 4979)  # EPSG, without and with height


def read(text: str, source: str, choices: Choices = NO_CHOICES) -> Situation:
    """Read a file's text.

    Raises
    ------
    MissionFormatError
        With the JSON path and what was expected there.
    """
    node = parse_json(text, source)
    _check_reference_system(node)
    return situation_of(_features(node), source, choices)


def write(situation: Situation) -> str:
    """Return the text of a file with the situation's fence, mission, rally points and home."""
    zones, others = features_of(situation)
    rows = [json.dumps(_feature_json(feature), allow_nan=False) for feature in (*zones, *others)]
    return '{"type": "FeatureCollection", "features": [\n' + ",\n".join(rows) + "\n]}\n"


def _check_reference_system(node: JsonNode) -> None:
    """Refuse coordinates of another system: metres of a map grid may pass for degrees."""
    if "crs" not in node or node["crs"].value is None:
        return
    properties = node["crs"]["properties"]
    if "code" in properties and str(properties["code"].value) in map(str, _WGS84_CODES):
        return
    name = properties["code" if "code" in properties else "name"]
    if not str(name.value).upper().endswith(_WGS84):
        raise name.error(
            f"{name.value!r}; expected longitude and latitude in WGS 84 (CRS84)",
            advice="export it in EPSG:4326 (QGIS: Export, Save Features As…, CRS EPSG:4326)",
        )


def _features(node: JsonNode) -> list[Feature]:
    if node["type"].value == "FeatureCollection":
        return [shape for member in node["features"].members() for shape in _feature(member)]
    if node["type"].value == "Feature":
        return _feature(node)
    return _shapes(node, {}, (), node)


def _feature(node: JsonNode) -> list[Feature]:
    if node["type"].value != "Feature":
        raise node["type"].error(f"{node['type'].value!r}; expected 'Feature'")
    properties = node["properties"].value if "properties" in node else None
    if not isinstance(properties, dict | None):
        raise node["properties"].error("expected an object or null")
    said = [value for key, value in (properties or {}).items() if key.lower() == "name"]
    names = tuple(name for name in said if isinstance(name, str))
    if "geometry" not in node or node["geometry"].value is None:
        return [Feature(Shape.NOWHERE, (), properties or {}, names, _place(node))]
    return _shapes(node["geometry"], properties or {}, names, node)


def _shapes(
    node: JsonNode, properties: dict[str, object], names: tuple[str, ...], at: JsonNode, depth: int = 1
) -> list[Feature]:
    check_depth(depth, _place(at))
    kind = node["type"].value
    if kind not in _GEOMETRIES:
        raise node["type"].error(
            f"{kind!r} is not supported; expected {', '.join(_GEOMETRIES[:-1])} or {_GEOMETRIES[-1]}"
        )
    if kind == "GeometryCollection":
        geometries = _members(node["geometries"], "geometries")
        return [
            shape for geometry in geometries for shape in _shapes(geometry, properties, names, at, depth + 1)
        ]
    coordinates = node["coordinates"]
    parts = _members(coordinates, "parts") if kind in _ONE_OF else [coordinates]
    return [Feature(*_shape(_ONE_OF.get(kind, kind), part), properties, names, _place(at)) for part in parts]


def _shape(kind: str, coordinates: JsonNode) -> tuple[Shape, tuple[tuple[LatLon, ...], ...]]:
    if kind == "Point":
        return Shape.POINT, ((coordinates.lon_lat(),),)
    if kind == "LineString":
        return Shape.LINE, (_line(coordinates, 2),)
    return Shape.POLYGON, tuple(map(_ring, _members(coordinates, "rings")))


def _members(node: JsonNode, what: str) -> list[JsonNode]:
    members = node.members()
    if not members:
        raise node.error(f"expected {what}, found none")
    return members


def _line(node: JsonNode, least: int) -> tuple[LatLon, ...]:
    positions = tuple(position.lon_lat() for position in node.members())
    if len(positions) < least:
        raise node.error(f"{len(positions)} positions; expected at least {least}")
    return positions


def _ring(node: JsonNode) -> tuple[LatLon, ...]:
    positions = _line(node, 3)
    open_ring = positions[:-1] if positions[0] == positions[-1] else positions
    if len(open_ring) < 3:
        raise node.error(f"{len(open_ring)} vertices; a polygon needs at least 3")
    return open_ring


def _place(node: JsonNode) -> str:
    return f"{node.source}: {node.where or 'top level'}"


def _feature_json(feature: Feature) -> dict[str, Any]:
    properties = {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in feature.properties.items()
    }
    return {
        "type": "Feature",
        "properties": {"name": feature.names[0], **properties},
        "geometry": _geometry_json(feature),
    }


def _geometry_json(feature: Feature) -> dict[str, Any] | None:
    if feature.shape is Shape.NOWHERE:
        return None
    if feature.shape is Shape.POINT:
        return {"type": "Point", "coordinates": _pair(feature.position)}
    line = feature.lines[0]
    if feature.shape is Shape.LINE:
        return {"type": "LineString", "coordinates": [_pair(position) for position in line]}
    ring = _counterclockwise(line)
    return {"type": "Polygon", "coordinates": [[_pair(position) for position in (*ring, ring[0])]]}


def _counterclockwise(ring: tuple[LatLon, ...]) -> tuple[LatLon, ...]:
    """Return a ring as RFC 7946 wants outer rings (counter-clockwise), beginning with the same vertex."""
    doubled_area = sum(
        a.lon_deg * b.lat_deg - b.lon_deg * a.lat_deg for a, b in zip(ring, (*ring[1:], ring[0]), strict=True)
    )
    return ring if doubled_area >= 0 else (ring[0], *ring[:0:-1])


def _pair(position: LatLon) -> list[float]:
    return [round(position.lon_deg, 9), round(position.lat_deg, 9)]
