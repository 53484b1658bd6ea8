"""The measured rows of PX4's transfers, messages, modes and fence (docs/px4.md), on the simulated PX4 rover; both versions."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from simulator.station import GCS, HOME, RIVAL, Bench, at, placed, square

from mavlink_bridge.errors import BridgeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MavResult, MissionResult, MissionType
from mavlink_bridge.mavlink.modes import px4_mode
from mavlink_bridge.simulator import SimulatorConfig
from missions.errors import MissionError
from missions.firmware import Firmware
from missions.items import Command, CoordinateFrame, MissionItem, change_speed, waypoint

MISSION, FENCE, RALLY = MissionType.MISSION, MissionType.FENCE, MissionType.RALLY
OLD, NEW = Firmware(1, 17, 0), Firmware(1, 18, 0, 0)
HOLD, IN_MISSION, RTL = px4_mode(4, 3), px4_mode(4, 4), px4_mode(4, 5)
INT32_MAX, INT32_MIN = 2**31 - 1, -(2**31)


def rover(firmware=NEW, **options):
    return Bench(SimulatorConfig(autopilot=m.Autopilot.PX4, firmware=firmware, streams=False, **options))


@pytest.fixture(params=[OLD, NEW], ids=["1.17", "1.18"])
def bench(request):
    return rover(request.param)


def way(*places):
    return [waypoint(at(*place)) for place in places]


def acks(messages):
    return [MissionResult(message.type) for message in messages if isinstance(message, m.MissionAck)]


def requests(messages):
    return [message.seq for message in messages if isinstance(message, m.MissionRequestInt)]


def mode(bench):
    bench.run(1.1)
    return bench.of(m.Heartbeat)[-1].custom_mode


def armed(bench):
    bench.run(1.1)
    return bool(bench.of(m.Heartbeat)[-1].base_mode & m.ModeFlag.SAFETY_ARMED)


class TestUploads:
    def test_asks_by_request_int_and_repeats_every_quarter_second(self, bench):
        assert requests(bench.count(3)) == [0]
        begin_s = bench.now_s
        bench.run(1.0)
        again = [t - begin_s for t, message in bench.heard if isinstance(message, m.MissionRequestInt)][1:]
        assert again == pytest.approx([0.23, 0.48, 0.73, 0.98], abs=0.01)

    def test_gives_up_after_five_seconds_without_an_ack(self, bench):
        bench.count(3)
        bench.run(5.2)
        is_new = bench.vehicle.is_1_18
        assert bench.texts()[-1].strip() == ("Mission sync timeout" if is_new else "Operation timeout")
        assert not bench.of(m.MissionAck)

    def test_pushed_items_are_taken_and_each_brings_a_request(self, bench):
        items = way(*((5.0 * n, 0.0) for n in range(1, 51)))
        bench.send(m.MissionCount(1, 1, 50), *[bench.item(seq, item) for seq, item in enumerate(items)])
        bench.run(0.1)
        assert requests(bench.of(m.MissionRequestInt)) == list(range(50))
        assert acks(bench.of(m.MissionAck)) == [MissionResult.ACCEPTED]

    def test_a_wrong_seq_is_ignored_without_a_word(self, bench):
        bench.count(3)
        assert bench.ask(bench.item(2, waypoint(HOME)), bench.item(1, waypoint(HOME))) == []
        assert requests(bench.ask(bench.item(0, waypoint(HOME)))) == [1]
        assert bench.ask(bench.item(0, waypoint(HOME))) == []

    def test_the_last_item_again_is_acknowledged_again_any_other_is_an_error(self, bench):
        bench.upload(way((1, 0), (2, 0)))
        assert acks(bench.ask(bench.item(1, waypoint(HOME)))) == [MissionResult.ACCEPTED]
        assert acks(bench.ask(bench.item(0, waypoint(HOME)))) == [MissionResult.ERROR]
        assert bench.texts()[-1].strip() == "IGN MISSION_ITEM: No transfer"

    def test_the_first_count_stays_until_item_0_came_then_it_is_busy(self, bench):
        bench.count(2)
        assert requests(bench.count(5)) == [0]
        assert requests(bench.ask(bench.item(0, waypoint(HOME)))) == [1]
        assert acks(bench.count(5)) == [MissionResult.ERROR]
        assert acks(bench.ask(bench.item(1, waypoint(HOME)))) == [MissionResult.ACCEPTED]
        assert len(bench.vehicle.mission) == 2

    def test_cancelled_it_ends_at_once_and_nothing_is_stored(self, bench):
        bench.upload(way((1, 0)))
        before = bench.vehicle.mission
        bench.count(3)
        bench.ask(bench.item(0, waypoint(at(9, 9))), m.MissionAck(1, 1, MissionResult.OPERATION_CANCELLED))
        assert bench.vehicle.mission == before
        assert requests(bench.count(1)) == [0]

    def test_others_meanwhile(self, bench):
        bench.upload(way((1, 0), (2, 0)))
        bench.count(3)
        assert acks(bench.count(2, sender=RIVAL)) == [MissionResult.ERROR]
        answers = bench.ask(m.MissionRequestList(1, 1), sender=RIVAL)
        assert [a.text.strip() for a in answers] == ["Mission download request ignored, already active"]
        assert acks(bench.ask(bench.item(0, waypoint(HOME)), sender=RIVAL)) == []
        assert bench.texts()[-1].strip() == "REJ. MIS ITEM: partner id mismatch"
        assert acks(bench.ask(m.MissionClearAll(1, 1), sender=RIVAL)) == []
        assert bench.texts()[-1].strip() == "WPM: IGN CLEAR CMD: Busy"

    def test_a_list_request_where_an_upload_stands_at_the_old_lists_end_breaks_it(self, bench):
        # Read in the source, not measured: such a list request ends the upload and the vehicle stays claimed; so no upload of ours is probed by one.
        bench.count(3)
        assert [a.count for a in bench.ask(m.MissionRequestList(1, 1), sender=RIVAL)] == [0]
        bench.run(5.1)  # the download left alone frees it
        assert requests(bench.count(2)) == [0]

    def test_one_list_at_a_time(self, bench):
        bench.count(3)
        (request,) = bench.count(4, FENCE)
        assert (request.seq, request.mission_type) == (0, MISSION)
        assert acks(bench.ask(bench.item(0, square(50, 50)[0], FENCE))) == [MissionResult.ERROR]

    def test_limits_and_unknown_lists(self, bench):
        assert acks(bench.count(65, FENCE)) == acks(bench.count(33, RALLY)) == [MissionResult.NO_SPACE]
        assert acks(bench.count(2, 7)) == [MissionResult.NO_SPACE]
        assert acks(bench.count(0, 7)) == [MissionResult.ACCEPTED]
        assert [a.count for a in bench.ask(m.MissionRequestList(1, 1, 7))] == [0]

    def test_silence(self, bench):
        for system, component in ((0, 1), (1, 77), (2, 1)):
            assert bench.ask(m.MissionCount(system, component, 2)) == []
        assert bench.ask(m.MissionWritePartialList(1, 1, 0, 0)) == []
        assert requests(bench.ask(m.MissionCount(1, 190, 2))) == [0]

    def test_no_items_and_clear_all(self, bench):
        bench.upload(way((1, 0)))
        bench.upload(square(50, 50), FENCE)
        assert acks(bench.count(0)) == [MissionResult.ACCEPTED]
        assert bench.vehicle.mission == ()
        assert acks(bench.ask(m.MissionClearAll(1, 1, MissionType.ALL))) == [MissionResult.ACCEPTED]
        assert bench.vehicle.fence == ()

    def test_the_old_list_stays_where_an_item_is_refused(self, bench):
        bench.upload(way((1, 0), (2, 0)))
        before = bench.vehicle.mission
        unknown = MissionItem(18, lat_e7=400_000_000, lon_e7=-1_050_000_000)
        result, texts = bench.upload([waypoint(at(3, 0)), unknown, waypoint(at(4, 0))])
        assert (result, texts[-1].strip()) == (MissionResult.UNSUPPORTED, "IGN MISSION_ITEM: Invalid item")
        assert bench.vehicle.mission == before
        assert acks(bench.ask(bench.item(2, waypoint(HOME)))) == [MissionResult.ERROR]

    def test_float_messages_switch_to_the_old_form_and_back(self, bench):
        old = m.MissionItem(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 40.0, -105.0, 0.0)
        bench.count(3)
        assert [type(a) for a in bench.ask(old)] == [m.MissionRequest]
        assert requests(bench.ask(bench.item(1, waypoint(HOME)))) == [2]

    def test_many_items_exceed_the_cache_of_1_18_and_are_held(self, bench):
        bench.vehicle.lists[MISSION].limit = 600
        items = way(*((0.5 * n, 0.0) for n in range(501)))
        result, texts = bench.upload(items)
        assert result == MissionResult.ACCEPTED
        assert bool(texts) == bench.vehicle.is_1_18


class TestDownloads:
    def test_in_order_or_the_last_again(self, bench):
        bench.upload(way((1, 0), (2, 0), (3, 0)))
        (count,) = bench.ask(m.MissionRequestList(1, 1))
        assert count.count == 3
        asked = [m.MissionRequestInt(1, 1, seq) for seq in (0, 1, 1, 2)]
        assert [a.seq for a in bench.ask(*asked)] == [0, 1, 1, 2]

    def test_anything_else_ends_it(self, bench):
        bench.upload(way((1, 0), (2, 0), (3, 0)))
        bench.ask(m.MissionRequestList(1, 1))
        answers = bench.ask(m.MissionRequestInt(1, 1, 2))
        assert acks(answers) == [MissionResult.ERROR]
        assert bench.texts()[-1].strip() == "WPM: REJ. CMD: Req. WP was unexpected"
        assert bench.ask(m.MissionRequestInt(1, 1, 0)) == []

    def test_left_alone_the_link_is_busy_for_five_seconds(self, bench):
        bench.upload(way((1, 0)))
        bench.ask(m.MissionRequestList(1, 1))
        assert acks(bench.count(2)) == [MissionResult.ERROR]
        bench.run(5.1)
        assert requests(bench.count(2)) == [0]

    def test_1_18_repeats_the_count_until_the_first_request(self, bench):
        bench.upload(way((1, 0)))
        bench.ask(m.MissionRequestList(1, 1))
        bench.run(1.05)
        counts = len(bench.of(m.MissionCount))
        assert counts == (5 if bench.vehicle.is_1_18 else 1)
        bench.ask(m.MissionRequestInt(1, 1, 0))
        bench.run(1.05)
        assert len(bench.of(m.MissionCount)) == counts

    def test_our_ack_ends_it(self, bench):
        bench.upload(way((1, 0)))
        bench.download()
        bench.ask(m.MissionAck(1, 1, MissionResult.ACCEPTED))
        assert requests(bench.count(2)) == [0]


class TestItems:
    def test_frames_and_parameters_of_a_waypoint(self, bench):
        item = replace(waypoint(at(5, 5)), params=(-5.0, 2.5, math.nan, -90.0), alt_m=1.25)
        bench.upload([item, replace(item, frame=0, params=(1.0, 0.0, 0.0, math.nan))])
        first, second = bench.download()
        assert (first.frame, first.param1, first.param2, first.param3) == (6, -5.0, 2.5, 0.0)
        assert first.param4 == pytest.approx(270.0, abs=1e-4)
        assert second.frame == 5
        assert math.isnan(second.param4)

    @pytest.mark.parametrize("frame", [CoordinateFrame.LOCAL_NED, CoordinateFrame.GLOBAL_TERRAIN_ALT])
    def test_other_frames(self, bench, frame):
        assert bench.upload([replace(waypoint(HOME), frame=frame)])[0] == MissionResult.UNSUPPORTED_FRAME

    def test_a_place_of_frame_2_is_a_float(self):
        bench = rover(OLD)
        item = replace(change_speed(2.0), lat_e7=400_713_745, lon_e7=INT32_MAX)
        bench.upload([item])
        (back,) = bench.download()
        assert (back.frame, back.y) == (2, INT32_MIN)
        assert 0 < abs(back.x - 400_713_745) < 40

    def test_commands_without_a_place_in_a_global_frame(self, bench):
        item = replace(change_speed(2.0), frame=3)
        expected = MissionResult.INVALID_PARAM5_X if bench.vehicle.is_1_18 else MissionResult.UNSUPPORTED
        assert bench.upload([item])[0] == expected
        unset = replace(item, lat_e7=INT32_MAX, lon_e7=INT32_MAX)
        assert bench.upload([unset])[0] == MissionResult.UNSUPPORTED

    def test_condition_delay_comes_back_as_delay_from_1_18_on(self, bench):
        bench.upload([MissionItem(Command.CONDITION_DELAY, 2, (3.0, 0.0, 0.0, 0.0))])
        (back,) = bench.download()
        assert back.command == (93 if bench.vehicle.is_1_18 else 112)

    def test_list_commands_in_a_mission(self, bench):
        assert bench.upload([square(1, 1)[0]])[0] == MissionResult.ERROR

    @pytest.mark.parametrize(
        ("item", "result"),
        [
            (replace(waypoint(HOME), params=(0, 0, 1, 0)), MissionResult.INVALID_PARAM3),
            (replace(change_speed(1.0), params=(1, 1, -1, 1)), MissionResult.INVALID_PARAM4),
            (replace(change_speed(1.0), lat_e7=5), MissionResult.INVALID_PARAM5_X),
            (replace(change_speed(1.0), alt_m=5), MissionResult.INVALID_PARAM7),
            (MissionItem(20, 2, (1, 0, 0, 0)), MissionResult.INVALID_PARAM1),
            (MissionItem(177, 2, (1, 2, 0, math.nan)), MissionResult.ACCEPTED),
            (MissionItem(93, 2, (1, 2, 3, 4)), MissionResult.ACCEPTED),
            (MissionItem(17, 3, (0, 1, 0, 0)), MissionResult.INVALID_PARAM2),
        ],
    )
    def test_unused_parameters(self, item, result):
        assert rover(NEW).upload([item])[0] == result
        assert rover(OLD).upload([item])[0] == MissionResult.ACCEPTED

    def test_unused_parameters_of_fences_and_rally_points(self):
        box = square(50, 50)
        point = placed(Command.RALLY_POINT, at(5, 5))
        new, old = rover(NEW), rover(OLD)
        assert new.upload([replace(box[0], alt_m=2), *box[1:]], FENCE)[0] == MissionResult.INVALID_PARAM7
        assert old.upload([replace(box[0], alt_m=2), *box[1:]], FENCE)[0] == MissionResult.ACCEPTED
        for number in (1, 2, 3):
            odd = replace(box[0], params=tuple(4.0 if n in (0, number) else 0.0 for n in range(4)))
            assert new.upload([odd, *box[1:]], FENCE)[0] == MissionResult(6 + number)
        assert new.upload([replace(point, params=(1, 0, 0, 0))], RALLY)[0] == MissionResult.INVALID_PARAM1
        assert new.upload([point], RALLY)[0] == MissionResult.ACCEPTED

    @pytest.mark.parametrize("count", [2.0, math.nan])
    def test_too_few_vertices(self, bench, count):
        box = [replace(item, params=(count, 0, 0, 0)) for item in square(50, 50)]
        assert bench.upload(box, FENCE)[0] == MissionResult.ERROR

    def test_the_first_current_item_counts_else_the_old_number_does(self, bench):
        bench.upload(way((1, 0), (2, 0), (3, 0)))
        bench.ask(m.MissionSetCurrent(1, 1, 2))
        bench.upload(way((1, 1), (2, 1), (3, 1), (4, 1)))
        assert bench.vehicle.rover.progress.seq == 2
        bench.count(2)
        bench.ask(bench.item(0, waypoint(at(9, 9)), current=1), bench.item(1, waypoint(at(9, 8))))
        assert bench.vehicle.rover.progress.seq == 0


class TestFence:
    def fenced(self, bench, *zones):
        result, _ = bench.upload([item for zone in zones for item in zone], FENCE)
        assert result == MissionResult.ACCEPTED
        return bench

    def test_home_outside_an_inclusion_is_not_enforced(self, bench):
        self.fenced(bench, square(100, 100, inclusion=True)).run(1.0)
        assert bench.texts()[-1].strip() == "Geofence invalid, doesn't contain Home position"
        assert bench.upload(way((5, 0)))[1] == []

    def test_an_armed_rover_in_a_new_exclusion(self, bench):
        bench.vehicle.rover.motion.position_m = 100 + 100j
        assert bench.command(Command.COMPONENT_ARM_DISARM, 1) == MavResult.ACCEPTED
        self.fenced(bench, square(100, 100)).run(1.0)
        assert bench.texts()[-1].strip() == "Geofence invalid, doesn't contain current vehicle position"[:49]

    @pytest.mark.parametrize(("boxes", "late_s"), [(1, 0.5), (4, 1.7), (16, 6.5)])
    def test_it_counts_after_a_tenth_of_a_second_a_vertex(self, bench, boxes, late_s):
        bench.upload(way((50, 50)))
        zones = [square(50, 50), *(square(50, 100 + 20 * n) for n in range(boxes - 1))]
        bench.heard.clear()
        self.fenced(bench, *zones)
        begin_s = bench.now_s
        bench.run_until(lambda: any("Geofence violation" in text for text in bench.texts()), 10)
        assert bench.now_s - begin_s == pytest.approx(late_s, abs=0.25)
        assert bench.command(Command.MISSION_START) == MavResult.DENIED
        assert bench.texts()[-1].strip() == "Mission start denied! No valid mission"

    def test_waypoints_count_legs_do_not(self, bench):
        self.fenced(bench, square(20, 0)).run(1.0)
        assert bench.upload(way((40, 0)))[1] == []
        assert [text.strip() for text in bench.upload(way((40, 0), (20, 1)))[1]] == [
            "Geofence violation for waypoint 2"
        ]

    def test_polygons_behind_a_circle_are_misread(self, bench):
        circle = [placed(Command.FENCE_CIRCLE_EXCLUSION, at(0, 60), 5.0)]
        self.fenced(bench, circle, square(20, 0)).run(1.0)
        assert bench.upload(way((20, 0)))[1] == []
        self.fenced(bench, square(20, 0), circle).run(1.0)
        assert "Geofence violation for waypoint 1" in [text.strip() for text in bench.texts()]

    @pytest.mark.parametrize(
        ("action", "ends"), [(0, HOLD), (1, HOLD), (2, HOLD), (3, RTL), (5, px4_mode(4, 6))]
    )
    def test_what_a_breach_leads_to(self, action, ends):
        bench = rover(parameters={"GF_ACTION": action})
        self.fenced(bench, square(20, 0)).run(1.0)
        bench.upload(way((40, 0)))
        assert bench.command(Command.MISSION_START) == MavResult.ACCEPTED
        bench.run(8.0)
        heard = [text.strip() for text in bench.texts()]
        assert ("Failsafe activated" in heard) == (action >= 2)
        assert ("Geofence: approaching or outside geofence" in heard) == (action >= 1)
        bench.run(8.0)
        modes = {message.custom_mode for message in bench.of(m.Heartbeat)}
        assert ends in modes
        assert ("Mission finished, loitering" in [t.strip() for t in bench.texts()]) == (action < 2)

    def test_the_circle_about_home(self):
        bench = rover(parameters={"GF_MAX_HOR_DIST": 30.0})
        assert [text.strip() for text in bench.upload(way((40, 0)))[1]] == [
            "Geofence violation for waypoint 1"
        ]


class TestModesAndCommands:
    def test_it_boots_disarmed_in_hold(self, bench):
        assert (mode(bench), armed(bench)) == (HOLD, False)
        beat = bench.of(m.Heartbeat)[-1]
        assert (beat.autopilot, beat.type, beat.base_mode, beat.system_status) == (12, 10, 29, 3)

    def test_set_mode_tells_the_truth_only_from_1_18_on(self, bench):
        refused = MavResult.TEMPORARILY_REJECTED if bench.vehicle.is_1_18 else MavResult.ACCEPTED
        assert bench.command(Command.DO_SET_MODE, 1, 1) == refused
        assert bench.texts()[-1].strip() == "Switching to Manual is currently not available"
        for number in (10, 11, 15):
            assert bench.command(Command.DO_SET_MODE, 1, number) == refused
        assert mode(bench) == HOLD
        assert bench.command(Command.DO_SET_MODE, 1, 4, 5) == MavResult.ACCEPTED
        assert mode(bench) == RTL

    def test_ardupilots_number_of_hold_drives_the_mission(self, bench):
        bench.upload(way((40, 0)))
        assert bench.command(Command.DO_SET_MODE, 1, 4) == MavResult.ACCEPTED
        assert bench.command(Command.COMPONENT_ARM_DISARM, 1) == MavResult.ACCEPTED
        bench.run(3.0)
        assert mode(bench) == IN_MISSION
        assert abs(bench.vehicle.rover.motion.position_m) > 3

    def test_unused_parameters_of_commands(self, bench):
        expected = MavResult.DENIED if bench.vehicle.is_1_18 else MavResult.ACCEPTED
        assert bench.command(Command.DO_SET_MODE, 1, 4, 3, 1) == expected
        assert bench.command(Command.COMPONENT_ARM_DISARM, 1, 0, 1) == expected
        assert armed(bench) == (not bench.vehicle.is_1_18)

    def test_old_requests_end_with_1_18(self, bench):
        for command in (Command.GET_HOME_POSITION, Command.REQUEST_AUTOPILOT_CAPABILITIES):
            expected = MavResult.UNSUPPORTED if bench.vehicle.is_1_18 else MavResult.ACCEPTED
            assert bench.command(command) == expected
        assert bench.command(Command.REQUEST_MESSAGE, 148) == MavResult.ACCEPTED
        version = bench.of(m.AutopilotVersion)[-1]
        assert version.capabilities == 0xE8FF
        assert version.flight_sw_version == (0x01120000 if bench.vehicle.is_1_18 else 0x011100FF)

    def test_what_rovers_do_not_have(self, bench):
        for command in (Command.DO_SET_REVERSE, Command.DO_FENCE_ENABLE):
            assert bench.command(command, 1) == MavResult.UNSUPPORTED
        assert bench.command(Command.SET_MESSAGE_INTERVAL, 33, 100_000) == MavResult.ACCEPTED

    def test_a_mission_from_start_to_end(self, bench):
        bench.upload(way((10, 0), (10, 10)))
        states = []
        assert bench.command(Command.MISSION_START) == MavResult.ACCEPTED
        for _ in range(20):
            bench.run(1.0)
            bench.command(Command.REQUEST_MESSAGE, 42)
            states.append(bench.of(m.MissionCurrent)[-1].mission_state)
        assert sorted(set(states)) == [3, 5]
        texts = [text.strip() for text in bench.texts()]
        assert texts[:2] == ["Armed by mission start", "Executing Mission"]
        assert texts[-1] == "Mission finished, loitering"
        assert mode(bench) == HOLD
        assert bench.command(Command.DO_SET_MODE, 1, 4, 4) == MavResult.ACCEPTED
        assert bench.texts()[-1].strip() == "No valid mission available, loitering"

    def test_current_items(self, bench):
        bench.upload(way((10, 0), (20, 0)))
        answer = bench.command(Command.DO_SET_MISSION_CURRENT, 1)
        assert answer == (MavResult.ACCEPTED if bench.vehicle.is_1_18 else MavResult.UNSUPPORTED)
        if bench.vehicle.is_1_18:
            assert bench.command(Command.DO_SET_MISSION_CURRENT, 5) == MavResult.FAILED
            assert bench.command(Command.DO_SET_MISSION_CURRENT, -2) == MavResult.DENIED
            assert bench.command(Command.DO_SET_MISSION_CURRENT, 0, 2) == MavResult.DENIED
        bench.ask(m.MissionSetCurrent(1, 1, 9))
        assert bench.texts()[-1].strip() == "WPM: WP CURR CMD: Not in list"

    def test_a_mission_taken_away_on_the_way(self, bench):
        bench.upload(way((40, 0)))
        bench.command(Command.MISSION_START)
        bench.run(1.0)
        bench.count(0)
        assert mode(bench) == HOLD
        assert bench.texts()[-1].strip() == "No valid mission available, loitering"

    def test_reposition(self, bench):
        bench.command(Command.COMPONENT_ARM_DISARM, 1)
        goal = waypoint(at(10, 0))
        place = {"x": goal.lat_e7, "y": goal.lon_e7}
        assert bench.command(Command.DO_REPOSITION, -1, 1, as_int=True, **place) == MavResult.ACCEPTED
        bench.run(6.0)
        assert abs(bench.vehicle.rover.motion.position_m - 10) < 1
        answer = bench.command(Command.DO_REPOSITION, -1, 0, param5=HOME.lat_deg, param6=HOME.lon_deg)
        assert answer == (MavResult.ACCEPTED if bench.vehicle.is_1_18 else MavResult.UNSUPPORTED)
        bench.run(6.0)
        assert abs(bench.vehicle.rover.motion.position_m) < 1  # it drives all the same

    def test_position_targets_and_guided_items_do_nothing(self, bench):
        bench.command(Command.COMPONENT_ARM_DISARM, 1)
        goal = waypoint(at(10, 0))
        bench.ask(
            m.SetPositionTargetGlobalInt(0, 1, 1, 6, 0xFF8, goal.lat_e7, goal.lon_e7, 0.0),
            bench.item(0, goal, current=2),
        )
        bench.run(3.0)
        assert bench.vehicle.rover.motion.position_m == 0

    def test_rtl_arrives_and_disarms(self, bench):
        bench.vehicle.rover.motion.position_m = 10 + 0j
        bench.command(Command.COMPONENT_ARM_DISARM, 1)
        bench.command(Command.DO_SET_MODE, 1, 4, 5)
        bench.run(8.0)
        assert not armed(bench)


class TestParameters:
    def test_bits_and_types(self, bench):
        bench.ask(m.ParamRequestRead(1, 1, "GF_ACTION"))
        told = bench.of(m.ParamValue)[-1]
        assert (told.param_type, 0 < told.param_value < 1e-40) == (6, True)
        assert bench.ask(m.ParamSet(1, 1, "GF_ACTION", 3.0, 9)) == []  # the wrong type: silence
        bench.ask(m.ParamSet(1, 1, "GF_ACTION", 3.0, 6))
        assert bench.vehicle.parameters["GF_ACTION"] == 1077936128
        assert bench.ask(m.ParamRequestRead(1, 1, "WP_RADIUS")) == []

    def test_gf_predict_is_gone_in_1_18(self, bench):
        names = [answer.param_id for answer in bench.ask(m.ParamRequestList(1, 1))]
        assert ("GF_PREDICT" in names) == (not bench.vehicle.is_1_18)
        assert names[-1] == "_HASH_CHECK"

    def test_nothing_is_range_checked(self, bench):
        bench.ask(m.ParamSet(1, 1, "NAV_ACC_RAD", -7.0, 9))
        assert bench.vehicle.parameters["NAV_ACC_RAD"] == -7.0


def test_ids_of_lists_are_told_a_second_late():
    bench = rover()
    bench.upload(way((10, 0)))
    told = []
    for _ in range(4):
        bench.command(Command.REQUEST_MESSAGE, 42)
        told.append(bench.of(m.MissionCurrent)[-1].mission_id)
        bench.run(0.5)
    assert told[0] == 0
    assert told[-1] == bench.vehicle.lists[MISSION].id != 0
    before = bench.vehicle.lists[MISSION].changes
    bench.upload(way((10, 0)))  # the same list is not stored anew
    assert bench.vehicle.lists[MISSION].changes == before


def test_lists_stay_over_a_reboot_and_transfers_do_not():
    bench = rover()
    bench.upload(way((10, 0)))
    bench.count(3)
    bench.vehicle.reboot(bench.now_s)
    bench.run(4.0)
    assert len(bench.vehicle.mission) == 1
    assert requests(bench.count(2)) == [0]
    assert GCS == (255, 190)


class TestTheSimpleLaw:
    """What the simulated rover makes of a mission; only the answers are PX4's, not how it drives."""

    def test_speeds_waits_and_the_way_home(self):
        bench = rover(home=HOME, heading_deg=90.0)
        wait = replace(waypoint(at(6, 0)), command=Command.NAV_LOITER_TIME, params=(3.0, 0, 0, 0))
        bench.upload(
            [change_speed(1.5), wait, MissionItem(Command.NAV_DELAY, 2, (2.0, 0, 0, 0)), MissionItem(20, 2)]
        )
        assert bench.command(Command.MISSION_START) == MavResult.ACCEPTED
        bench.run(2.0)
        bench.command(Command.REQUEST_MESSAGE, 33)
        bench.command(Command.REQUEST_MESSAGE, 74)
        assert bench.of(m.GlobalPositionInt)[-1].vx == 150
        assert bench.of(m.VfrHud)[-1].groundspeed == 1.5
        bench.run(3.0)
        assert bench.vehicle.rover.motion.speed_mps == 0
        bench.run(5.5)
        assert mode(bench) == RTL
        bench.run(10.0)
        assert not armed(bench)

    def test_jumps_and_waiting_without_end(self):
        bench = rover()
        stay = replace(waypoint(at(3, 0)), command=Command.NAV_LOITER_UNLIM)
        bench.upload([*way((2, 0)), MissionItem(Command.DO_JUMP, 2, (3.0, 1.0, 0, 0)), *way((90, 0)), stay])
        bench.command(Command.MISSION_START)
        bench.run(10.0)
        assert mode(bench) == IN_MISSION
        assert bench.vehicle.rover.progress.seq == 3
        bench.upload([MissionItem(Command.DO_JUMP, 2, (9.0, 1.0, 0, 0))])  # past the end: it ends there
        bench.run(1.0)
        assert mode(bench) == HOLD

    def test_landing_disarms(self):
        bench = rover()
        bench.command(Command.COMPONENT_ARM_DISARM, 1)
        bench.command(Command.DO_SET_MODE, 1, 4, 6)
        bench.run(3.0)
        assert not armed(bench)

    def test_set_mode_by_the_message(self, bench):
        bench.ask(m.SetMode(1, 1, RTL))
        assert mode(bench) == RTL
        bench.ask(m.SetMode(1, 1, px4_mode(9)))
        assert mode(bench) == RTL

    def test_a_mode_that_is_none(self):
        bench = rover(NEW)
        assert bench.command(Command.DO_SET_MODE, 1, 4, 99) == MavResult.TEMPORARILY_REJECTED
        assert bench.texts()[-1].strip() == "Unsupported auto mode"
        assert bench.command(Command.DO_SET_MODE, 1, math.nan) == MavResult.DENIED

    def test_a_goal_outside_the_fence(self):
        bench = rover()
        bench.upload(square(20, 0), FENCE)
        bench.run(1.0)
        bench.command(Command.COMPONENT_ARM_DISARM, 1)
        goal = waypoint(at(20, 0))
        bench.command(Command.DO_REPOSITION, -1, 1, as_int=True, x=goal.lat_e7, y=goal.lon_e7)
        assert bench.texts()[-1].strip() == "Reposition is outside geofence"

    def test_arming_by_another_number(self, bench):
        assert bench.command(Command.COMPONENT_ARM_DISARM, 2) == MavResult.DENIED
        assert bench.command(Command.COMPONENT_ARM_DISARM, 0) == MavResult.ACCEPTED
        assert bench.command(Command.REQUEST_MESSAGE, 9999) == MavResult.DENIED

    def test_telemetry_flows(self):
        bench = Bench(SimulatorConfig(autopilot=m.Autopilot.PX4))
        bench.run(2.0)
        kinds = {type(message) for _, message in bench.heard}
        assert {m.SysStatus, m.GpsRawInt, m.GlobalPositionInt, m.MissionCurrent, m.HomePosition} <= kinds
        assert (bench.of(m.MissionCurrent)[-1].total, bench.of(m.MissionCurrent)[-1].mission_state) == (
            65_535,
            1,
        )
        assert not bench.vehicle.is_armed
        assert bench.vehicle.mode == HOLD
        assert bench.vehicle.rally == ()
        assert abs(bench.vehicle.position.lat_deg - HOME.lat_deg) < 1e-7
        assert bench.ask(m.ParamRequestRead(1, 1, "", 999)) == []
        assert bench.ask(m.ParamRequestRead(1, 1, "", 0))[0].param_id == "CA_AIRFRAME"
        bench.vehicle.receive(m.Frame(1, 1, m.ParamRequestList(1, 1)), bench.now_s)  # its own: not answered
        assert bench.vehicle.messages_to_send() == []

    def test_reached_items_are_told_again(self, bench):
        bench.upload(way((5, 0)))
        bench.command(Command.MISSION_START)
        bench.run(4.0)
        assert bench.of(m.MissionItemReached)
        vehicle = rover(OLD, mission=tuple(way((5, 0))), fence=tuple(square(50, 50))).vehicle
        assert (len(vehicle.mission), len(vehicle.fence)) == (1, 4)


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"parameters": {"WP_SPEED": 1.0}}, "the simulated PX4 rover has no parameter WP_SPEED"),
        ({"fence": tuple(square(5, 5)) * 17}, "68 items; the simulated PX4 rover holds 64"),
        ({"mission": (MissionItem(18),)}, "item 0 is refused: UNSUPPORTED"),
    ],
)
def test_what_it_cannot_start_with(options, error):
    with pytest.raises((BridgeError, MissionError), match=error):
        rover(NEW, **options)


