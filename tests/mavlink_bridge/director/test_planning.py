"""What happens while a plan is in the making: it takes seconds on a small computer, and the messages go on."""

from __future__ import annotations

import math
import threading
import time

import pytest
from director.test_bridge_director import (
    FAR,
    FENCE,
    HOME,
    IN_BARN,
    NEAR,
    arm,
    conductor,
    driving,
    ready,
    upload,
    wall_across_the_route,
)
from director.test_takeover import modes_sent, unheard, wait

from mavlink_bridge.cli.live import PlanMaker
from mavlink_bridge.director import EventName, State, route_desk
from mavlink_bridge.director.plan_task import PlanTask
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import Frame
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from missions.errors import PlanCheckError, PlanStoppedError
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.geo import LatLon, distance_m
from missions.items import Command
from missions.planning.plan import plan
from missions.request import End, GoTo, RepairMission, Tour

MANUAL = 0
LONG_S = 5.0


def planning(planning_s: float = LONG_S):
    """Return a bridge in the middle of a plan that takes long."""
    run = conductor()
    run.planning_s = planning_s
    ready(run)
    arm(run)
    run.run_until(lambda: run.director.situation.armed)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.pending_plan is not None, 20)
    wait(run, 1.0)
    return run


def test_a_plan_that_takes_long_is_waited_for_and_the_messages_go_on():
    run = planning()
    asked_s = run.now_s
    task = run.director.pending_plan
    heard_s = run.director.heard_s
    wait(run, 2.5)
    assert run.director.pending_plan is task
    assert run.director.heard_s > heard_s
    planned_s = run.run_until(run.happened(EventName.PLANNED), 20)
    assert planned_s - asked_s == pytest.approx(LONG_S - 1.0, abs=0.1)
    run.run_until(lambda: run.director.state is State.DRIVING, 20)


def test_a_takeover_while_it_plans_leaves_the_plan():
    run = planning()
    unheard(run, m.SetMode(1, 1, MANUAL))
    run.run_until(lambda: run.director.state is State.LET_GO, 3)
    assert run.director.pending_plan is None
    before = len(run.sent)
    wait(run, 2 * LONG_S)
    assert run.director.state is State.LET_GO
    assert not run.happened(EventName.PLANNED)()
    assert modes_sent(run, before) == []


def test_another_target_while_it_plans_is_the_one_that_is_driven_to():
    run = planning()
    obsolete = run.director.pending_plan
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.pending_plan is not None, 10)
    assert run.director.pending_plan is not obsolete
    run.director.plan_made(obsolete, obsolete.made(), run.now_s)
    assert not run.happened(EventName.PLANNED)()
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert distance_m(run.vehicles[0].position, NEAR) < 4.0


def test_a_fence_that_changes_while_it_plans_is_planned_around():
    run = planning()
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    changed = len(run.events)
    run.run_until(run.happened(EventName.PLANNED, changed), 3 * LONG_S)
    names = [event.name for event in run.events[changed:]]
    assert names.index(EventName.FENCE_CHANGED) < names.index(EventName.PLANNED)
    assert run.director.plan.fence == wall_across_the_route()
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert run.vehicles[0].breaches == 0


def test_silence_while_it_plans():
    run = planning(100.0)
    run.is_cut = True
    run.run_until(lambda: run.director.state is State.LOST, 10)
    assert run.director.pending_plan is None


def test_no_plan_is_told_as_ever():
    run = ready(conductor(drive=False))
    run.director.take_target(IN_BARN, run.now_s)
    run.run_until(run.happened(EventName.NO_PLAN), 10)
    assert run.director.state is State.READY


def test_what_changed_is_read_while_the_vehicle_comes_to_rest():
    """Before, it was read when it stood: two round trips in which nothing else happened."""
    run = driving(conductor())
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > 12)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.HOLDING)
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    run.run_until(lambda: run.director.situation.fence.value == wall_across_the_route(), 3)
    assert run.director.state is State.HOLDING


