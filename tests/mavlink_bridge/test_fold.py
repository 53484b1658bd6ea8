"""Messages folded into situations: who says what to whom, and what is believed of it."""

from __future__ import annotations

import math
import struct
from dataclasses import fields, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink_bridge.fold import FOLDED, fold
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import Frame, Message
from missions.errors import FenceMissingError
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.firmware import Firmware
from missions.geo import LatLon
from missions.items import MissionItem, waypoint, with_home
from missions.planning.plan import plan
from missions.request import Request
from missions.situation import ListKind, Mission, Pose, Situation

HOME = LatLon(40.071374, -105.22993)
THERE = LatLon(40.0726316, -105.2290497)
FENCE = Fence((CircleZone(ZoneKind.INCLUSION, HOME, 500.0), CircleZone(ZoneKind.EXCLUSION, HOME, 5.0)))
OTHER_FENCE = Fence((CircleZone(ZoneKind.INCLUSION, HOME, 400.0), CircleZone(ZoneKind.EXCLUSION, THERE, 7.0)))
ROVER, STATION, COMPANION = (1, 1), (255, 230), (1, 195)
NEW = Situation(system=1, component=1)


def after(situation: Situation, *told: tuple[tuple[int, int], Message], since_s: float = 0.0) -> Situation:
    """Fold messages, each with its sender, a second apart."""
    for number, (sender, message) in enumerate(told):
        situation = fold(situation, Frame(*sender, message), since_s + number)
    return situation


def item_message(
    item: MissionItem, seq: int, kind: int, to: tuple[int, int], current: int = 0
) -> m.MissionItemInt:
    return m.MissionItemInt(
        *to,
        seq,
        item.frame,
        item.command,
        current,
        1,
        *item.params,
        item.lat_e7,
        item.lon_e7,
        item.alt_m,
        kind,
    )


def upload(
    items: tuple[MissionItem, ...], kind: int, sender: tuple[int, int] = STATION, result: int | None = 0
) -> list:
    told: list = [(sender, m.MissionCount(*ROVER, len(items), kind))]
    told += [(sender, item_message(item, seq, kind, ROVER)) for seq, item in enumerate(items)]
    if result is not None:
        told.append((ROVER, m.MissionAck(*sender, result, kind)))
    return told


def read_back(items: tuple[MissionItem, ...], kind: int) -> list:
    told: list = [(ROVER, m.MissionCount(*STATION, len(items), kind))]
    return told + [(ROVER, item_message(item, seq, kind, STATION)) for seq, item in enumerate(items)]


def fence_of(situation: Situation) -> Fence | None:
    return situation.fence.value if situation.fence else None


def why_no_plan(situation: Situation) -> str:
    with pytest.raises(FenceMissingError, match="fence") as caught:
        plan(situation, Request(HOME, (THERE,)))
    return str(caught.value)


