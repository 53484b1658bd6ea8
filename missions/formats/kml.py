"""KML (OGC 2.2): fences, missions, rally points and home as placemarks; positions are longitude first.

Folders and names give a placemark its role; so do ``Data`` and ``SimpleData`` of its ``ExtendedData``. KML has no circles: they are points
with a radius, and for the eye a polygon beside each that reading leaves out.
"""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING

from missions.errors import InvalidPositionError
from missions.formats.bounds import MOST_POSITIONS, check_bound
from missions.formats.choices import NO_CHOICES
from missions.formats.feature_reading import situation_of
from missions.formats.feature_writing import features_of
from missions.formats.features import Feature, Role, Shape
from missions.formats.numbers import number, swapped_hint
from missions.formats.xml_tree import parse_xml
from missions.geo import LatLon, checked_lat_lon, destination

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from missions.formats.choices import Choices
    from missions.formats.xml_tree import Element
    from missions.situation import Situation

_FOLDERS = ("kml", "Document", "Folder")
_SHAPES = ("Point", "LineString", "LinearRing", "Polygon", "MultiGeometry")
_TRACKS = ("Track", "MultiTrack")
_CIRCLE_CORNERS = 72  # every 5°: to look at; pbpp reads the circle's own data back
_STYLES = {  # colours of the pictures, as KML writes them: opacity, blue, green, red
    Role.INCLUSION: "<LineStyle><color>ff739e00</color><width>3</width></LineStyle><PolyStyle><fill>0</fill></PolyStyle>",
    Role.EXCLUSION: "<LineStyle><color>ff005ed5</color><width>2</width></LineStyle><PolyStyle><color>66005ed5</color></PolyStyle>",
    Role.ROUTE: "<LineStyle><color>ffb27200</color><width>3</width></LineStyle>",
}


def read(text: str, source: str, choices: Choices = NO_CHOICES) -> Situation:
    """Read a file's text.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    check_bound(text.count(",") // 2, MOST_POSITIONS, "positions", source)
    root = parse_xml(text, source)
    if root.name != "kml":
        raise root.error(f"<{root.name}>; expected <kml>")
    return situation_of(_features(root, ()), source, choices)


def write(situation: Situation) -> str:
    """Return the text of a file with the situation's fence, mission, rally points and home."""
    zones, others = features_of(situation)
    drawn = [_drawing(zone) for zone in zones if "radius_m" in zone.properties]
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            '<kml xmlns="http://www.opengis.net/kml/2.2">',
            "<Document>",
            *(f'<Style id="{role}">{style}</Style>' for role, style in _STYLES.items()),
            *_folder("fence", [*zones, *drawn]),
            *_folder("mission", others),
            "</Document>",
            "</kml>",
            "",
        ]
    )


def _features(element: Element, names: tuple[str, ...], *, is_hidden: bool = False) -> Iterator[Feature]:
    own = element.text_of("name")
    names = (own, *names) if own else names
    is_hidden = is_hidden or element.text_of("visibility") == "0"
    for child in element.children:
        if child.name in _FOLDERS:
            yield from _features(child, names, is_hidden=is_hidden)
        elif child.name == "Placemark":
            yield from _placemark(child, names, is_hidden=is_hidden)
        elif child.name == "NetworkLink":
            raise child.error("a NetworkLink, which is not followed; save the linked file and use that")


def _placemark(element: Element, names: tuple[str, ...], *, is_hidden: bool) -> list[Feature]:
    names = (element.text_of("name"), *names)
    properties = dict(_properties(element))
    is_hidden = is_hidden or element.text_of("visibility") == "0"
    shapes = list(_shapes(element)) or [(Shape.NOWHERE, (), element.where)]
    return [
        Feature(shape, lines, properties, names, where, is_hidden=is_hidden) for shape, lines, where in shapes
    ]


def _properties(element: Element) -> Iterator[tuple[str, str]]:
    for extended in element.all("ExtendedData"):
        for data in extended.all("Data"):
            yield data.attributes.get("name", ""), data.text_of("value")
        for schema in extended.all("SchemaData"):
            for data in schema.all("SimpleData"):
                yield data.attributes.get("name", ""), data.text.strip()


def _shapes(element: Element) -> Iterator[tuple[Shape, tuple[tuple[LatLon, ...], ...], str]]:
    for child in element.children:
        if child.name == "Model":
            raise child.error(f"a Model is not supported; expected one of {', '.join(_SHAPES)}")
        if child.name in _TRACKS:
            for track in (child, *child.all("Track")):
                positions = tuple(
                    _track_position(coord) for coord in track.all("coord") if coord.text.strip()
                )  # an empty one: nothing was known then
                if len(positions) > 1:
                    yield Shape.TRACK, (positions,), track.where
        elif child.name == "MultiGeometry":
            yield from _shapes(child)
        elif child.name == "Point":
            position, *more = _positions(child, 1)
            if more:
                raise child.error(f"{len(more) + 1} positions; a point has one")
            yield Shape.POINT, ((position,),), child.where
        elif child.name == "LineString":
            yield Shape.LINE, (_positions(child, 2),), child.where
        elif child.name == "LinearRing":
            yield Shape.POLYGON, (_ring(child),), child.where
        elif child.name == "Polygon":
            yield Shape.POLYGON, _polygon(child), child.where


