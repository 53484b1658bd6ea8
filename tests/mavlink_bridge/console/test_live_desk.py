"""Deeds of pages on a bridge in stepped time: what is written was seen, what is refused says why, HOLD is answered by what the vehicle did."""

from __future__ import annotations

from dataclasses import replace

import pytest
from console.serving import SteppedConsole
from director.px4.px4_runs import conductor as px4_conductor
from director.test_bridge_director import FAR, FENCE, HOME, NEAR, upload, wall_across_the_route

from mavlink_bridge.console import deeds
from mavlink_bridge.console.answers import Looked, field_of
from mavlink_bridge.console.deeds import Refusal
from mavlink_bridge.console.view.plans import is_same_route, plan_id, plan_view
from mavlink_bridge.director import EventName, State
from mavlink_bridge.errors import BackupError
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.replay.journal import request_from_text
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.geo import LatLon, destination
from missions.planning.plan import plan as make_plan
from missions.request import Tour

FAR_TOUR = Tour(targets=(FAR,), clearance_m=2.5)


def ready(folder, **orders) -> SteppedConsole:
    console = SteppedConsole(folder, orders)
    console.until(lambda: console.director.state is State.READY)
    return console


def looked_at(console, request=FAR_TOUR) -> Looked:
    situation = console.director.situation
    planned = make_plan(situation, request)
    field = field_of(situation)
    return Looked(plan_view(planned, situation, request), request, planned.items, planned, field)


def driving(console) -> SteppedConsole:
    console.do(deeds.UploadPlan("x", looked_at(console)))
    console.until(lambda: console.director.state is State.VERIFIED)
    console.do(deeds.Start(plan_id(console.director.plan)))
    console.until(lambda: console.director.state is State.DRIVING)
    return console


def test_a_plan_that_was_looked_at_is_made_again_uploaded_started_and_driven(tmp_path):
    console = ready(tmp_path)
    looked = looked_at(console)
    assert "planning again from where the rover is" in console.do(deeds.UploadPlan(looked.view.id, looked))
    console.until(lambda: console.director.state is State.VERIFIED)
    assert plan_id(console.director.plan) == looked.view.id
    console.wait(5.0)
    assert console.director.state is State.VERIFIED  # nothing drives before somebody starts it
    with pytest.raises(Refusal, match="not the one that you see"):
        console.do(deeds.Start("of yesterday"))
    console.do(deeds.Start(looked.view.id))
    console.until(console.run.happened(EventName.ARRIVED), 200)
    names = [name for name, *_ in console.calls]
    assert names == ["request", "confirm", "drive"]
    assert request_from_text(console.calls[0][2]) == FAR_TOUR
    assert ("page 1 starts the drive", "notice") in console.told


def test_a_plan_that_is_another_one_by_now_is_shown_and_not_uploaded(tmp_path):
    console = ready(tmp_path)
    looked = looked_at(console)
    upload(console.run, MissionType.FENCE, fence_to_items(wall_across_the_route()))
    console.until(console.run.happened(EventName.FENCE_CHANGED))
    console.do(deeds.UploadPlan(looked.view.id, looked))
    console.until(lambda: console.director.state is State.PROPOSED)
    console.wait(3.0)
    assert console.director.state is State.PROPOSED
    assert any("the plan has changed" in text for text, _ in console.told)
    console.do(deeds.UploadPlan(plan_id(console.director.plan)))  # seen now
    console.until(lambda: console.director.state is State.VERIFIED)


def test_routes_are_the_same_where_the_vehicle_only_seems_to_have_moved(tmp_path):
    console = ready(tmp_path)
    situation = console.director.situation
    one = make_plan(situation, FAR_TOUR)
    aside = make_plan(situation, replace(FAR_TOUR, start=destination(HOME, 0.05, 90.0)))
    other = make_plan(situation, replace(FAR_TOUR, targets=(NEAR,)))
    less = make_plan(situation, replace(FAR_TOUR, clearance_m=2.2))
    assert is_same_route(one, one)
    assert is_same_route(one, aside)
    assert not is_same_route(one, other)
    assert not is_same_route(one, less)


def test_hold_is_answered_by_what_the_vehicle_did_and_a_person_goes_on(tmp_path):
    console = driving(ready(tmp_path))
    console.wait(8.0)
    assert "being sent" in console.do(deeds.Hold(), "page 7")
    shown = []

    def view():
        found = console.desk.hold_shown.view(console.director, console.run.now_s)
        if not shown or shown[-1] != found.state:
            shown.append(found.state)
        return found

    assert view().by == "page 7"
    console.until(lambda: view().state == "stopped", 20)
    assert shown == ["sent", "answered", "stopped"]
    assert console.director.situation.mode == Mode.HOLD
    assert console.desk.can_resume
    console.do(deeds.Resume())
    console.until(console.run.happened(EventName.ARRIVED), 200)
    assert console.run.last(EventName.ARRIVED).data["breaches"] == 0