class TestVehicle:
    def test_heartbeat(self) -> None:
        heartbeat = m.Heartbeat(m.MavType.GROUND_ROVER, m.Autopilot.ARDUPILOTMEGA, 0b1000_0001, 10)
        found = after(Situation(system=1), (ROVER, heartbeat))
        assert (found.component, found.vehicle_type, found.ardupilot, found.mode, found.armed) == (
            1,
            10,
            True,
            10,
            True,
        )
        px4 = m.Heartbeat(m.MavType.GROUND_ROVER, m.Autopilot.PX4, 1, 4)
        found = after(NEW, (ROVER, px4))
        assert (found.ardupilot, found.armed) == (False, False)

    @pytest.mark.parametrize(
        ("sender", "heartbeat"),
        [
            ((1, 195), m.Heartbeat(m.MavType.ONBOARD_CONTROLLER, m.Autopilot.INVALID)),
            (
                (1, 154),
                m.Heartbeat(26, m.Autopilot.GENERIC, 128, 99),
            ),  # a gimbal that says it is an autopilot
            ((2, 1), m.Heartbeat(m.MavType.GROUND_ROVER, m.Autopilot.ARDUPILOTMEGA, 128, 10)),
            (STATION, m.Heartbeat(m.MavType.GCS, m.Autopilot.INVALID, 192, 3)),
        ],
    )
    def test_other_heartbeats_change_nothing(self, sender: tuple[int, int], heartbeat: m.Heartbeat) -> None:
        assert after(NEW, (sender, heartbeat)) == NEW

    def test_position_and_heading(self) -> None:
        found = after(NEW, (ROVER, m.GlobalPositionInt(0, 400713740, -1052299300, vx=120, vy=-50, hdg=9050)))
        assert found.pose is not None
        assert found.pose.value == Pose(HOME, 90.5, (-0.5, 1.2))
        assert (found.pose.time_s, found.pose.source) == (0.0, "GLOBAL_POSITION_INT")
        unknown = after(NEW, (ROVER, m.GlobalPositionInt(0, 400713740, -1052299300, hdg=65535)))
        assert unknown.pose is not None
        assert unknown.pose.value.heading_deg is None

    @pytest.mark.parametrize(
        ("sender", "lat_e7", "lon_e7"),
        [
            (ROVER, 0, 0),
            (ROVER, 910_000_000, 0),
            (ROVER, 0, 1_900_000_000),
            ((1, 195), 1, 1),
            ((2, 1), 1, 1),
            (STATION, 1, 1),
        ],
    )
    def test_positions_that_are_none_or_another_ones(
        self, sender: tuple[int, int], lat_e7: int, lon_e7: int
    ) -> None:
        assert after(NEW, (sender, m.GlobalPositionInt(0, lat_e7, lon_e7))) == NEW

    def test_home(self) -> None:
        found = after(NEW, (ROVER, m.HomePosition(400713740, -1052299300)), (ROVER, m.HomePosition(0, 0)))
        assert found.home is not None
        assert (found.home.value, found.home.time_s) == (HOME, 0.0)

    @pytest.mark.parametrize("component", [1, 190])
    def test_parameters_of_any_component(self, component: int) -> None:
        """Ground stations write those they fetched by MAVFTP under a component of their own."""
        first = after(NEW, ((1, component), m.ParamValue("FENCE_MARGIN", 2.5, 9, 1, 0)))
        assert first.parameters == {"FENCE_MARGIN": 2.5}
        assert after(first, ((1, component), m.ParamValue("FENCE_MARGIN", 2.5, 9, 1, 0))) is first
        changed = after(first, ((1, component), m.ParamValue("FENCE_MARGIN", 3.0, 9, 1, 0)))
        assert changed.parameters == {"FENCE_MARGIN": 3.0}
        assert first.parameters == {"FENCE_MARGIN": 2.5}
        assert after(NEW, ((2, component), m.ParamValue("FENCE_MARGIN", 2.5, 9, 1, 0))) == NEW

    @given(
        st.lists(
            st.tuples(st.sampled_from([f"P{number}" for number in range(80)]), st.floats(-9, 9, width=32))
        )
    )
    def test_no_situation_changes_by_what_comes_after_it(self, told: list[tuple[str, float]]) -> None:
        situation, wanted = NEW, {}
        known = []
        for name, value in told:
            situation = after(situation, (ROVER, m.ParamValue(name, value, 9, 80, 0)))
            wanted = {**wanted, name: value}
            known.append((situation.parameters, wanted))
        for parameters, values in known:
            assert parameters == values
            assert list(parameters) == list(values)
            assert len(parameters) == len(values)
            assert all(parameters.get(f"P{number}") == values.get(f"P{number}") for number in range(80))


