"""Breaches and failsafes as the bridge tells them, and who took the vehicle: never a claim that is not certain, in whatever order it is heard."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from director.test_bridge_director import FENCE, HOME, IN_BARN, conductor, driving, ready, upload
from director.test_takeover import unheard, wait

from mavlink_bridge.director import EventName, State
from mavlink_bridge.director.operator_watch import OperatorWatch
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode, mode_name, mode_of
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.geo import to_e7
from missions.items import Command

if TYPE_CHECKING:
    from director.conducting import Conductor

MANUAL, LOITER = 0, 5
BREACHED = m.FenceStatus(1, 1, 3, 5000)


def text(words: str) -> m.Statustext:
    return m.Statustext(4, words)


def on_its_way(**parameters: float) -> Conductor:
    config = SimulatorConfig(
        home=HOME,
        fence=fence_to_items(FENCE),
        parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 3.0, **parameters},
    )
    run = driving(conductor(vehicle=SimulatedVehicle(config)))
    wait(run, 3)
    return run


def told(run: Conductor, *messages: m.Message) -> None:
    """Let the vehicle say something that it does not say by itself here."""
    for message in messages:
        run.director.receive(m.Frame(1, 1, message), run.now_s)
    run.events += run.director.take_events()


def taken_over(run: Conductor) -> dict:
    run.run_until(run.happened(EventName.TAKEN_OVER), 3)
    event = run.last(EventName.TAKEN_OVER)
    assert run.director.state is State.LET_GO
    return {"text": event.text, **event.data}


def test_a_breach_of_ours_is_told_with_place_and_fence_and_who_switched():
    run = on_its_way(AVOID_ENABLE=0.0)
    ahead = run.vehicles[0].rover.frame.to_lat_lon(
        run.vehicles[0].rover.body.position_m + 9 * run.vehicles[0].rover.body.velocity_mps / 3
    )
    upload(
        run,
        m.MissionType.FENCE,
        fence_to_items(Fence((*FENCE.zones, CircleZone(ZoneKind.EXCLUSION, ahead, 4.0)))),
    )
    run.run_until(run.happened(EventName.BREACH), 20)
    breach = run.last(EventName.BREACH)
    assert breach.data["breaches"] == 1
    assert breach.data["breach_type"] == "boundary"
    assert breach.data["fence"] == "exclusion circle 2"
    assert abs(breach.data["beyond_m"]) < 1.5
    assert breach.data["position"] == pytest.approx(list(run.vehicles[0].position), abs=3e-5)
    assert breach.data["fence"] in breach.text
    told_over = taken_over(run)
    assert (told_over["mode"], told_over["by"], told_over["reason"]) == ("RTL", "autopilot", "fence breach")
    assert told_over["text"] == (
        "the autopilot switched the vehicle to RTL itself: fence breach; waiting for a new target"
    )
    wait(run, 20)
    assert run.vehicles[0].mode == Mode.RTL


@pytest.mark.parametrize(
    ("heard", "mode", "reason"),
    [
        (BREACHED, Mode.RTL, "fence breach"),
        (BREACHED, Mode.HOLD, "fence breach"),
        (text("Polygon fence breached"), Mode.RTL, "fence breach"),
        (text("Radio Failsafe"), Mode.RTL, "radio failsafe"),
        (text("throttle Failsafe"), Mode.HOLD, "radio failsafe"),
        (text("GCS Failsafe"), Mode.HOLD, "ground station failsafe"),
        (text("EKF variance"), Mode.HOLD, "EKF failsafe"),
        (text("EKF failsafe"), Mode.HOLD, "EKF failsafe"),
        (text("Battery 1 is critical 10.20V used 4100 mAh"), Mode.RTL, "battery failsafe"),
        (text("Crash: Going to HOLD"), Mode.HOLD, "crash check"),
    ],
)
def test_a_mode_that_the_autopilot_chose_itself_is_told_so(heard, mode, reason):
    run = on_its_way(FS_ACTION=1.0)  # RTL, or HOLD where that cannot be had
    told(run, heard)
    unheard(run, m.SetMode(1, 1, mode))
    found = taken_over(run)
    assert (found["by"], found["reason"], found["mode"]) == ("autopilot", reason, mode_name(mode))


@pytest.mark.parametrize(
    ("heard", "mode", "event"),
    [
        (BREACHED, Mode.RTL, EventName.BREACH),
        (text("EKF failsafe"), Mode.HOLD, EventName.FAILSAFE),
        (text("GCS Failsafe"), Mode.RTL, EventName.FAILSAFE),
    ],
)
def test_where_the_mode_is_seen_first_nothing_is_claimed_until_the_cause_is_heard(heard, mode, event):
    run = on_its_way(FS_ACTION=1.0)  # RTL, or HOLD where that cannot be had
    unheard(run, m.SetMode(1, 1, mode))
    found = taken_over(run)
    assert (found["by"], found["reason"]) == ("unknown", None)
    assert (
        f"the vehicle went to {mode_name(mode)} by itself or by somebody not heard on this link, such as an RC transmitter"
        in found["text"]
    )
    told(run, heard)
    assert run.last(event).data["mode"] == mode_name(mode)
    assert f"the autopilot switched to {mode_name(mode)}" in run.last(event).text


@pytest.mark.parametrize(
    ("parameters", "heard", "mode"),
    [
        ({}, [], Mode.RTL),
        ({}, [BREACHED], MANUAL),
        ({"FENCE_ACTION": 0.0}, [BREACHED], Mode.RTL),
        ({"FENCE_ACTION": 2.0}, [BREACHED], Mode.RTL),
        ({}, [text("EKF failsafe")], Mode.RTL),
        ({}, [text("EKF failsafe cleared")], Mode.HOLD),
        ({}, [text("GCS Failsafe Cleared")], Mode.RTL),
        ({}, [text("GCS Failsafe"), text("Failsafe - Continuing Auto Mode")], Mode.RTL),
        ({}, [m.ParamValue("FS_ACTION", 0.0, 9, 1, 0), text("GCS Failsafe")], Mode.RTL),
        ({}, [m.ParamValue("FS_ACTION", float("nan"), 9, 1, 0), text("GCS Failsafe")], Mode.RTL),
        ({}, [text("PreArm: Radio failsafe on")], Mode.RTL),
    ],
)
def test_what_is_not_certain_is_said_so(parameters, heard, mode):
    run = on_its_way(**parameters)
    told(run, *heard)
    unheard(run, m.SetMode(1, 1, mode))
    found = taken_over(run)
    assert (found["by"], found["reason"]) == ("unknown", None)
    assert "by itself or by somebody not heard on this link, such as an RC transmitter" in found["text"]


def test_an_old_failsafe_explains_nothing():
    run = on_its_way()
    told(run, text("GCS Failsafe"))
    wait(run, 3)
    unheard(run, m.SetMode(1, 1, Mode.RTL))
    assert taken_over(run)["by"] == "unknown"


def test_a_command_that_is_overheard_is_its_askers_also_after_a_breach():
    run = on_its_way()
    told(run, BREACHED)
    run.ground_station(m.SetMode(1, 1, Mode.RTL))
    found = taken_over(run)
    assert (found["by"], found["reason"]) == ("ground_station", "system 255 component 190")
    assert "system 255 component 190 switched the vehicle to RTL" in found["text"]


def test_a_crash_that_disarms():
    run = on_its_way()
    told(run, text("Crash: Disarming"))
    unheard(run, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0))
    found = taken_over(run)
    assert (found["by"], found["reason"]) == ("autopilot", "crash check")
    assert found["text"].startswith("the autopilot disarmed the vehicle itself: crash check")


def test_a_breach_without_a_drive_of_ours_is_told_once():
    run = ready(conductor(upload=False, drive=False))
    lat_e7, lon_e7 = to_e7(IN_BARN)
    told(run, m.GlobalPositionInt(60_000, lat_e7, lon_e7), BREACHED, BREACHED, text("Polygon fence breached"))
    told(run, m.Statustext(2, "Fence Breached"))
    breaches = [event for event in run.events if event.name is EventName.BREACH]
    assert len(breaches) == 1
    assert breaches[0].data["position"] == pytest.approx(list(IN_BARN))
    assert breaches[0].data["fence"].startswith("exclusion")
    assert breaches[0].data["beyond_m"] > 0
    assert "beyond exclusion" in breaches[0].text


def test_a_text_then_its_status_are_one_breach_and_the_next_is_another():
    run = ready(conductor(upload=False, drive=False))
    told(run, text("Polygon fence breached"), BREACHED, BREACHED)
    run.now_s += 3
    told(run, m.FenceStatus(1, 2, 3, 9000))
    breaches = [event.data["breaches"] for event in run.events if event.name is EventName.BREACH]
    assert breaches == [1, 2]


def test_breaches_are_told_once_a_second_and_all_are_counted():
    run = ready(conductor(upload=False, drive=False))
    for number in range(1, 13):
        run.now_s += 0.3
        told(run, m.FenceStatus(1, number, 3, 5000))
    breaches = [event.data["breaches"] for event in run.events if event.name is EventName.BREACH]
    assert breaches == [1, 5, 9]


def test_texts_about_the_margin_are_no_breach():
    run = ready(conductor(upload=False, drive=False))
    told(run, text("Polygon fence in 1.5m"), text("Polygon fence cleared margin breach"))
    assert not run.happened(EventName.BREACH)()


def test_a_breach_of_a_fence_that_is_not_known_names_none_as_broken():
    run = ready(conductor(upload=False, drive=False))
    told(run, BREACHED)
    event = run.last(EventName.BREACH)
    assert event.data["beyond_m"] < -3.0
    assert "; no known fence is breached there, the nearest is " in event.text


def test_a_breach_from_before_is_told_as_that_and_explains_nothing():
    config = SimulatorConfig(home=IN_BARN, fence=fence_to_items(FENCE), parameters={"FENCE_ENABLE": 1.0})
    run = ready(conductor(vehicle=SimulatedVehicle(config), upload=False, drive=False))
    run.run_until(run.happened(EventName.BREACH), 5)
    wait(run, 10)
    assert [event.name for event in run.events].count(EventName.BREACH) == 1
    assert "from before pbpp connected" in run.last(EventName.BREACH).text


def test_failsafes_are_told_once_and_not_said_to_ground_stations_again():
    run = ready(conductor(drive=False))
    sent = len(run.sent)
    told(run, text("GCS Failsafe"), text("GCS Failsafe"))
    wait(run, 3)
    assert [event.name for event in run.events].count(EventName.FAILSAFE) == 1
    said = [message.text for message in run.sent[sent:] if isinstance(message, m.Statustext)]
    assert not any("failsafe" in one.lower() for one in said)


# Numbers from the link


@pytest.mark.parametrize(
    ("param", "mode"),
    [
        (11.0, 11),
        (0.0, 0),
        (47.0, 47),
        (4294967040.0, 4294967040),
        (1e30, None),
        (4294967296.0, None),
        (-1.0, None),
        (10.5, None),
        (float("nan"), None),
        (float("inf"), None),
        (-float("inf"), None),
    ],
)
def test_modes_in_commands_are_whole_numbers_of_32_bits_or_nonsense(param, mode):
    assert mode_of(param) == mode
    watch = OperatorWatch()
    watch.expect(Mode.AUTO, set(), is_armed=True)
    command = m.CommandLong(1, 1, Command.DO_SET_MODE, param1=1.0, param2=param)
    found = watch.overhear(m.Frame(255, 190, command), 1, 1, 100.0)
    assert (found.mode if found else None) == mode


def test_an_unknown_mode_is_said_to_be():
    run = on_its_way()
    run.ground_station(m.CommandLong(1, 1, Command.DO_SET_MODE, param1=1.0, param2=1e30))
    wait(run, 3)
    assert run.director.state is State.DRIVING
    run.ground_station(m.SetMode(1, 1, 47))
    found = taken_over(run)
    assert found["mode"] == "mode 47 (unknown)"
    assert "switched the vehicle to mode 47 (unknown); waiting" in found["text"]
