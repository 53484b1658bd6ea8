"""GPX 1.1 (out only): the mission's places as a route, home as a waypoint."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from missions.geo import LatLon
    from missions.situation import Situation


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
        raise MissionFormatError("a .gpx file holds a route, and no item of the mission has a place")
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