class TestFence:
    KIND = m.MissionType.FENCE
    ITEMS = fence_to_items(FENCE)
    OTHER = fence_to_items(OTHER_FENCE)

    def test_an_accepted_upload_counts(self) -> None:
        found = after(NEW, *upload(self.ITEMS, self.KIND))
        assert fence_of(found) == FENCE
        assert found.fence is not None
        assert (found.fence.time_s, found.fence.source) == (3.0, "fence upload")
        assert not found.transfers

    def test_a_read_back_counts(self) -> None:
        found = after(NEW, *read_back(self.ITEMS, self.KIND))
        assert fence_of(found) == FENCE
        assert found.fence is not None
        assert (found.fence.time_s, found.fence.source) == (2.0, "fence read-back")

    def test_the_newest_counts(self) -> None:
        assert (
            fence_of(after(NEW, *upload(self.ITEMS, self.KIND), *read_back(self.OTHER, self.KIND)))
            == OTHER_FENCE
        )
        assert (
            fence_of(after(NEW, *read_back(self.OTHER, self.KIND), *upload(self.ITEMS, self.KIND))) == FENCE
        )

    def test_items_in_any_order_twice_and_in_the_old_form(self) -> None:
        count, *items = read_back(self.ITEMS, self.KIND)
        assert fence_of(after(NEW, count, *reversed(items), *items)) == FENCE
        old = [
            (sender, m.MissionItem(**{one.name: getattr(message, one.name) for one in fields(message) if one.name not in ("x", "y")}, x=message.x / 1e7, y=message.y / 1e7))
            for sender, message in items
        ]  # fmt: skip
        assert fence_of(after(NEW, count, *old)) == FENCE

    def test_a_repeated_item_after_the_end_opens_nothing(self) -> None:
        done = after(NEW, *upload(self.ITEMS, self.KIND))
        last = upload(self.ITEMS, self.KIND)[-2]
        again = after(
            done,
            last,
            (ROVER, m.MissionAck(*STATION, 1, self.KIND)),
            last,
            (ROVER, m.MissionAck(*STATION, 0, self.KIND)),
        )
        assert fence_of(again) == FENCE
        assert again.fence_trouble is None
        read = after(NEW, *read_back(self.ITEMS, self.KIND))
        assert after(read, read_back(self.ITEMS, self.KIND)[-1]) == read

    @pytest.mark.parametrize("missing", [0, 1, 2])
    def test_a_read_back_in_part_is_not_believed(self, missing: int) -> None:
        told = read_back(self.ITEMS, self.KIND)
        found = after(NEW, *told[:missing], *told[missing + 1 :])
        assert found.fence is None
        of = "an unknown number of" if missing == 0 else "2"
        assert f"a fence download is incomplete ({2 if missing == 0 else 1} of {of} items)" in why_no_plan(
            found
        )

    @pytest.mark.parametrize("missing", [0, 1, 2])
    def test_an_upload_in_part_is_not_believed_even_if_accepted(self, missing: int) -> None:
        told = upload(self.ITEMS, self.KIND)
        told.pop(missing)
        found = after(NEW, *told)
        assert found.fence is None
        assert "a fence upload is incomplete" in why_no_plan(found)

    def test_an_accepted_upload_seen_in_part_makes_the_old_fence_stale(self) -> None:
        told = upload(self.OTHER, self.KIND)
        told.pop(2)
        found = after(NEW, *upload(self.ITEMS, self.KIND), *told)
        assert found.fence is None
        assert "a fence upload is incomplete (1 of 2 items)" in why_no_plan(found)
        assert fence_of(after(found, *read_back(self.OTHER, self.KIND))) == OTHER_FENCE

    def test_an_upload_without_acknowledgement_leaves_the_old_fence_with_a_warning(self) -> None:
        found = after(NEW, *upload(self.OTHER, self.KIND, result=None))
        assert "a fence upload of 2 items was not acknowledged (MISSION_ACK)" in why_no_plan(found)
        beside = after(NEW, *upload(self.ITEMS, self.KIND), *upload(self.OTHER, self.KIND, result=None))
        assert fence_of(beside) == FENCE
        assert beside.transfers[ListKind.FENCE, True].is_complete
        start, target = LatLon(40.0722, -105.22993), LatLon(40.0730, -105.22993)
        assert plan(beside, Request(start, (target,), 1.0)).warnings[0] == (
            "a fence upload of 2 items was not acknowledged (MISSION_ACK); an older fence is used"
        )

    @pytest.mark.parametrize("result", [1, 3, 4, 6, 14, 15])
    def test_a_refused_upload_leaves_the_old_fence_and_is_told(self, result: int) -> None:
        refused = upload(self.OTHER, self.KIND, result=result)
        found = after(NEW, *upload(self.ITEMS, self.KIND), *refused)
        assert fence_of(found) == FENCE
        assert found.fence_trouble == f"fence upload: the vehicle refused it ({m.MissionResult(result).name})"
        assert m.MissionResult(result).name in why_no_plan(after(NEW, *refused))
        assert after(found, *upload(self.ITEMS, self.KIND)).fence_trouble is None

    def test_an_unknown_result_is_a_refusal_too(self) -> None:
        assert "99" in str(after(NEW, *upload(self.OTHER, self.KIND, result=99)).fence_trouble)

    def test_an_item_out_of_sequence_does_not_end_an_upload(self) -> None:
        told = upload(self.ITEMS, self.KIND)
        told.insert(2, (ROVER, m.MissionAck(*STATION, m.MissionResult.INVALID_SEQUENCE, self.KIND)))
        assert fence_of(after(NEW, *told)) == FENCE

    def test_an_acknowledgement_alone_changes_nothing(self) -> None:
        assert after(NEW, (ROVER, m.MissionAck(*STATION, 0, self.KIND))) == NEW

    def test_an_upload_of_a_companion_is_no_read_back(self) -> None:
        """A bridge speaks with the vehicle's own system id: what it sends is a request, not the vehicle's word."""
        assert after(NEW, *upload(self.ITEMS, self.KIND, sender=COMPANION, result=None)).fence is None
        refused = after(NEW, *upload(self.ITEMS, self.KIND, sender=COMPANION, result=1))
        assert refused.fence is None
        assert fence_of(after(NEW, *upload(self.ITEMS, self.KIND, sender=COMPANION))) == FENCE
        # nor is a companion's acknowledgement of what it downloads an end of anybody's upload
        pending = upload(self.ITEMS, self.KIND, result=None)
        assert after(NEW, *pending, (COMPANION, m.MissionAck(*ROVER, 0, self.KIND))).fence is None

    @pytest.mark.parametrize("count", [0, None])
    def test_a_cleared_list_is_an_empty_fence(self, count: int | None) -> None:
        ask = m.MissionClearAll(*ROVER, self.KIND) if count is None else m.MissionCount(*ROVER, 0, self.KIND)
        asked = after(NEW, *upload(self.ITEMS, self.KIND), (STATION, ask))
        assert fence_of(asked) == FENCE
        cleared = after(asked, (ROVER, m.MissionAck(*STATION, 0, self.KIND)))
        assert fence_of(cleared) == Fence()
        assert "is empty" in why_no_plan(cleared)
        kept = after(asked, (ROVER, m.MissionAck(*STATION, 1, self.KIND)))
        assert fence_of(kept) == FENCE

    def test_everything_cleared_at_once(self) -> None:
        full = after(NEW, *upload(self.ITEMS, self.KIND), *upload((waypoint(HOME), waypoint(THERE)), 0))
        cleared = after(
            full, (STATION, m.MissionClearAll(*ROVER, 255)), (ROVER, m.MissionAck(*STATION, 0, 255))
        )
        assert fence_of(cleared) == Fence()
        assert cleared.mission is not None
        assert cleared.mission.value.items == ()

    def test_an_empty_read_back(self) -> None:
        assert (
            fence_of(
                after(NEW, *upload(self.ITEMS, self.KIND), (ROVER, m.MissionCount(*STATION, 0, self.KIND)))
            )
            == Fence()
        )

    def test_a_partial_write_makes_the_list_unknown(self) -> None:
        partial = (STATION, m.MissionWritePartialList(*ROVER, 1, 1, self.KIND))
        item = (STATION, item_message(self.OTHER[1], 1, self.KIND, ROVER))
        found = after(
            NEW, *upload(self.ITEMS, self.KIND), partial, item, (ROVER, m.MissionAck(*STATION, 0, self.KIND))
        )
        assert found.fence is None
        assert "is incomplete (1 of an unknown number of items)" in why_no_plan(found)

    def test_an_unusable_fence_says_why(self) -> None:
        bad = (replace(self.ITEMS[0], params=(0.0, 0.0, 0.0, 0.0)),)
        found = after(NEW, *upload(self.ITEMS, self.KIND), *read_back(bad, self.KIND))
        assert fence_of(found) == FENCE
        assert (
            found.fence_trouble
            == "fence read-back: fence item 0: circle radius 0 m; it must be greater than 0"
        )
        assert "circle radius 0 m" in why_no_plan(after(NEW, *read_back(bad, self.KIND)))

    @pytest.mark.parametrize("kind", [3, 255, 77])
    def test_list_kinds_that_are_none(self, kind: int) -> None:
        told = [
            *read_back(self.ITEMS, kind),
            *upload(self.ITEMS, kind, result=None),
            (STATION, m.MissionWritePartialList(*ROVER, 0, 1, kind)),
        ]
        assert after(NEW, *told) == NEW
        if kind != 255:
            assert (
                after(
                    NEW, (STATION, m.MissionClearAll(*ROVER, kind)), (ROVER, m.MissionAck(*STATION, 0, kind))
                )
                == NEW
            )

    @pytest.mark.parametrize("sender", [(2, 1), (255, 230)])
    def test_lists_of_and_to_other_vehicles(self, sender: tuple[int, int]) -> None:
        told = [
            (sender, replace(message, target_system=2))
            for _, message in upload(self.ITEMS, self.KIND, result=None)
        ]
        assert after(NEW, *told, ((2, 1), m.MissionAck(*STATION, 0, self.KIND))) == NEW

    def test_requests_to_everybody_count(self) -> None:
        told = [
            (STATION, replace(message, target_system=0))
            for _, message in upload(self.ITEMS, self.KIND, result=None)
        ]
        assert fence_of(after(NEW, *told, (ROVER, m.MissionAck(*STATION, 0, self.KIND)))) == FENCE


