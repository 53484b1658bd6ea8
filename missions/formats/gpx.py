"""GPX 1.1: routes, tracks and waypoints; written are the mission's places as a route, home as a waypoint."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from missions.errors import InvalidPositionError, MissionFormatError
from missions.formats.choices import NO_CHOICES
from missions.formats.feature_reading import situation_of
from missions.formats.features import Feature, Role, Shape, name_key
from missions.formats.numbers import number
from missions.formats.xml_tree import parse_xml
from missions.geo import checked_lat_lon
from missions.situation import Reading

if TYPE_CHECKING:
    from missions.formats.choices import Choices
    from missions.formats.xml_tree import Element
    from missions.geo import LatLon
    from missions.situation import Situation


def read(text: str, source: str, choices: Choices = NO_CHOICES) -> Situation:
    """Read a file's text: its one route is the mission, or where there is none its one track, or its waypoints.

    A waypoint named home is home.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    root = parse_xml(text, source)
    if root.name != "gpx":
        raise root.error(f"<{root.name}>; expected <gpx>")
    routes = [_line(route, route, "rtept", Shape.LINE) for route in root.all("rte")]
    tracks = [
        _line(segment, track, "trkpt", Shape.TRACK)
        for track in root.all("trk")
        for segment in track.all("trkseg")
    ]
    drawn = [route for route in routes if route.lines[0]]
    drawn += [track for track in tracks if len(track.lines[0]) > 1]  # receivers write tracks of one position
    points = [_way_point(element) for element in root.all("wpt")]
    places = [point for point in points if name_key(point.names[0]) != Role.HOME]
    remarks: tuple[str, ...] = ()
    if len(drawn) == 1 and drawn[0].shape is Shape.TRACK:
        drawn = [replace(drawn[0], fallback=Role.ROUTE)]
        remarks = (f"{source}: the recorded track is used as the route",)
    elif not drawn and places:
        points = [replace(point, fallback=Role.WAYPOINT) for point in points]
        remarks = (f"{source}: {len(places)} waypoints are used as the mission, in file order",)
    situation = situation_of([*drawn, *points], source, choices)
    remarks = (*(remarks if situation.mission else ()), *situation.remarks)
    return replace(situation, reading=Reading(remarks=remarks))


def _line(element: Element, named: Element, point: str, shape: Shape) -> Feature:
    places = tuple(map(_position, element.all(point)))
    return Feature(shape, (places,), {}, (named.text_of("name"),), element.where)


def _way_point(element: Element) -> Feature:
    return Feature(Shape.POINT, ((_position(element),),), {}, (element.text_of("name"),), element.where)


def _position(element: Element) -> LatLon:
    values = [element.attributes.get(key, "") for key in ("lat", "lon")]
    try:
        lat_deg, lon_deg = map(number, values)
        return checked_lat_lon(lat_deg, lon_deg)
    except (ValueError, InvalidPositionError) as error:
        raise element.error(f"{error}; expected lat and lon in decimal degrees") from None


def write(situation: Situation) -> str:
    """Return the text of a file with the places of the situation's mission; commands without a place are left out.

    Raises
    ------
    MissionFormatError
        The mission has no place.
    """
    assert situation.mission is not None
    mission = situation.mission.value
    home = mission.home or (situation.home.value if situation.home else None)
    places = [(seq, item.position) for seq, item in enumerate(mission.items, start=1) if item.is_placed]
    if not places:
        raise MissionFormatError("a .gpx file contains a route, but no mission item has a position")
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            '<gpx version="1.1" creator="PBPP Rover" xmlns="http://www.topografix.com/GPX/1/1">',
            *([_point("wpt", home, "home")] if home else []),
            "<rte>",
            "<name>mission</name>",
            *(_point("rtept", position, f"waypoint {seq}") for seq, position in places),
            "</rte>",
            "</gpx>",
            "",
        ]
    )


def _point(tag: str, position: LatLon, name: str) -> str:
    return f'<{tag} lat="{position.lat_deg:.8f}" lon="{position.lon_deg:.8f}"><name>{name}</name></{tag}>'