def gone_on(console) -> None:
    """HOLD in a drive, and "Go on" of page 1."""
    driving(console)
    console.wait(8.0)
    console.do(deeds.Hold())
    console.until(
        lambda: console.desk.hold_shown.view(console.director, console.run.now_s).state == "stopped", 20
    )
    console.do(deeds.Resume())


@pytest.mark.parametrize("state", [State.PLANNING, State.UPLOADING, State.STARTING])
def test_who_takes_control_ends_what_another_page_waits_for(tmp_path, state):
    console = ready(tmp_path)
    gone_on(console)
    console.until(lambda: console.director.state is state)
    console.do(deeds.TakeControl(), "page 1")  # its own: nothing changes
    assert not any("is cancelled" in text for text, _ in console.told)
    console.do(deeds.TakeControl(), "page 2")
    what = "start" if state is not State.PLANNING else "drive on"
    assert console.told[-1] == (
        f"page 2 has control now: the {what} that page 1 waited for is cancelled",
        "warning",
    )
    console.wait(70.0)
    assert console.director.state is (State.PROPOSED if state is State.PLANNING else State.VERIFIED)
    assert console.director.situation.mode == Mode.HOLD
    if state is State.PLANNING:
        console.do(deeds.UploadPlan(plan_id(console.director.plan)), "page 2")
        console.until(lambda: console.director.state is State.VERIFIED)
    console.do(deeds.Start(plan_id(console.director.plan)), "page 2")
    console.until(console.run.happened(EventName.ARRIVED), 200)


def test_a_deed_of_the_next_page_ends_what_the_last_one_waits_for_and_so_does_giving_up(tmp_path):
    """A page that left has lost control without anybody taking it: the first deed of another one tells."""
    console = ready(tmp_path)
    gone_on(console)
    console.do(deeds.ClearBlocked(), "page 2")
    assert "waited for is cancelled" in console.told[-1][0]
    console.wait(70.0)
    assert console.director.state is State.PROPOSED
    console.do(deeds.Resume(), "page 2")
    console.do(deeds.GiveControl(), "page 2")
    assert (
        "page 2 has given up control: the drive on that page 2 waited for is cancelled" in console.told[-1][0]
    )
    console.wait(70.0)
    assert console.director.state is State.PROPOSED


def test_a_drive_that_has_begun_and_an_upload_under_way_go_on_under_other_hands(tmp_path):
    console = driving(ready(tmp_path))
    console.do(deeds.TakeControl(), "page 2")
    assert not any("is cancelled" in text for text, _ in console.told)
    console.until(console.run.happened(EventName.ARRIVED), 200)
    console.do(deeds.UploadPlan("x", looked_at(console, replace(FAR_TOUR, targets=(NEAR,)))), "page 2")
    console.until(lambda: console.director.state is State.UPLOADING)
    console.do(deeds.TakeControl(), "page 1")
    console.until(lambda: console.director.state is State.VERIFIED)


def test_an_upload_that_is_still_planned_for_is_not_done_for_who_has_no_control(tmp_path):
    console = ready(tmp_path)
    console.do(deeds.UploadPlan("x", looked_at(console)))
    console.do(deeds.TakeControl(), "page 2")
    assert "the upload that page 1 waited for is cancelled" in console.told[-1][0]
    console.wait(20.0)
    assert console.director.state is State.PROPOSED
    assert not console.run.vehicles[0].mission[1:]


def test_a_px4_rover_is_started_once_its_fence_counts_held_and_driven_on(tmp_path):
    request = replace(FAR_TOUR, clearance_m=1.5)
    console = SteppedConsole(tmp_path, conductor=px4_conductor)
    console.until(lambda: console.director.state is State.READY)
    looked = looked_at(console, request)
    assert looked.view.items == len(looked.items)  # PX4 has no home item
    console.do(deeds.UploadPlan("x", looked))
    console.until(lambda: console.director.state is State.ENFORCED)
    drive = console.desk.hold_shown
    console.do(deeds.Start(plan_id(console.director.plan)))
    console.until(lambda: console.director.state is State.DRIVING)
    console.wait(8.0)
    console.do(deeds.Hold(), "page 7")
    console.until(lambda: drive.view(console.director, console.run.now_s).state == "stopped", 20)
    assert console.director.situation.mode == console.director.peer.autopilot.modes.hold
    console.do(deeds.Resume())
    console.until(console.run.happened(EventName.ARRIVED), 200)
    assert console.run.vehicles[0].rover.breaches == 0