class TestMission:
    ITEMS = (waypoint(HOME), waypoint(THERE))

    def test_an_upload_lacks_home(self) -> None:
        found = after(replace(NEW, ardupilot=True), *upload(with_home(self.ITEMS, LatLon(1, 2)), 0))
        assert found.mission is not None
        assert found.mission.value == Mission(self.ITEMS)
        assert found.home is None

    def test_a_read_back_tells_home(self) -> None:
        found = after(replace(NEW, ardupilot=True), *read_back(with_home(self.ITEMS, HOME), 0))
        assert found.mission is not None
        assert found.mission.value == Mission(self.ITEMS, HOME)
        assert found.home is not None
        assert (found.home.value, found.home.source) == (HOME, "mission read-back, item 0")
        unset = after(NEW, *read_back(with_home(self.ITEMS, LatLon(0, 0)), 0))
        assert unset.home is None
        assert after(NEW, (ROVER, m.MissionCount(*STATION, 0, 0))).mission is not None

    def test_other_autopilots_keep_no_home_there(self) -> None:
        found = after(replace(NEW, ardupilot=False), *read_back(self.ITEMS, 0))
        assert found.mission is not None
        assert found.mission.value == Mission(self.ITEMS)
        assert found.home is None

    def test_an_accepted_upload_seen_in_part_makes_it_unknown(self) -> None:
        known = after(NEW, *upload(with_home(self.ITEMS, HOME), 0))
        told = upload(with_home(self.ITEMS[:1], HOME), 0)
        told.pop(1)
        assert after(known, *told).mission is None

    def test_repeated_items_after_the_end_open_nothing(self) -> None:
        known = after(NEW, *upload(with_home(self.ITEMS, HOME), 0))
        again = upload(with_home(self.ITEMS, HOME), 0)
        assert after(known, again[2], again[3]) == known
        acknowledged = after(known, again[1], again[3], again[-1])
        assert acknowledged.mission == known.mission

    def test_other_autopilots_repeat_items_too(self) -> None:
        known = after(replace(NEW, ardupilot=False), *upload(self.ITEMS, 0))
        assert after(known, upload(self.ITEMS, 0)[2]) == known
        assert after(known, upload(self.ITEMS, 0)[1]) == known

    def test_rally_points_accepted_but_seen_in_part_are_forgotten(self) -> None:
        items = (MissionItem(5100, 3, lat_e7=400726316, lon_e7=-1052290497),) * 2
        known = after(NEW, *upload(items, 2))
        assert known.rally is not None
        told = upload(items, 2)
        told.pop(1)
        assert after(known, *told).rally is None

    def test_rally_points(self) -> None:
        items = (
            MissionItem(5100, 3, lat_e7=400726316, lon_e7=-1052290497),
            MissionItem(5100, 3, lat_e7=2**31 - 1),
        )
        for told in (upload(items, 2), read_back(items, 2)):
            found = after(NEW, *told)
            assert found.rally is not None
            assert [point.position for point in found.rally.value] == [THERE]


