"""Finding the vehicle that is meant."""

from __future__ import annotations

from protocol.scripted import Script

from mavlink_bridge.errors import IdentityTakenError
from mavlink_bridge.mavlink.messages import Frame, Heartbeat, MissionCount
from mavlink_bridge.protocol.find import FindVehicle
from mavlink_bridge.protocol.transitions import FindState

ROVER, COPTER = Heartbeat(10, 3), Heartbeat(2, 3)
STATION, COMPANION = Heartbeat(6, 8), Heartbeat(18, 8)


def test_the_only_vehicle_is_taken_after_listening_for_others():
    script = Script(FindVehicle())
    script.hear(ROVER, system=3)
    assert not script.machine.is_done
    script.pass_time(1.3)
    assert (script.machine.vehicle.system, script.machine.heartbeat) == (3, ROVER)
    assert script.machine.outcome is script.machine.vehicle
    assert script.machine.progress == (1, 1)
    assert script.machine.deadline_s is None


def test_a_named_vehicle_is_taken_at_once():
    script = Script(FindVehicle(7))
    script.hear(ROVER, system=3)
    script.pass_time(5.0)
    assert script.machine.state is FindState.COMPARING
    script.hear(ROVER, system=7)
    assert script.machine.vehicle.system == 7


def test_two_vehicles_want_a_choice():
    script = Script(FindVehicle())
    script.hear(ROVER, system=1)
    script.hear(ROVER, system=2)
    script.pass_time(1.3)
    assert "--system" in str(script.machine.trouble)
    assert script.machine.state is FindState.NOT_FOUND


def test_ground_stations_and_companions_are_no_vehicles():
    script = Script(FindVehicle(patience_s=5.0))
    script.hear(STATION, COMPANION, MissionCount(0, 0, 1))
    script.pass_time(5.1)
    assert script.machine.outcome is script.machine.trouble
    assert (
        str(script.machine.trouble)
        == "no vehicle's HEARTBEAT was heard within 5 s, heard only system 1 component 1"
    )
    assert "forward" in script.machine.trouble.details["advice"]


def test_a_dead_line_is_told_from_one_without_a_vehicle():
    script = Script(FindVehicle(patience_s=5.0))
    script.pass_time(5.1)
    assert str(script.machine.trouble) == "no vehicle's HEARTBEAT was heard within 5 s, nor any other message"
    assert script.machine.trouble.details["heard"] == []
    assert "--system" not in script.machine.trouble.details["advice"]


def test_a_copter_is_taken_only_when_asked_for():
    for any_vehicle in (False, True):
        script = Script(FindVehicle(1, any_vehicle=any_vehicle))
        script.hear(COPTER)
        assert (script.machine.vehicle is not None) is any_vehicle
        assert (script.machine.trouble is None) is any_vehicle


def test_a_named_vehicle_that_never_comes():
    script = Script(FindVehicle(9, patience_s=3.0))
    script.hear(ROVER)
    script.pass_time(script.machine.bound_s)
    assert "system 9 was not heard" in str(script.machine.trouble)


def test_an_unstarted_or_finished_machine_ignores_everything():
    machine = FindVehicle()
    machine.handle_timer(100.0)
    assert machine.deadline_s is None
    assert machine.outcome is None
    script = Script(FindVehicle(1))
    script.hear(ROVER)
    script.machine.receive(Frame(1, 1, COPTER), 9.0)
    assert script.machine.vehicle.type == 10


def test_whoever_has_our_ids_is_refused_at_once():
    script = Script(FindVehicle(identity=(245, 190)))
    script.hear(ROVER)
    script.hear(MissionCount(1, 1, 3), system=245, component=190)
    assert script.machine.state is FindState.NOT_FOUND
    assert isinstance(script.machine.trouble, IdentityTakenError)
    assert str(script.machine.trouble) == (
        "another program on the link already uses system 245 component 190, perhaps another pbpp command; choose other ids with --source-component (or --source-system)"
    )
    assert script.machine.vehicle is None


def test_the_vehicle_itself_may_have_our_ids():
    script = Script(FindVehicle(1, identity=(1, 1)))
    script.hear(ROVER)
    assert isinstance(script.machine.trouble, IdentityTakenError)


def test_ids_that_follow_from_the_vehicle_are_looked_at_once_it_is_chosen():
    script = Script(FindVehicle(own_component=195))
    script.hear(COMPANION, component=195)
    assert not script.machine.is_done
    script.hear(ROVER)
    script.pass_time(1.3)
    assert isinstance(script.machine.trouble, IdentityTakenError)
    assert "system 1 component 195" in str(script.machine.trouble)


def test_who_had_our_ids_and_is_gone_is_no_trouble():
    script = Script(FindVehicle(1, own_component=195))
    script.hear(COMPANION, component=195)
    script.hear(ROVER, after_s=5.1)
    assert script.machine.vehicle.system == 1
