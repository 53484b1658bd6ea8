"""The measured tables "mission item sent" and "fence sent", and the limits of the fence."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from simulator.station import HOME, Bench, at, kept, line, placed, square, vertex

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.simulator import SimulatorConfig
from missions.geo import LatLon
from missions.items import Command, CoordinateFrame, MissionItem, waypoint

NAN, INF = math.nan, math.inf
GOOD = kept(waypoint(at(10, 0)))


def with_param(item: MissionItem, number: int, value: float) -> MissionItem:
    params = list(item.params)
    params[number - 1] = value
    return replace(item, params=tuple(params))


REFUSED = [
    ("an unknown command", replace(GOOD, command=31_999), "UNSUPPORTED"),
    ("a fence vertex", vertex(HOME, 4), "UNSUPPORTED"),
    ("LOCAL_NED", replace(GOOD, frame=1), "UNSUPPORTED_FRAME"),
    ("an unknown frame", replace(GOOD, frame=99), "UNSUPPORTED_FRAME"),
    ("latitude 91", replace(GOOD, lat_e7=910_000_000), "INVALID_PARAM5_X"),
    ("longitude 181", replace(GOOD, lon_e7=-1_810_000_000), "INVALID_PARAM6_Y"),
    ("z NaN", replace(GOOD, alt_m=NAN), "INVALID_PARAM7"),
    ("z inf", replace(GOOD, alt_m=INF), "INVALID_PARAM7"),
    ("z too large", replace(GOOD, alt_m=1e6), "INVALID_PARAM7"),
    ("param1 NaN", with_param(GOOD, 1, NAN), "INVALID_PARAM1"),
    ("param1 inf", with_param(GOOD, 1, INF), "INVALID_PARAM1"),
    ("param2 NaN", with_param(GOOD, 2, NAN), "INVALID_PARAM2"),
    ("param3 NaN", with_param(GOOD, 3, NAN), "INVALID_PARAM3"),
    ("jump to home", with_param(replace(GOOD, command=Command.DO_JUMP), 1, 0), "ERROR"),
    ("jump past the end", with_param(replace(GOOD, command=Command.DO_JUMP), 1, 4), "ERROR"),
]


@pytest.mark.parametrize(("what", "item", "result"), REFUSED, ids=[row[0] for row in REFUSED])
def test_a_bad_mission_item_ends_the_upload(what, item, result):
    bench = Bench(SimulatorConfig(streams=False, mission=line(9)))
    new = kept(waypoint(at(0, 33)))
    found, _ = bench.upload_mission([new, item, GOOD])
    assert found == MissionResult[result]
    # What was written before it stays, what it would have replaced too; the list is cut to the announced count.
    assert bench.vehicle.mission[1:] == (new, *line(9)[1:3])
    answers = bench.ask(bench.item(3, GOOD))
    assert [answer.type for answer in answers] == [MissionResult.ERROR]


ACCEPTED = [
    with_param(GOOD, 4, NAN),
    replace(GOOD, lat_e7=0, lon_e7=0),
    replace(GOOD, command=Command.NAV_TAKEOFF),
    replace(GOOD, command=Command.NAV_LAND),
    replace(GOOD, command=Command.NAV_RETURN_TO_LAUNCH),
    replace(GOOD, command=Command.NAV_LOITER_TIME),
    with_param(replace(GOOD, command=Command.DO_CHANGE_SPEED), 2, 3.0),
    with_param(replace(GOOD, command=Command.DO_SET_REVERSE), 1, 1.0),
    with_param(replace(GOOD, command=Command.DO_JUMP), 1, 1.0),
    with_param(replace(GOOD, command=Command.CONDITION_DELAY), 1, 2.5),
]


@pytest.mark.parametrize("item", ACCEPTED, ids=lambda item: f"{item.command}")
def test_these_are_accepted(item):
    bench = Bench()
    assert bench.upload_mission([item, GOOD])[0] == MissionResult.ACCEPTED
    assert len(bench.vehicle.mission) == 3
    assert all(not math.isnan(param) for param in bench.vehicle.mission[1].params)


@pytest.mark.parametrize(
    ("sent", "read"),
    [(6, 3), (3, 3), (5, 0), (0, 0), (2, 0), (10, 10), (11, 10)],
)
def test_frames_read_back_as_3_0_or_10(sent, read):
    bench = Bench()
    bench.upload_mission([replace(GOOD, frame=sent)])
    assert bench.download()[1].frame == read


def test_the_acceptance_radius_is_dropped_and_the_delay_is_whole():
    bench = Bench()
    item = replace(GOOD, params=(3.7, 2.5, 1.0, 45.0), alt_m=12.3456)
    bench.upload_mission([item])
    read = bench.download()[1]
    assert (read.param1, read.param2, read.param3, read.param4) == (3.0, 0.0, 0.0, 0.0)
    assert read.z == pytest.approx(12.34, abs=1e-5)
    assert (read.current, read.autocontinue) == (0, 1)


@pytest.mark.parametrize(
    ("command", "sent", "read"),
    [
        (Command.NAV_LOITER_UNLIM, (1.0, 2.0, -12.7, 4.0), (0.0, 0.0, -12.0, 0.0)),
        (Command.NAV_LOITER_TURNS, (2.7, 2.0, 9.9, 1.0), (2.0, 0.0, 9.0, 1.0)),
        (Command.NAV_LOITER_TURNS, (0.7, 2.0, -304.0, 0.0), (0.69921875, 0.0, -300.0, 0.0)),
        (Command.NAV_LOITER_TURNS, (900.0, 2.0, 9000.0, 0.0), (255.0, 0.0, 2550.0, 0.0)),
        (Command.NAV_LOITER_TIME, (70.7, 2.0, -12.0, 1.0), (70.0, 0.0, -1.0, 1.0)),
        (Command.NAV_LOITER_TIME, (70.7, 2.0, 0.0, 0.0), (70.0, 0.0, 1.0, 0.0)),
        (Command.NAV_LAND, (1.0, 2.0, 3.0, -4.0), (1.0, 0.0, 0.0, -1.0)),
        (Command.NAV_LAND, (1.0, 2.0, 3.0, NAN), (1.0, 0.0, 0.0, 1.0)),
    ],
)
def test_loiters_keep_radius_and_direction(command, sent, read):
    bench = Bench()
    bench.upload_mission([replace(GOOD, command=command, params=sent)])
    back = bench.download()[1]
    assert (back.param1, back.param2, back.param3, back.param4) == read


def test_commands_without_a_place_keep_their_parameters():
    bench = Bench()
    speed = MissionItem(Command.DO_CHANGE_SPEED, 3, (1.0, 2.3, -1.0, 9.0), 5, 6, 7.0)
    jump = MissionItem(Command.DO_JUMP, 3, (1.0, -1.0, 0.0, 0.0))
    bench.upload_mission([GOOD, speed, jump])
    _, _, speed_read, jump_read = bench.download()
    assert (speed_read.param1, speed_read.param3, speed_read.param4) == (1.0, -1.0, 0.0)
    assert speed_read.param2 == pytest.approx(2.3, abs=1e-6)
    assert (speed_read.x, speed_read.y, speed_read.z, speed_read.frame) == (0, 0, 0.0, 0)
    assert (jump_read.param1, jump_read.param2) == (1.0, -1.0)


def test_current_2_inside_an_upload_blocks_it_until_it_times_out():
    bench = Bench()
    bench.count(3)
    bench.ask(bench.item(0, GOOD))
    begin_s = bench.now_s
    while bench.now_s - begin_s < 9.0:
        bench.ask(bench.item(1, GOOD, current=2))
    results = [ack.type for ack in bench.of(m.MissionAck)]
    assert results[0] == MissionResult.ERROR
    assert results.count(MissionResult.OPERATION_CANCELLED) == 1
    assert "Mission upload timeout" in bench.texts()


def test_current_2_is_a_guided_target_only_in_guided():
    bench = Bench()
    assert [ack.type for ack in bench.ask(bench.item(0, GOOD, current=2))] == [MissionResult.ERROR]
    bench.command(Command.DO_SET_MODE, 1, 15)
    bench.command(Command.COMPONENT_ARM_DISARM, 1)
    answers = bench.ask(bench.item(0, GOOD, current=2))
    assert [ack.type for ack in answers if isinstance(ack, m.MissionAck)] == [MissionResult.ACCEPTED]
    bench.run_until(lambda: bench.of(m.MissionItemReached), 30.0)
    assert bench.vehicle.position.lat_deg == pytest.approx(at(10, 0).lat_deg, abs=3e-5)


def test_a_guided_target_of_floats_is_taken():
    bench = Bench()
    bench.command(Command.DO_SET_MODE, 1, 15)
    position = at(10, 0)
    item = m.MissionItem(1, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, position.lat_deg, position.lon_deg, 0.0)
    assert [ack.type for ack in bench.ask(item)] == [MissionResult.ACCEPTED]
    assert bench.vehicle.rover.destination.lat_deg == pytest.approx(position.lat_deg, abs=1e-6)


TRIANGLE = [vertex(at(n, e), 3) for n, e in ((50, 0), (60, 0), (55, 8))]
CIRCLE = placed(Command.FENCE_CIRCLE_EXCLUSION, at(0, 30), 5.0)
RETURN = placed(Command.FENCE_RETURN_POINT, HOME)
BAD_FENCES = [
    ([vertex(at(50, 0), 2), vertex(at(60, 0), 2)], "Invalid vertex count (2)"),
    ([vertex(at(50, 0), NAN), *TRIANGLE[1:]], "Invalid vertex count (0)"),
    ([*TRIANGLE[:2], vertex(at(55, 8), 4)], "Unexpected vertex count want=3 got=4"),
    (TRIANGLE[:2], "Incorrect item count"),
    (
        [*TRIANGLE[:2], vertex(at(55, 8), 3, inclusion=True)],
        "Received incorrect vertex type (want=97 got=98)",
    ),
    ([*TRIANGLE[:2], CIRCLE], "Received incorrect type (want=97 got=93)"),
    ([*TRIANGLE[:2], replace(TRIANGLE[2], lat_e7=910_000_000)], "Bad lat or lon"),
    ([with_param(CIRCLE, 1, 0.0)], "Non-positive circle radius"),
    ([with_param(CIRCLE, 1, -3.0)], "Non-positive circle radius"),
    ([with_param(CIRCLE, 1, NAN)], "Non-positive circle radius"),
    ([replace(CIRCLE, lon_e7=1_900_000_000)], "Bad lat or lon"),
    ([RETURN, *TRIANGLE, RETURN], "Multiple return points"),
]


@pytest.mark.parametrize(
    ("fence", "reason"), BAD_FENCES, ids=[row[1] + str(len(row[0])) for row in BAD_FENCES]
)
def test_a_bad_fence_is_refused_with_the_reason_and_the_old_one_kept(fence, reason):
    bench = Bench(SimulatorConfig(streams=False, fence=tuple(square(80, 0))))
    before = bench.vehicle.fence
    result, texts = bench.upload(fence, MissionType.FENCE)
    assert result == MissionResult.ERROR
    assert texts == [reason, "Fence validation failed"]
    assert bench.vehicle.fence == before


@pytest.mark.parametrize(
    ("item", "result"),
    [
        (vertex(at(50, 0), 256), "INVALID_PARAM1"),
        (replace(TRIANGLE[0], frame=CoordinateFrame.LOCAL_NED), "UNSUPPORTED_FRAME"),
        (replace(TRIANGLE[0], frame=CoordinateFrame.MISSION), "UNSUPPORTED_FRAME"),
        (GOOD, "UNSUPPORTED"),
    ],
)
def test_a_bad_fence_item_ends_the_upload(item, result):
    bench = Bench()
    assert bench.upload([item, *TRIANGLE[1:]], MissionType.FENCE)[0] == MissionResult[result]


GOOD_FENCES = {
    "bow tie": [vertex(at(n, e), 4) for n, e in ((50, 0), (60, 10), (60, 0), (50, 10))],
    "duplicate vertex": [vertex(at(n, e), 4) for n, e in ((50, 0), (50, 0), (60, 0), (60, 10))],
    "zero area": [vertex(at(n, 0), 3) for n in (50, 60, 70)],
    "radius inf": [with_param(CIRCLE, 1, INF)],
    "z and params NaN": [replace(item, params=(3.0, NAN, NAN, NAN), alt_m=NAN) for item in TRIANGLE],
    "param1 4.9": [with_param(item, 1, 4.9) for item in square(50, 0)],
    "relative altitude": [replace(item, frame=3) for item in TRIANGLE],
    "a return point": [*TRIANGLE, RETURN],
}


@pytest.mark.parametrize("fence", GOOD_FENCES.values(), ids=GOOD_FENCES)
def test_these_fences_are_accepted(fence):
    bench = Bench()
    assert bench.upload(fence, MissionType.FENCE) == (MissionResult.ACCEPTED, [])
    read = bench.download(MissionType.FENCE)
    assert [item.command for item in read] == [item.command for item in fence]
    assert {(item.frame, item.z, item.param2, item.param3, item.param4) for item in read} == {(0, 0, 0, 0, 0)}
    if fence is GOOD_FENCES["param1 4.9"]:
        assert {item.param1 for item in read} == {4.0}


def polygon(count: int) -> list[MissionItem]:
    ring = [
        at(100 + 30 * math.cos(math.tau * i / count), 30 * math.sin(math.tau * i / count))
        for i in range(count)
    ]
    return [vertex(position, count) for position in ring]


@pytest.mark.parametrize(
    ("fence", "fits"),
    [
        (polygon(83), True),
        (polygon(84), False),
        (TRIANGLE * 25, True),
        (TRIANGLE * 26, False),
        ([CIRCLE] * 51, True),
        ([CIRCLE] * 52, False),
        ([*polygon(82), RETURN], True),
        ([*polygon(83), RETURN], False),
    ],
)
def test_the_fence_holds_672_bytes(fence, fits):
    bench = Bench()
    result, texts = bench.upload(fence, MissionType.FENCE)
    if fits:
        assert (result, texts) == (MissionResult.ACCEPTED, [])
    else:
        assert (result, texts) == (MissionResult.ERROR, ["Fence exceeds storage size"])
        assert bench.vehicle.fence == ()


def test_lists_are_counted_in_parameters():
    bench = Bench()
    bench.upload_mission(line(3))
    bench.upload(square(50, 0), MissionType.FENCE)
    told = {message.param_id: message.param_value for message in bench.of(m.ParamValue)}
    assert told == {"MIS_TOTAL": 4.0, "FENCE_TOTAL": 6.0}


RALLY = placed(Command.RALLY_POINT, at(20, 20))


@pytest.mark.parametrize(
    ("item", "result"),
    [
        (kept(RALLY), "ACCEPTED"),
        (RALLY, "UNSUPPORTED_FRAME"),
        (GOOD, "UNSUPPORTED"),
        (replace(kept(RALLY), lat_e7=910_000_000), "INVALID_PARAM5_X"),
        (replace(kept(RALLY), alt_m=40_000.0), "INVALID_PARAM7"),
    ],
)
def test_rally_points(item, result):
    bench = Bench()
    assert bench.upload([item], MissionType.RALLY)[0] == MissionResult[result]
    if result == "ACCEPTED":
        (read,) = bench.download(MissionType.RALLY)
        assert (read.command, read.frame, read.x, read.autocontinue) == (5100, 3, item.lat_e7, 0)


def test_what_the_configuration_holds_is_judged_as_an_upload():
    from mavlink_bridge.errors import RefusedError

    cases = [
        (SimulatorConfig(mission=(vertex(HOME, 3),)), "item 1 is refused: UNSUPPORTED"),
        (SimulatorConfig(fence=tuple(TRIANGLE[:2])), "Incorrect item count"),
        (SimulatorConfig(mission=line(655)), "656 items; the vehicle holds 655"),
    ]
    for config, message in cases:
        with pytest.raises(RefusedError, match=message):
            Bench(config)


def test_a_place_at_the_pole_is_a_place():
    bench = Bench()
    assert bench.upload_mission([kept(waypoint(LatLon(90.0, 180.0)))])[0] == MissionResult.ACCEPTED