class TestTarget:
    X, Y = 400726316, -1052290497

    @pytest.mark.parametrize("sender", [STATION, COMPANION, (245, 190)])
    @pytest.mark.parametrize("system", [0, 1])
    @pytest.mark.parametrize(
        ("make", "source"),
        [
            (lambda s: m.CommandInt(s, 1, 0, 192, x=TestTarget.X, y=TestTarget.Y), "DO_REPOSITION"),
            (lambda s: m.CommandInt(s, 1, 6, 192, -1, 1, 0, math.nan, TestTarget.X, TestTarget.Y, 5), "DO_REPOSITION"),
            (lambda s: m.CommandLong(s, 1, 192, param5=40.0726316, param6=-105.2290497), "DO_REPOSITION"),
            (lambda s: m.SetPositionTargetGlobalInt(0, s, 1, 6, 0b110111111000, TestTarget.X, TestTarget.Y, 0), "SET_POSITION_TARGET_GLOBAL_INT"),
            (lambda s: m.MissionItemInt(s, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, TestTarget.X, TestTarget.Y, 5), "MISSION_ITEM with current 2"),
            (lambda s: m.MissionItem(s, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, 40.0726316, -105.2290497, 5), "MISSION_ITEM with current 2"),
        ],
    )  # fmt: skip
    def test_every_way_to_send_one(self, sender: tuple[int, int], system: int, make, source: str) -> None:
        found = after(NEW, (sender, make(system)), since_s=7)
        assert found.target is not None
        assert (found.target.value, found.target.time_s, found.target.source) == (THERE, 7.0, source)
        assert not found.transfers

    @pytest.mark.parametrize(
        "message",
        [
            m.CommandInt(2, 1, 0, 192, x=X, y=Y),  # to another vehicle
            m.CommandInt(1, 1, 1, 192, x=X, y=Y),  # in a local frame
            m.CommandInt(1, 1, 0, 193, x=X, y=Y),  # another command
            m.CommandInt(1, 1, 0, 192),  # "here"
            m.CommandInt(1, 1, 0, 192, x=2**31 - 1, y=2**31 - 1),
            m.CommandLong(1, 1, 400, param1=1, param5=40, param6=-105),
            m.CommandLong(1, 1, 192),
            m.CommandLong(1, 1, 192, param5=math.nan, param6=math.nan),
            m.CommandLong(1, 1, 192, param5=91, param6=0),
            m.SetPositionTargetGlobalInt(0, 1, 1, 6, 0b1, X, Y, 0),  # to hold a speed only
            m.SetPositionTargetGlobalInt(0, 1, 1, 6, 0b10, X, Y, 0),
            m.SetPositionTargetGlobalInt(0, 1, 1, 1, 0, X, Y, 0),
            m.SetPositionTargetGlobalInt(0, 1, 1, 6, 0, 0, 0, 0),
            m.MissionItemInt(1, 1, 0, 1, 16, 2, 1, 0, 0, 0, 0, X, Y, 5),  # in a local frame
            m.MissionItemInt(1, 1, 0, 3, 16, 3, 1, 0, 0, 0, 0, X, Y, 5),  # a change of altitude
            m.MissionItem(1, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, math.nan, math.nan, 5),
        ],
    )
    def test_what_is_none(self, message: Message) -> None:
        assert after(NEW, (STATION, message)) == NEW

    def test_the_vehicles_own_words_are_no_request(self) -> None:
        assert after(NEW, (ROVER, m.CommandInt(0, 0, 0, 192, x=self.X, y=self.Y))) == NEW

    def test_a_guided_item_does_not_disturb_an_upload(self) -> None:
        items = fence_to_items(FENCE)
        told = upload(items, 1)
        told.insert(2, (STATION, m.MissionItemInt(1, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, self.X, self.Y, 5)))
        told.insert(3, (ROVER, m.MissionAck(*STATION, 0, 0)))
        found = after(NEW, *told)
        assert fence_of(found) == FENCE
        assert found.target is not None