def test_lists_of_a_page_are_written_as_px4_wants_them(tmp_path):
    """No home before a mission, circles after polygons."""
    console = SteppedConsole(tmp_path, conductor=px4_conductor)
    console.until(lambda: console.director.state is State.READY)
    looked = looked_at(console, replace(FAR_TOUR, clearance_m=1.5))
    console.do(deeds.UploadPlan("x", replace(looked, request=None)))
    console.until(lambda: not console.writer.is_busy)
    assert console.writer.view().state == "verified"
    vehicle = console.run.vehicles[0]
    assert [one.command for one in vehicle.mission] == [one.command for one in looked.items]
    circle = CircleZone(ZoneKind.EXCLUSION, LatLon(40.0715, -105.2290), 3.0)
    console.wait(3.0)
    console.do(deeds.UploadFence(Fence((circle, *FENCE.zones))))
    console.until(lambda: not console.writer.is_busy)
    assert console.writer.view().state == "verified"
    assert vehicle.fence[-1].command == fence_to_items(Fence((circle,)))[0].command


def test_hold_without_an_answer_says_so(tmp_path):
    console = driving(ready(tmp_path))
    console.run.is_cut = True
    console.do(deeds.Hold())
    console.wait(11.0)
    found = console.desk.hold_shown.view(console.director, console.run.now_s)
    assert found.state == "no_answer"
    assert "transmitter" in found.text


def test_hold_before_a_vehicle_was_heard_is_refused(tmp_path):
    console = SteppedConsole(tmp_path)
    with pytest.raises(Refusal, match="no vehicle was heard"):
        console.do(deeds.Hold())


def test_what_cannot_be_done_now_is_refused_and_says_why(tmp_path):
    console = ready(tmp_path)
    for deed, said in (
        (deeds.Start("x"), "nothing to start"),
        (deeds.Resume(), "no target to continue to"),
        (deeds.UploadPlan("unknown"), "no longer exists"),
        (deeds.TakeTargets(Tour()), "at least one target"),
        (deeds.Restore("../../etc/passwd"), "not the name of a backup"),
    ):
        with pytest.raises(Refusal, match=said):
            console.do(deed)
    console = driving(console)
    for deed in (deeds.UploadFence(FENCE), deeds.Resume()):
        with pytest.raises(Refusal, match="is busy"):
            console.do(deed)


def test_targets_of_a_page_are_planned_to_and_proposed(tmp_path):
    console = ready(tmp_path)
    console.do(deeds.TakeTargets(Tour(targets=(NEAR, FAR), clearance_m=2.5)))
    console.until(lambda: console.director.awaits_confirmation)
    assert console.director.plan.targets == (NEAR, FAR)
    console.wait(5.0)
    assert not console.run.vehicles[0].mission[1:]


def test_a_fence_is_written_verified_with_a_backup_and_put_back(tmp_path):
    console = ready(tmp_path)
    wider = Fence((*FENCE.zones, CircleZone(ZoneKind.EXCLUSION, LatLon(40.0715, -105.2290), 3.0)))
    console.do(deeds.UploadFence(wider))
    with pytest.raises(Refusal, match="under way"):
        console.do(deeds.UploadFence(FENCE))
    console.until(lambda: not console.writer.is_busy)
    assert console.writer.view().state == "verified"
    console.until(console.run.happened(EventName.FENCE_CHANGED))  # the director has read it
    assert len(console.director.situation.fence.value.zones) == len(wider.zones)
    assert console.calls[-1][0] == "suspect"
    (backup,) = [one for one in console.desk.backups() if one.what == "fence"]
    assert backup.is_this_vehicle
    assert backup.items == len(fence_to_items(FENCE))
    console.do(deeds.Restore(backup.name))
    console.until(lambda: len(console.director.situation.fence.value.zones) == len(FENCE.zones))


def test_a_backup_of_another_vehicle_is_not_put_back(tmp_path):
    console = ready(tmp_path)
    other = replace(console.vehicle(), uid="9999")
    path = console.store.keep(other, MissionType.FENCE, fence_to_items(FENCE))
    with pytest.raises(Refusal, match="may not be this vehicle"):
        console.do(deeds.Restore(path.name))


def test_a_fence_whose_backup_cannot_be_kept_is_not_written(tmp_path, monkeypatch):
    console = ready(tmp_path)
    before = console.run.vehicles[0].fence

    def full(*_):
        raise BackupError("the disk is full")

    monkeypatch.setattr(console.store, "begin", full)
    console.do(deeds.UploadFence(wall_across_the_route()))
    console.until(lambda: not console.writer.is_busy)
    assert console.writer.view().state == "failed"
    assert "disk is full" in console.writer.view().text
    assert console.run.vehicles[0].fence == before