def test_a_fence_that_nobody_knows_what_to_make_of_is_taken(bench):
    box = square(20, 0)
    assert bench.upload(box[:3], FENCE)[0] == MissionResult.ACCEPTED  # one vertex is missing
    point = placed(Command.FENCE_RETURN_POINT, at(1, 1))
    assert bench.upload([point, *square(20, 0)], FENCE)[0] == MissionResult.ACCEPTED
    bench.run(1.0)
    assert [t.strip() for t in bench.upload(way((20, 0)))[1]] == ["Geofence violation for waypoint 1"]


def test_a_float_read_back(bench):
    bench.upload([waypoint(at(5, 5)), MissionItem(Command.DO_SET_HOME, 2, (0, 0, 0, 0), 7, 0)])
    bench.ask(m.MissionRequestList(1, 1))
    first, second = bench.ask(m.MissionRequest(1, 1, 0), m.MissionRequest(1, 1, 1))
    assert (type(first), first.frame) == (m.MissionItem, 6)
    assert first.x == pytest.approx(at(5, 5).lat_deg, abs=1e-5)
    assert second.x == 7.0
    old = m.MissionItem(1, 1, 0, 2, 179, 0, 1, 0, 0, 0, 0, 9.0, 0.0, 0.0)
    bench.ask(m.MissionAck(1, 1, 0))
    bench.count(1)
    assert acks(bench.ask(old)) == [MissionResult.ACCEPTED]
    assert bench.vehicle.mission[0].lat_e7 == 9


def test_requests_of_strangers(bench):
    bench.upload(way((1, 0)))
    bench.ask(m.MissionRequestList(1, 1))
    bench.ask(m.MissionRequestInt(1, 1, 0), m.MissionAck(1, 1, 0), sender=RIVAL)
    texts = [text.strip() for text in bench.texts()]
    assert texts[-2:] == ["WPM: REJ. CMD: partner id mismatch", "REJ. WP CMD: partner id mismatch"]
    assert bench.ask(m.MissionRequestInt(1, 1, 0, FENCE)) == []
    assert acks(bench.ask(bench.item(0, waypoint(HOME)))) == [MissionResult.ERROR]
    assert bench.texts()[-1].strip() == "IGN MISSION_ITEM: Busy"
    bench.ask(m.MissionAck(1, 1, 0))
    bench.count(2)
    bench.ask(bench.item(0, waypoint(HOME)))
    bench.ask(m.MissionRequestInt(1, 1, 0))
    assert bench.texts()[-1].strip() == "WPM: REJ. CMD: Busy"