def test_before_the_vehicle_is_known_its_system_is_believed() -> None:
    found = after(Situation(system=1), *read_back(fence_to_items(FENCE), 1))
    assert fence_of(found) == FENCE


small = st.integers(0, 4)
senders = st.sampled_from([ROVER, STATION, COMPANION, (2, 1), (0, 0)])
floats = st.floats(width=32)
int32 = st.integers(-(2**31), 2**31 - 1) | small
by_name = {
    "target_system": st.sampled_from([0, 1, 2, 255]),
    "target_component": st.sampled_from([0, 1, 190]),
    "seq": small, "count": small, "mission_type": st.sampled_from([0, 1, 1, 2, 255, 7]), "type": st.integers(0, 20),
    "frame": st.integers(0, 12), "coordinate_frame": st.integers(0, 12),
    "command": st.sampled_from([16, 17, 20, 192, 202, 5000, 5001, 5002, 5003, 5004, 5100, 65535]),
    "current": small, "autocontinue": small, "param1": floats | st.sampled_from([3.0, 4.0]),
    "text": st.text(max_size=50) | st.from_regex(r"ArduRover V[0-9]{1,3}\.[0-9]{1,3}", fullmatch=True),
    "capabilities": st.integers(0, 2**64 - 1), "flight_sw_version": st.integers(0, 2**32 - 1),
    "param_id": st.text(max_size=16), "autopilot": st.sampled_from([0, 3, 8, 12]), "type_mask": st.sampled_from([0, 1, 0xFFFF]),
    "base_mode": st.integers(0, 255), "custom_mode": st.integers(0, 2**32 - 1), "hdg": st.integers(0, 65535),
}  # fmt: skip


