"""What tests of file formats share: random situations, and both sides made alike before they are compared."""

from __future__ import annotations

import struct
from dataclasses import replace

from hypothesis import strategies as st
from strategies import fences, wire_lat_lons

from missions.fence import CircleZone, Fence, Zone
from missions.geo import LatLon
from missions.items import Command, MissionItem
from missions.rally import RallyPoint
from missions.situation import Known, Mission, Situation

mission_items = st.builds(
    MissionItem,
    command=st.sampled_from([16, 17, 18, 19, 20, 93, 112, 178, 194, 300]),
    frame=st.sampled_from([0, 2, 3, 10]),
    params=st.tuples(*[st.floats(-1e6, 1e6, width=32)] * 4),
    lat_e7=st.integers(-900_000_000, 900_000_000),
    lon_e7=st.integers(-1_800_000_000, 1_800_000_000),
    alt_m=st.integers(-100_000, 100_000).map(lambda centimetres: centimetres / 100),
    autocontinue=st.booleans(),
)
homes = wire_lat_lons.filter(any)


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """A mission with a home, and now and then a DO_JUMP to one of its items."""
    items = draw(st.lists(mission_items, min_size=1, max_size=6))
    if draw(st.booleans()):
        seq = float(draw(st.integers(1, len(items))))
        items.append(MissionItem(Command.DO_JUMP, 2, (seq, 3.0, 0.0, 0.0)))
    return Mission(tuple(items), draw(homes))


rally_points = st.builds(
    lambda place, alt_m: RallyPoint(*place, alt_m), wire_lat_lons, st.integers(-500, 8000).map(float)
)


@st.composite
def situations(draw: st.DrawFn) -> Situation:
    """Any of fence, mission and rally points; at least one of them."""
    fence, mission, rally = draw(st.tuples(st.booleans(), st.booleans(), st.booleans()).filter(any))
    made = draw(missions())
    points = tuple(draw(st.lists(rally_points, min_size=1, max_size=3)))
    return Situation(
        fence=known(draw(fences.filter(lambda fence: fence.zones))) if fence else None,
        mission=known(made) if mission else None,
        home=known(made.home) if mission else None,
        rally=known(points) if rally else None,
    )


def known(value):
    return Known(value, None, "a test")


def contents(situation: Situation) -> tuple[object, ...]:
    """Return what is known without its sources, rings turned so that they begin and run alike."""
    fence = situation.fence and situation.fence.value
    return (
        fence and Fence(tuple(map(_alike, fence.zones)), fence.return_point),
        situation.mission and situation.mission.value,
        situation.home and situation.home.value,
        situation.rally and situation.rally.value,
    )


def on_the_wire(value: float) -> float:
    """Return a number as MAVLink's 32 bits hold it."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


def fence_on_the_wire(fence: Fence) -> Fence:
    zones = [
        replace(zone, radius_m=on_the_wire(zone.radius_m)) if isinstance(zone, CircleZone) else zone
        for zone in fence.zones
    ]
    return Fence(tuple(zones), fence.return_point)


def mission_on_the_wire(mission: Mission) -> Mission:
    return replace(
        mission,
        items=tuple(replace(item, params=tuple(map(on_the_wire, item.params))) for item in mission.items),
    )


def _alike(zone: Zone) -> Zone:
    """GeoJSON wants outer rings counter-clockwise: a ring that runs the other way is the same ring."""
    if isinstance(zone, CircleZone):
        return zone
    ring = zone.vertices
    return replace(zone, vertices=min(ring, (ring[0], *ring[:0:-1])))


SQUARE = (LatLon(40.0, -105.0), LatLon(40.0, -104.999), LatLon(40.001, -104.999), LatLon(40.001, -105.0))