def test_a_mission_longer_than_the_vehicle_holds_is_shortened_or_refused(monkeypatch):
    posts = (
        CircleZone(
            ZoneKind.EXCLUSION, LatLon(40.0714 + 0.00012 * i + 0.00005 * j, -105.2297 + 0.00025 * j), 3.0
        )
        for i in range(6)
        for j in range(5)
    )
    parameters = {"FENCE_ENABLE": 1.0, "WP_SPEED": 5.0, "WP_RADIUS": 3.0}
    config = SimulatorConfig(
        home=HOME, fence=fence_to_items(Fence((*FENCE.zones, *posts))), parameters=parameters
    )

    def verified_or_refused(most: int):
        monkeypatch.setattr("missions.planning.plan.most_own_items", lambda _situation: most - 1)
        vehicle = SimulatedVehicle(config)
        run = ready(conductor(vehicle=vehicle, drive=False, request=GoTo(clearance_m=1.5)))
        run.director.take_target(FAR, run.now_s)
        ends = (run.happened(EventName.VERIFIED), run.happened(EventName.NO_PLAN))
        run.run_until(lambda: any(end() for end in ends), 20)
        return run

    whole = verified_or_refused(655).director.plan
    most = len(whole.items)  # one less, with home
    run = verified_or_refused(most)
    assert len(run.vehicles[0].mission) <= most
    assert any(f"left out to fit the vehicle's limit of {most}" in text for text in run.director.plan.info)
    assert run.director.plan.targets == whole.targets
    assert run.director.plan.driven_clearance_m >= 1.5 - 0.01
    run = verified_or_refused(2)
    assert run.last(EventName.NO_PLAN).data["error"] == "MissionTooLongError"
    assert not run.happened(EventName.UPLOADING)()


def test_home_again_and_an_end_are_asked_of_the_bridge_too():
    asked = Tour(clearance_m=2.5, comes_back=True, end=End.LOITER, trusts_model=True)
    run = ready(conductor(drive=False, request=asked))
    home = run.director.situation.home.value
    run.director.take_target(FAR, run.now_s)
    run.run_until(run.happened(EventName.VERIFIED), 20)
    assert [distance_m(*pair) < 0.1 for pair in zip(run.director.plan.targets, (FAR, home), strict=True)] == [
        True,
        True,
    ]
    assert run.vehicles[0].mission[-1].command == Command.NAV_LOITER_UNLIM


def test_a_target_that_is_heard_leaves_a_repair_what_it_is():
    run = ready(conductor(drive=False, request=RepairMission(clearance_m=2.5)))
    run.director.take_target(FAR, run.now_s)
    run.run_until(run.happened(EventName.NO_PLAN), 10)
    assert "no mission to repair" in run.last(EventName.NO_PLAN).text


class Waiting:
    """Stands for a director that waits for a plan."""

    def __init__(self, task: PlanTask | None) -> None:
        self.pending_plan = task


def test_the_shell_makes_plans_beside_the_link():
    may_end = threading.Event()

    def slow(situation, request, **_options):
        may_end.wait(30)
        return plan(situation, request)

    run = ready(conductor())
    run.director.take_target(FAR, run.now_s)
    task = PlanTask(run.director.situation, run.director._parts.desk.request())
    waiting = Waiting(task)
    plans = PlanMaker(waiting, slow)
    idle_s = plans.longest_wait_s()
    assert plans.take() is None
    assert plans.take() is None  # in the making
    assert plans.longest_wait_s() < idle_s
    may_end.set()
    made = taken(plans)
    assert made[0] is task
    assert made[1].targets[-1] == FAR
    waiting.pending_plan = None
    assert plans.take() is None
    assert plans.longest_wait_s() == idle_s


def test_a_plan_that_nobody_waits_for_any_more_is_left():
    made_for = []

    def note(_situation, request, **_options):
        made_for.append(request)
        return request

    first, second = PlanTask(None, "first"), PlanTask(None, "second")
    waiting = Waiting(first)
    plans = PlanMaker(waiting, note)
    plans.take()
    waiting.pending_plan = second
    assert taken(plans) == (second, "second")
    assert made_for == ["first", "second"]


def take_over(run):
    unheard(run, m.SetMode(1, 1, MANUAL))


def change_the_fence(run):
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))


def go_elsewhere(run):
    run.director.take_target(NEAR, run.now_s)


def fall_silent(run):
    run.is_cut = True


def speak_with_our_ids(run):
    for _ in range(2):
        run.director.receive(Frame(*run.director.identity, m.Statustext(6, "another program")), run.now_s)