def any_message(message_class: type[Message]) -> st.SearchStrategy[Message]:
    old = message_class is m.MissionItem
    return st.builds(
        message_class,
        **{
            one.name: by_name.get(
                one.name, int32 if one.type == "int" and not (old and one.name in "xyz") else floats
            )
            for one in fields(message_class)
        },
    )


frames = st.builds(
    lambda sender, message: Frame(*sender, message),
    senders,
    st.one_of(*map(any_message, sorted(FOLDED, key=str)), any_message(m.Statustext)),
)


@given(st.lists(frames, max_size=40))
@settings(max_examples=250)
def test_no_stream_makes_fold_raise_or_believe_nonsense(stream: list[Frame]) -> None:
    situation = NEW
    for number, frame in enumerate(stream):
        before = situation
        situation = fold(situation, frame, float(number))
        if frame.system not in (0, 1, 255):
            assert getattr(frame.message, "target_system", None) in (0, 1) or situation == before
        for known in (situation.pose, situation.target, situation.home):
            if known is not None:
                place = known.value.position if isinstance(known.value, Pose) else known.value
                assert abs(place.lat_deg) <= 90
                assert abs(place.lon_deg) <= 180
                assert place != (0, 0)
        if situation.fence is not None:
            assert fence_to_items(situation.fence.value) is not None


class TestParametersAreParsed:
    """Only numbers become parameters, each decoded as its autopilot encodes it."""

    PX4, ARDUPILOT, OTHER = (m.Heartbeat(10, autopilot) for autopilot in (12, 3, 0))

    @staticmethod
    def bits(layout: str, value: int) -> float:
        return struct.unpack("<f", struct.pack(layout, value))[0]

    @pytest.mark.parametrize("came", [math.nan, math.inf, -math.inf])
    def test_what_is_no_number_is_none(self, came: float) -> None:
        found = after(NEW, (ROVER, m.ParamValue("FENCE_TYPE", came, 9, 1, 0)))
        assert dict(found.parameters) == {}
        assert dict(found.no_numbers) == {"FENCE_TYPE": str(came)}
        assert after(found, (ROVER, m.ParamValue("FENCE_TYPE", came, 9, 1, 0))) is found
        mended = after(found, (ROVER, m.ParamValue("FENCE_TYPE", 7.0, 9, 1, 0)))
        assert (dict(mended.parameters), dict(mended.no_numbers)) == ({"FENCE_TYPE": 7.0}, {})

    def test_what_was_known_before_stands(self) -> None:
        known = after(NEW, (ROVER, m.ParamValue("FENCE_TYPE", 4.0, 9, 1, 0)))
        found = after(known, (ROVER, m.ParamValue("FENCE_TYPE", math.nan, 9, 1, 0)))
        assert dict(found.parameters) == {"FENCE_TYPE": 4.0}
        assert dict(found.no_numbers) == {"FENCE_TYPE": "nan"}

    @pytest.mark.parametrize(
        ("kind", "layout", "value"),
        [(1, "<Bxxx", 200), (2, "<bxxx", -7), (3, "<Hxx", 40_000), (4, "<hxx", -300), (5, "<I", 2**31), (6, "<i", -1),
         (6, "<i", 6), (6, "<i", 1_077_936_128)],
    )  # fmt: skip
    def test_px4_sends_bits(self, kind: int, layout: str, value: int) -> None:
        told = m.ParamValue("GF_ACTION", self.bits(layout, value), kind, 1, 0)
        assert dict(after(NEW, (ROVER, self.PX4), (ROVER, told)).parameters) == {"GF_ACTION": value}

    def test_px4_sends_real_numbers_as_they_are(self) -> None:
        told = m.ParamValue("NAV_ACC_RAD", 0.5, 9, 1, 0)
        assert dict(after(NEW, (ROVER, self.PX4), (ROVER, told)).parameters) == {"NAV_ACC_RAD": 0.5}

    @pytest.mark.parametrize("capabilities", [0, 16, 131072])
    def test_ardupilot_casts_and_px4_does_not_whatever_else_they_say(self, capabilities: int) -> None:
        told = m.ParamValue("FENCE_TYPE", 7.0, 2, 1, 0)
        says = m.AutopilotVersion(capabilities)
        assert after(NEW, (ROVER, says), (ROVER, self.ARDUPILOT), (ROVER, told)).parameters["FENCE_TYPE"] == 7
        told = m.ParamValue("GF_ACTION", self.bits("<i", 2), 6, 1, 0)
        assert after(NEW, (ROVER, self.PX4), (ROVER, says), (ROVER, told)).parameters["GF_ACTION"] == 2

    def test_of_others_their_capabilities_count(self) -> None:
        told = (ROVER, m.ParamValue("A", self.bits("<i", 2), 6, 1, 0))
        bytewise = after(NEW, (ROVER, self.OTHER), (ROVER, m.AutopilotVersion(16)), told)
        assert bytewise.parameters["A"] == 2
        cast = after(NEW, (ROVER, self.OTHER), (ROVER, m.AutopilotVersion(131072)), told)
        assert cast.parameters["A"] == self.bits("<i", 2)


