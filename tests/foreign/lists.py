"""The lists that foreign clients upload, and how what comes back is compared."""

from __future__ import annotations

from missions.geo import LatLon
from missions.items import Command, CoordinateFrame, MissionItem

HOME = MissionItem(Command.NAV_WAYPOINT, CoordinateFrame.GLOBAL, lat_e7=400713740, lon_e7=-1052299300)
TARGET = LatLon(40.0720740, -105.2299300)
"""78 m north of home."""

MISSION = [
    HOME,
    *(
        MissionItem(
            Command.NAV_WAYPOINT,
            CoordinateFrame.GLOBAL_RELATIVE_ALT,
            lat_e7=400713740 + 900 * seq,
            lon_e7=-1052299300 + 1100 * seq,
        )
        for seq in range(1, 12)
    ),
]


def square(command, lat_e7, lon_e7, size_e7):
    """Return a square of fence by its south-west corner."""
    return [
        MissionItem(command, CoordinateFrame.GLOBAL, (4.0, 0.0, 0.0, 0.0), lat_e7 + north, lon_e7 + east)
        for north, east in ((0, 0), (size_e7, 0), (size_e7, size_e7), (0, size_e7))
    ]


FENCE = [
    *square(Command.FENCE_POLYGON_VERTEX_INCLUSION, 400713000, -1052303000, 20000),
    *square(Command.FENCE_POLYGON_VERTEX_EXCLUSION, 400719000, -1052297000, 2000),
]
BLOCKING_FENCE = [*FENCE, *square(Command.FENCE_POLYGON_VERTEX_EXCLUSION, 400718000, -1052299800, 1000)]
"""The same with a square across the straight way from home to `TARGET`."""


def places(items):
    return [(item.lat_e7, item.lon_e7) for item in items]


def places_in(path):
    """Return the places in a file of QGC WPL 110."""
    rows = [line.split("\t") for line in path.read_text().splitlines()[1:]]
    return [(round(float(row[8]) * 1e7), round(float(row[9]) * 1e7)) for row in rows]


def same(held, items):
    """Return whether the rover holds the items; MAVProxy cuts degrees to degE7 instead of rounding them."""
    return near(places(held), places(items))


def same_in(path, items):
    """Return whether a file that MAVProxy wrote, with six digits after the point, holds the items; home left to the vehicle."""
    first = 1 if items[0].command == Command.NAV_WAYPOINT else 0
    return near(places_in(path)[first:], places(items)[first:], 10)


def near(a, b, within=1):
    return len(a) == len(b) and all(
        abs(x - y) <= within for one, other in zip(a, b, strict=True) for x, y in zip(one, other, strict=True)
    )