def _polygon(element: Element) -> tuple[tuple[LatLon, ...], ...]:
    outer = [ring for side in element.all("outerBoundaryIs") for ring in side.all("LinearRing")]
    if len(outer) != 1:
        raise element.error(f"{len(outer)} outer rings; expected one <outerBoundaryIs><LinearRing>")
    inner = [ring for side in element.all("innerBoundaryIs") for ring in side.all("LinearRing")]
    return tuple(map(_ring, (*outer, *inner)))


def _ring(element: Element) -> tuple[LatLon, ...]:
    positions = _positions(element, 3)
    open_ring = positions[:-1] if positions[0] == positions[-1] else positions
    if len(open_ring) < 3:
        raise element.error(f"{len(open_ring)} vertices; a polygon needs at least 3")
    return open_ring


def _positions(element: Element, least: int) -> tuple[LatLon, ...]:
    coordinates = element.first("coordinates")
    if coordinates is None:
        raise element.error(f"a {element.name} without <coordinates>")
    # Written by hand there may be blanks around the commas
    words = ",".join(part.strip() for part in coordinates.text.split(",")).split()
    positions = tuple(_position(word, coordinates) for word in words)
    if len(positions) < least:
        raise coordinates.error(f"{len(positions)} positions; expected at least {least}")
    return positions


def _position(word: str, element: Element) -> LatLon:
    try:
        lon_deg, lat_deg, *more = map(number, word.split(","))
    except ValueError:
        more = [math.nan] * 2
    if len(more) > 1:
        raise element.error(
            f"{word[:60]!r}; expected longitude,latitude[,altitude] in decimal degrees, with decimal points"
        )
    return _checked(lat_deg, lon_deg, element)


def _track_position(element: Element) -> LatLon:
    try:
        lon_deg, lat_deg, *_ = map(number, element.text.split())
    except ValueError:
        raise element.error(f"{element.text[:60]!r}; expected longitude latitude altitude") from None
    return _checked(lat_deg, lon_deg, element)


def _checked(lat_deg: float, lon_deg: float, element: Element) -> LatLon:
    try:
        return checked_lat_lon(lat_deg, lon_deg)
    except InvalidPositionError as error:
        hint = swapped_hint(lat_deg, lon_deg, "longitude, latitude")
        raise element.error(f"{error}{hint}") from None


def _folder(name: str, features: Iterable[Feature]) -> list[str]:
    rows = [_placemark_xml(feature) for feature in features]
    return ["<Folder>", f"<name>{name}</name>", *rows, "</Folder>"] if rows else []


def _placemark_xml(feature: Feature) -> str:
    look = feature.properties.get("style", feature.properties["role"])
    style = f"<styleUrl>#{look}</styleUrl>" if look in _STYLES else ""
    data = "".join(
        f'<Data name="{key}"><value>{escape(str(value))}</value></Data>'
        for key, value in feature.properties.items()
    )
    return (
        f"<Placemark><name>{escape(feature.names[0])}</name>{style}"
        f"<ExtendedData>{data}</ExtendedData>{_shape_xml(feature)}</Placemark>"
    )


def _shape_xml(feature: Feature) -> str:
    if feature.shape is Shape.NOWHERE:
        return ""
    line = feature.lines[0]
    if feature.shape is Shape.POINT:
        return f"<Point>{_coordinates(line)}</Point>"
    if feature.shape is Shape.LINE:
        return f"<LineString><tessellate>1</tessellate>{_coordinates(line)}</LineString>"
    ring = f"<LinearRing>{_coordinates((*line, line[0]))}</LinearRing>"
    return f"<Polygon><outerBoundaryIs>{ring}</outerBoundaryIs></Polygon>"


def _coordinates(positions: Iterable[LatLon]) -> str:
    words = " ".join(f"{position.lon_deg:.8f},{position.lat_deg:.8f}" for position in positions)
    return f"<coordinates>{words}</coordinates>"


def _drawing(zone: Feature) -> Feature:
    """Return a polygon that draws a circle: around an exclusion, inside an inclusion."""
    radius_m = float(str(zone.properties["radius_m"]))
    if zone.properties["role"] == Role.EXCLUSION:
        radius_m /= math.cos(math.pi / _CIRCLE_CORNERS)
    bearings_deg = (360 * corner / _CIRCLE_CORNERS for corner in range(_CIRCLE_CORNERS))
    ring = tuple(destination(zone.position, radius_m, along_deg) for along_deg in bearings_deg)
    properties = {"role": Role.DRAWING.value, "style": zone.properties["role"]}
    return Feature(Shape.POLYGON, (ring,), properties, (f"{zone.names[0]}, drawn",))