class TestFirmware:
    """The version is told by AUTOPILOT_VERSION, or by ArduPilot's banner."""

    @pytest.mark.parametrize(
        ("message", "firmware"),
        [
            (m.AutopilotVersion(0, 0x040507FF), Firmware(4, 5, 7)),
            (m.AutopilotVersion(0, 0x04070000), Firmware(4, 7, 0, 0)),
            (m.AutopilotVersion(0, 0), None),
            (m.Statustext(6, "ArduRover V4.5.7 (0358a9c2)"), Firmware(4, 5, 7)),
            (m.Statustext(6, "ArduRover V4.7.0-dev (ee3f6ed6)"), Firmware(4, 7, 0, 0)),
            (m.Statustext(6, "ArduRover V4.6 beta"), Firmware(4, 6, 0, 128)),
            (m.Statustext(6, "I like ArduRover V4.5.7"), None),
            (m.Statustext(6, "ArduRover V"), None),
        ],
    )
    def test_it_is_read(self, message: m.Message, firmware: Firmware | None) -> None:
        assert after(NEW, (ROVER, message)).firmware == firmware
        assert after(NEW, (STATION, message)).firmware is None


class TestPx4:
    """What PX4 does not drive to is no target, and its missions have no home item."""

    BEAT = m.Heartbeat(10, 12)

    def test_targets(self) -> None:
        target = m.SetPositionTargetGlobalInt(0, 1, 1, 6, 0xFF8, 400_000_000, -1_050_000_000, 0.0)
        guided = m.MissionItemInt(1, 1, 0, 6, 16, 2, 1, 0.0, 0.0, 0.0, 0.0, 400_000_000, -1_050_000_000, 0.0)
        for message in (target, guided):
            assert after(NEW, (ROVER, m.Heartbeat(10, 3)), (STATION, message)).target is not None
            assert after(NEW, (ROVER, self.BEAT), (STATION, message)).target is None
        reposition = m.CommandInt(1, 1, 0, 192, -1.0, 1.0, x=400_000_000, y=-1_050_000_000)
        assert after(NEW, (ROVER, self.BEAT), (STATION, reposition)).target is not None

    def test_the_first_item_is_an_item(self) -> None:
        item = m.MissionItemInt(
            255, 230, 0, 6, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, 400_000_000, -1_050_000_000, 0.0
        )
        found = after(NEW, (ROVER, self.BEAT), (ROVER, m.MissionCount(255, 230, 1)), (ROVER, item))
        assert found.mission is not None
        assert (len(found.mission.value.items), found.mission.value.home) == (1, None)
        again = after(found, (ROVER, item))
        assert again.transfers == {}