@pytest.mark.parametrize(
    "happens", [take_over, change_the_fence, go_elsewhere, fall_silent, speak_with_our_ids]
)
def test_a_plan_is_dropped_as_soon_as_nobody_waits_for_it(happens):
    run = planning(1000.0)
    task = run.director.pending_plan
    wait(run, 3.0)
    assert not task.is_dropped
    happens(run)
    run.run_until(lambda: run.director.pending_plan is not task, 10)
    assert task.is_dropped
    assert isinstance(task.made(), PlanStoppedError)  # and at once, for the search is left at its first look


def test_an_outdated_plan_stops_and_the_next_begins_at_once():
    """On the shell's own thread: what nobody waits for takes no time from what somebody does."""
    begun = []

    def again_and_again(situation, request, *, should_stop):
        begun.append((request.targets, time.monotonic()))
        until_s = time.monotonic() + (60 if request.targets == (FAR,) else 0)
        while True:
            planned = plan(situation, request, should_stop=should_stop)
            if time.monotonic() >= until_s:
                return planned

    run = planning(math.inf)
    plans = PlanMaker(run.director, again_and_again)
    assert plans.take() is None
    time.sleep(0.5)
    assert plans.take() is None  # it takes a minute
    run.director.take_target(NEAR, run.now_s)
    changed_s = time.monotonic()
    run.run_until(lambda: run.director.pending_plan is not None, 10)
    _, made = taken(plans)
    assert made.targets == (NEAR,)
    assert [targets for targets, _ in begun] == [(FAR,), (NEAR,)]
    assert begun[1][1] - changed_s < 5.0


def test_what_nobody_expected_of_a_planner_is_a_reason_for_no_plan():
    _, made = taken(PlanMaker(Waiting(PlanTask(None, None)), breaking_down))
    assert isinstance(made, PlanCheckError)
    assert isinstance(made.__cause__, ZeroDivisionError)


def taken(plans: PlanMaker):
    until_s = time.monotonic() + 60
    while time.monotonic() < until_s:
        if (made := plans.take()) is not None:
            return made
        time.sleep(0.001)
    raise AssertionError("no plan")


def breaking_down(*_arguments, **_options):
    raise ZeroDivisionError("float division by zero")


def test_a_defect_while_planning_is_told_and_the_bridge_lives_on():
    run = conductor()
    run.planner = breaking_down
    ready(run)
    arm(run)
    run.run_until(lambda: run.director.situation.armed)
    run.director.take_target(FAR, run.now_s)
    run.run_until(run.happened(EventName.NO_PLAN), 20)
    event = run.last(EventName.NO_PLAN)
    assert "planning failed: ZeroDivisionError: float division by zero" in event.text
    wait(run, 2.0)
    assert not run.director.is_done
    run.planner = plan
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 30)


def test_a_defect_while_a_drive_is_checked_holds_the_vehicle(monkeypatch):
    run = driving(conductor())
    monkeypatch.setattr(route_desk, "recheck", breaking_down)
    changed = len(run.events)
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    run.run_until(run.happened(EventName.HOLDING, changed), 20)
    assert "a bug in pbpp" in run.last(EventName.ROUTE_BROKEN).text
    assert not run.director.is_done


def test_a_target_across_a_seam_of_a_union_is_refused_with_what_would_do():
    north = CircleZone(ZoneKind.INCLUSION, HOME, 40.0)
    south = CircleZone(ZoneKind.INCLUSION, LatLon(HOME.lat_deg - 60 / 1.113e5, HOME.lon_deg), 40.0)
    parameters = {"FENCE_ENABLE": 1.0, "FENCE_OPTIONS": 2.0, "WP_SPEED": 3.0}
    config = SimulatorConfig(home=HOME, fence=fence_to_items(Fence((north, south))), parameters=parameters)
    run = ready(conductor(vehicle=SimulatedVehicle(config)))
    run.director.take_target(south.centre, run.now_s)
    run.run_until(run.happened(EventName.NO_PLAN), 20)
    told = run.last(EventName.NO_PLAN)
    assert "the inner edge of inclusion circle" in told.text
    assert "`pbpp fence merge FILE -o merged.plan`" in told.data["details"]["advice"]
    assert not run.happened(EventName.UPLOADING)()
