"""A mission with its ways home inside, uploaded and driven, and one of them chosen on the way: by `plan --connect`, and beside a bridge."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from director.adopting import HOME, TARGETS, UID, YARD
from director.conducting import Conductor
from director.test_bridge_director import upload
from shapely import LineString, Point

from mavlink_bridge.backup.drive_note import note_from_json, note_to_json
from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from missions.checking.home_part import HomePart, home_parts
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.geo import LatLon, LocalPoint, distance_m
from missions.items import Command
from missions.planning.plan import plan
from missions.request import Tour

if TYPE_CHECKING:
    from missions.planned import Plan
    from missions.situation import Situation

PLANNED: list[Plan] = []
INSIDE = Tour(targets=TARGETS[:2], clearance_m=1.6, way_home_inside=True)


def driving(*, once: bool = False) -> Conductor:
    parameters = {"FENCE_ENABLE": 1.0, "WP_SPEED": 4.0}
    vehicle = SimulatedVehicle(
        SimulatorConfig(home=HOME, fence=fence_to_items(YARD), parameters=parameters, uid=UID)
    )
    if once:
        vehicle.rover.arm()
    orders = Orders(request=INSIDE, upload=True, drive=True, arm=not once, once=once)
    run = Conductor(Director(orders), [vehicle], planner=planned_once)
    run.run_until(lambda: run.director.state is State.DRIVING, 60)
    return run


def planned_once(situation: Situation, request: Tour, **more: object) -> Plan:
    """Plan the route of these tests, which all begin at home, only once."""
    if request.targets != INSIDE.targets:
        return plan(situation, request, **more)
    if not PLANNED:
        PLANNED.append(plan(situation, request))
    return PLANNED[0]


def ways(run: Conductor) -> dict[int, HomePart]:
    return {part.leg_item: part for part in home_parts(run.director.plan.items)}


def item(run: Conductor) -> int:
    return run.vehicles[0].rover.mission_run.seq


def choose(run: Conductor) -> HomePart:
    """Let the operator choose the way home of the leg that is driven, as soon as there is one."""
    until_s = run.now_s + 6.0
    run.run_until(lambda: item(run) in ways(run) and run.now_s >= until_s, 120)
    part = ways(run)[item(run)]
    run.ground_station(m.CommandLong(1, 1, Command.DO_SET_MISSION_CURRENT, param1=float(part.item)))
    return part


def track_of(run: Conductor) -> list[LatLon]:
    track: list[LatLon] = []

    def note(run: Conductor) -> None:
        track.append(run.vehicles[0].position)

    run.meddle = note
    return track


def clearance_m(track: list[LatLon], run: Conductor) -> float:
    """By shapely, on the ground of the plan."""
    ground = run.director.plan.ground
    return ground.enforced.edge.distance(LineString([ground.frame.to_local(place) for place in track]))


def test_not_chosen_it_is_driven_to_its_end_and_its_ways_are_not_entered():
    run = driving(once=True)
    track = track_of(run)
    assert run.run() is State.DONE
    assert run.happened(EventName.ARRIVED)()
    assert not run.happened(EventName.GOING_HOME)()
    assert distance_m(run.vehicles[0].position, TARGETS[1]) < 2.5
    assert clearance_m(track, run) >= run.director.plan.clearance_m - 0.05


@pytest.mark.parametrize("once", [True, False])
def test_a_way_that_is_chosen_is_watched_to_its_place(once):
    run = driving(once=once)
    track = track_of(run)
    part = choose(run)
    run.run_until(run.happened(EventName.GOING_HOME), 3)
    told = run.last(EventName.GOING_HOME)
    assert (told.data["call"], told.data["place"]) == ("chosen in the mission", f"item {part.item}")
    assert run.director.plan.targets[-1] == part.place
    begun_m = run.director.drive.distance_left_m
    assert begun_m == pytest.approx(told.data["length_m"], abs=5)
    run.run_until(run.happened(EventName.ARRIVED), 200)
    assert distance_m(run.vehicles[0].position, part.place) < 2.5
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 3)
    assert run.vehicles[0].breaches == 0
    assert clearance_m(track, run) >= 1.6 - 0.05
    run.run_until(lambda: run.director.state is (State.DONE if once else State.ARRIVED), 3)
    assert run.last(EventName.ARRIVED).data["driven_m"] > begun_m  # all of the drive


def test_gone_back_to_the_route_it_is_watched_as_before():
    run = driving()
    planned, at = run.director.plan, item(run)
    choose(run)
    run.run_until(run.happened(EventName.GOING_HOME), 3)
    at = max(at, 2)
    run.ground_station(m.CommandLong(1, 1, Command.DO_SET_MISSION_CURRENT, param1=float(at)))
    run.run_until(lambda: run.director.plan is planned, 3)
    assert run.director.drive.item == at


def block(run: Conductor, place: LatLon) -> None:
    """Let a ground station put a circle there."""
    circle = CircleZone(ZoneKind.EXCLUSION, place, 1.0)
    upload(run, m.MissionType.FENCE, fence_to_items(Fence((*YARD.zones, circle))))


def test_a_fence_across_the_way_that_was_chosen_is_held_for_and_planned_round_to_its_place():
    run = driving()
    part = choose(run)
    run.run_until(run.happened(EventName.GOING_HOME), 3)
    way = run.director.plan
    line = LineString(way.points)
    ahead = way.ground.frame.to_lat_lon(LocalPoint(*line.interpolate(30.0).coords[0]))
    block(run, ahead)
    run.run_until(run.happened(EventName.ROUTE_BROKEN), 20)
    run.run_until(run.happened(EventName.ARRIVED), 300)
    assert distance_m(run.vehicles[0].position, part.place) < 2.5
    assert run.vehicles[0].breaches == 0


def test_a_fence_across_what_is_not_driven_any_more_stops_nothing():
    run = driving()
    planned = run.director.plan
    choose(run)
    run.run_until(run.happened(EventName.GOING_HOME), 3)
    way = LineString(run.director.plan.points)
    frame = run.director.plan.ground.frame
    far = max(planned.path[1:], key=lambda place: way.distance(Point(frame.to_local(place))))
    assert way.distance(Point(frame.to_local(far))) > 5
    block(run, far)
    run.run_until(run.happened(EventName.FENCE_CHANGED), 20)
    run.run_until(run.happened(EventName.ARRIVED), 200)
    assert not run.happened(EventName.ROUTE_BROKEN)()


def test_a_bridge_begun_anew_adopts_the_way_that_was_chosen():
    run = driving()
    part = choose(run)
    run.run_until(run.happened(EventName.GOING_HOME), 3)
    note = note_from_json(json.loads(json.dumps(note_to_json(run.note))))
    orders = Orders(upload=True, drive=True, arm=True)
    again = Conductor(Director(orders, notes=(note,)), run.vehicles)
    again.now_s = run.now_s
    again.run_until(again.happened(EventName.ADOPTED), 30)
    again.run_until(again.happened(EventName.GOING_HOME), 3)
    assert again.director.plan.targets[-1] == part.place
    again.run_until(again.happened(EventName.ARRIVED), 200)
    assert distance_m(run.vehicles[0].position, part.place) < 2.5