def test_an_upload_is_left_with_its_link(tmp_path):
    console = ready(tmp_path)
    console.do(deeds.UploadFence(wall_across_the_route()))
    console.desk.link_closed()
    assert not console.writer.is_busy
    assert console.writer.view().state == "failed"
    console.wait(5.0)
    assert len(console.director.situation.fence.value.zones) == len(FENCE.zones)


def test_a_checked_mission_is_written_only_where_it_keeps_its_clearance(tmp_path):
    console = ready(tmp_path)
    looked = looked_at(console)
    broken = replace(looked, request=None, view=replace(looked.view, is_promised=False))
    with pytest.raises(Refusal, match="does not keep its clearance"):
        console.do(deeds.UploadPlan("x", broken))
    with pytest.raises(Refusal, match="another fence"):  # one that was only drawn, or that of a while ago
        console.do(deeds.UploadPlan("x", replace(looked, request=None, field=None)))
    console.do(deeds.UploadPlan("x", replace(looked, request=None)))
    console.until(lambda: not console.writer.is_busy)
    held = console.run.vehicles[0].mission[1:]
    assert [item.position for item in held] == [item.position for item in looked.items]


def test_an_obstacle_that_a_page_reports_is_planned_round(tmp_path):
    from mavlink_bridge.director.orders import ObstacleSource

    console = ready(tmp_path, obstacle_sources=frozenset({ObstacleSource.KEYBOARD}))
    console.do(deeds.Blocked(LatLon(40.0715, -105.2290), 1.5))
    assert len(console.director.situation.obstacles.known) == 1
    console.do(deeds.ClearBlocked())
    assert not console.director.situation.obstacles.known
    assert [name for name, *_ in console.calls] == ["obstacle", "clear"]


def test_a_hold_while_the_link_is_closed_is_never_said_to_be_on_its_way(tmp_path):
    console = driving(ready(tmp_path))
    console.desk.link_closed()
    assert "link is closed" in console.do(deeds.Hold())
    found = console.desk.hold_shown.view(console.director, console.run.now_s)
    assert (found.state, "transmitter" in found.text) == ("no_answer", True)
    console.desk.link_opened()
    console.until(
        lambda: console.desk.hold_shown.view(console.director, console.run.now_s).state == "stopped", 30
    )


def test_a_mission_checked_before_the_fence_changed_is_not_written(tmp_path):
    console = ready(tmp_path)
    looked = replace(looked_at(console), request=None)
    upload(console.run, MissionType.FENCE, fence_to_items(wall_across_the_route()))
    console.until(console.run.happened(EventName.FENCE_CHANGED))
    with pytest.raises(Refusal, match="another fence"):
        console.do(deeds.UploadPlan("x", looked))
    assert not console.run.vehicles[0].mission[1:]


def test_nobody_goes_on_to_a_target_that_was_never_driven_to(tmp_path):
    console = ready(tmp_path)
    console.do(deeds.TakeTargets(FAR_TOUR))
    console.until(lambda: console.director.awaits_confirmation)
    assert not console.desk.can_resume
    with pytest.raises(Refusal, match="no target to continue to"):
        console.do(deeds.Resume())
    console.wait(5.0)
    assert not console.run.vehicles[0].is_armed


def test_going_on_is_given_up_where_another_target_was_asked_for_meanwhile(tmp_path):
    console = driving(ready(tmp_path))
    console.wait(5.0)
    console.do(deeds.Hold())
    console.until(lambda: console.desk.can_resume, 20)
    console.do(deeds.TakeTargets(Tour(targets=(NEAR,), clearance_m=2.5)))
    console.until(lambda: console.director.awaits_confirmation)
    with pytest.raises(Refusal, match="another target"):
        console.do(deeds.Resume())
    assert not console.desk.can_resume


def test_going_on_does_not_drive_long_after_it_was_asked_for(tmp_path):
    console = driving(ready(tmp_path))
    console.wait(5.0)
    console.do(deeds.Hold())
    console.until(lambda: console.desk.can_resume, 20)
    console.do(deeds.Resume())
    console.desk.handle_timer(console.run.now_s + 61.0)
    console.wait(10.0)
    assert console.director.state is State.PROPOSED
    assert any("took too long" in text for text, _ in console.told)


def test_hold_is_not_said_to_stand_once_somebody_drives_on(tmp_path):
    console = driving(ready(tmp_path))
    console.wait(5.0)
    console.do(deeds.Hold())

    def view():
        return console.desk.hold_shown.view(console.director, console.run.now_s)

    console.until(lambda: view().state == "stopped", 20)
    console.run.vehicles[0].rover.mode = Mode.MANUAL  # by the transmitter
    console.until(lambda: view().state == "none", 10)
    assert "left HOLD" in view().text
