"""The simulated rover beside a real one: starts that face away, and LOITER_UNLIM (tests/missions/drive_model/data)."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from drive_model.real_tracks import rows_of, track_of
from simulator.station import HOME, at

from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.config import SimulatorConfig
from mavlink_bridge.simulator.rover import TICK_S
from mavlink_bridge.simulator.vehicle import SimulatedVehicle
from missions.firmware import Firmware
from missions.geo import LatLon, distance_m
from missions.items import Command, MissionItem, waypoint

FIRMWARE = {"2024-02": Firmware(4, 5), "2025-10": Firmware(4, 7, 0, 0)}
FOLLOWED_M = 0.3
AT_STOPS_FOLLOWED_M = 0.35
"""The real one rests 0.3 to 0.4 m farther on at a waypoint with a delay before it turns."""

SHARPEST_FOLLOWED_DEG = 160.0
"""At sharper turns the simulated rover swings out up to 1.1 m farther than the real one."""


def driven(
    row: dict[str, str], heading_deg: float, items: list[MissionItem], watched_s: float
) -> list[LatLon]:
    """Return the places of the simulated rover from AUTO on."""
    vehicle = SimulatedVehicle(
        SimulatorConfig(
            home=HOME,
            heading_deg=heading_deg,
            mission=tuple(items),
            parameters={
                "FENCE_ENABLE": 0.0,
                "TURN_RADIUS": 0.9,
                "WP_SPEED": float(row["speed_mps"]),
                "WP_RADIUS": float(row["wp_radius_m"]),
            },
            firmware=FIRMWARE[row["firmware"]],
            streams=False,
        )
    )
    vehicle.rover.arm()
    now_s = 1.0
    vehicle.rover.set_mode(Mode.AUTO, now_s)
    places = []
    while now_s < watched_s:
        now_s += TICK_S
        vehicle.rover.step(now_s)
        places.append(vehicle.position)
    return places


def starts() -> list[dict[str, str]]:
    """Return the starts that the simulated rover is held to; facing back, a degree decides on the side and on how far."""
    return [
        row
        for row in rows_of("short_starts.csv")
        if float(row["heading_off_deg"]) < 165 and row["onward_m"] != "0"
    ]


@pytest.mark.parametrize("row", starts(), ids=lambda row: "-".join(list(row.values())[:6]))
def test_a_start_swings_out_as_far(row: dict[str, str]) -> None:
    leg_m, speed_mps = float(row["leg_m"]), float(row["speed_mps"])
    real = track_of(row).tolist()
    items = [waypoint(at(leg_m, 0)), waypoint(at(leg_m, float(row["onward_m"])))]
    places = driven(row, float(row["heading_off_deg"]), items, 30.0 / speed_mps + 14.0)
    simulated = [offset_m(place) for place in places]
    for east, sign in ((False, -1), (False, 1), (True, 1)):
        farthest = [max(sign * place[0 if east else 1] for place in one) for one in (real, simulated)]
        assert farthest[1] == pytest.approx(farthest[0], abs=FOLLOWED_M)


def turns() -> list[dict[str, str]]:
    """Return some of the turns in mid-route, and stops; exactly back, a centimetre decides on the side."""
    return [
        row
        for row in rows_of("turns_back.csv")
        if row["turn_deg"] in {"90", "120", "150", "160", "170", "179"}
        and (row["delay_s"] != "0" or row["wp_radius_m"] == "1")
        and row["speed_mps"] in {"1", "2", "5"}
    ]


def ahead_and_aside_m(row: dict[str, str], places: list[tuple[float, float]]) -> list[float]:
    """Return how far a track goes past the waypoint, and to the outside of the next leg, once it is near the waypoint."""
    leg_m, turn = float(row["leg_m"]), math.radians(float(row["turn_deg"]))
    near = next(i for i, (east, north) in enumerate(places) if math.hypot(east, north - leg_m) < 4)
    aside_m = [
        -(east * math.cos(turn) - (north - leg_m) * math.sin(turn))
        for east, north in places[near:]
        if east * math.sin(turn) + (north - leg_m) * math.cos(turn) > 0
    ]
    return [max(north - leg_m for _, north in places), max(aside_m)]


@pytest.mark.parametrize("row", turns(), ids=lambda row: "-".join(list(row.values())[:5]))
def test_a_turn_back_swings_out_as_far(row: dict[str, str]) -> None:
    leg_m, onward_m, speed_mps = (float(row[name]) for name in ("leg_m", "onward_m", "speed_mps"))
    turn = math.radians(float(row["turn_deg"]))
    real = track_of(row).tolist()
    items = [
        replace(waypoint(at(leg_m, 0)), params=(float(row["delay_s"]), 0.0, 0.0, 0.0)),
        waypoint(at(leg_m + onward_m * math.cos(turn), onward_m * math.sin(turn))),
    ]
    places = driven(row, 0.0, items, (leg_m + onward_m) / speed_mps + 16.0)
    simulated = ahead_and_aside_m(row, [offset_m(place) for place in places])
    measured = ahead_and_aside_m(row, real)
    for one, other in zip(simulated, measured, strict=True):
        assert one > other - AT_STOPS_FOLLOWED_M
        if float(row["turn_deg"]) <= SHARPEST_FOLLOWED_DEG:
            assert one < other + AT_STOPS_FOLLOWED_M


def offset_m(place: LatLon) -> tuple[float, float]:
    """Return how far east and north of the start a place is."""
    north_m = math.copysign(
        distance_m(HOME, LatLon(place.lat_deg, HOME.lon_deg)), place.lat_deg - HOME.lat_deg
    )
    east_m = math.copysign(
        distance_m(HOME, LatLon(HOME.lat_deg, place.lon_deg)), place.lon_deg - HOME.lon_deg
    )
    return east_m, north_m


@pytest.mark.parametrize("row", rows_of("loiter_unlimited.csv"), ids=lambda row: "-".join(row.values()))
def test_a_steered_rover_stands_where_it_loiters(row: dict[str, str]) -> None:
    """The simulated one rocked out of its fence there until it had AR_PosControl's rule that what stops does not steer (since 4.5)."""
    aside_m = float(row["last_leg_m"]) if row["turn_deg"] == "90" else 0.0
    goal = at(30, aside_m) if aside_m else at(60, 0)
    items = [
        waypoint(at(30 if aside_m else 40, 0)),
        replace(waypoint(goal), command=Command.NAV_LOITER_UNLIM),
    ]
    places = driven(row, 0.0, items, 120.0)
    left_m = [distance_m(place, goal) for place in places]
    near = next(i for i, one in enumerate(left_m) if one < 1.0)
    assert max(left_m[near + int(5 / TICK_S) :]) == pytest.approx(float(row["farthest_m"]), abs=FOLLOWED_M)
    assert left_m[-1] == pytest.approx(float(row["end_m"]), abs=FOLLOWED_M)
