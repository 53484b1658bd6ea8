"""Messages folded into a situation: the one way from a live link, a log and the simulator to what is known.

`fold` is pure: a situation and a frame give the next situation. It believes the vehicle's own words (its acknowledgements, its
read-backs) and takes what others send to it as requests.
"""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilot_facts import with_autopilot, with_banner, with_parameter, with_version
from mavlink_bridge.mavlink.autopilots import AutopilotTable, autopilot_of
from mavlink_bridge.mavlink.parameter_values import parameter_value
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.mavlink.vehicles import is_vehicle
from mavlink_bridge.protocol.wire import item_from_message, mission_result
from missions.errors import FenceError, InvalidPositionError
from missions.fence import fence_from_items, fence_to_items
from missions.geo import LatLon, checked_lat_lon, from_e7
from missions.items import Command, CoordinateFrame, MissionItem, without_home
from missions.rally import rally_from_items
from missions.situation import Fix, Known, ListKind, ListTransfer, Mission, Pose, Situation

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from mavlink_bridge.mavlink.messages import Frame, Message

KINDS: dict[int, ListKind] = {
    m.MissionType.MISSION: ListKind.MISSION,
    m.MissionType.FENCE: ListKind.FENCE,
    m.MissionType.RALLY: ListKind.RALLY,
}
"""The list that a mission_type stands for."""


class TargetMessage(StrEnum):
    """What carries a target to the vehicle; the source of what is known of it."""

    REPOSITION = "DO_REPOSITION"
    POSITION_TARGET = "SET_POSITION_TARGET_GLOBAL_INT"
    GUIDED_ITEM = "MISSION_ITEM with current 2"


_GLOBAL_FRAMES = frozenset(
    {
        CoordinateFrame.GLOBAL,
        CoordinateFrame.GLOBAL_RELATIVE_ALT,
        CoordinateFrame.GLOBAL_INT,
        CoordinateFrame.GLOBAL_RELATIVE_ALT_INT,
        CoordinateFrame.GLOBAL_TERRAIN_ALT,
        CoordinateFrame.GLOBAL_TERRAIN_ALT_INT,
    }
)
_IGNORE_X_OR_Y = 0b11  # POSITION_TARGET_TYPEMASK_X_IGNORE and _Y_IGNORE
# MISSION_ITEM.current outside a mission: go there; change the altitude.
_GUIDED_TARGET, _GUIDED_ALTITUDE = 2, 3
_HEADING_UNKNOWN = 65535  # UINT16_MAX, as GLOBAL_POSITION_INT.hdg is defined


def fold(situation: Situation, frame: Frame, time_s: float) -> Situation:
    """Return the situation after a frame.

    Parameters
    ----------
    situation : Situation
        What is known so far, with the ``system`` of the vehicle that it is about.
    frame : Frame
        What was heard; frames of and to other vehicles change nothing.
    time_s : float
        When.
    """
    if _is_the_vehicles(situation, frame):
        told = _TOLD.get(type(frame.message))
        return told(situation, frame, time_s) if told else situation
    asked = _ASKED.get(type(frame.message))
    if asked is None or getattr(frame.message, "target_system", 0) not in (0, situation.system):
        return situation
    return asked(situation, frame.message, time_s)


# What the vehicle reports.


def _is_the_vehicles(situation: Situation, frame: Frame) -> bool:
    """Return whether a frame comes from the autopilot itself; companions share its system id, and what they send are requests."""
    if frame.system != situation.system:
        return False
    return situation.component in (None, frame.component) or isinstance(frame.message, m.ParamValue)


def _heartbeat(situation: Situation, frame: Frame, time_s: float) -> Situation:
    heartbeat = frame.message
    assert isinstance(heartbeat, m.Heartbeat)
    if not is_vehicle(heartbeat):
        return situation
    after = replace(
        with_autopilot(situation, heartbeat.autopilot),
        component=frame.component,
        vehicle_type=heartbeat.type,
        mode=heartbeat.custom_mode,
        armed=bool(heartbeat.base_mode & m.ModeFlag.SAFETY_ARMED),
    )
    if _rolls(after) == _rolls(situation):
        return after
    return replace(after, stops=after.stops.begun(time_s) if _rolls(after) else after.stops.ended())


def _rolls(situation: Situation) -> bool:
    """Return whether the motors do nothing, so that what moves rolls (ArduPilot's HOLD does not brake)."""
    return situation.armed is False or situation.mode == Mode.HOLD


def _param_value(situation: Situation, frame: Frame, _time_s: float) -> Situation:
    """Take a parameter; ground stations write those they fetched by MAVFTP under components of their own."""
    message = frame.message
    assert isinstance(message, m.ParamValue)
    return with_parameter(
        situation, message.param_id, parameter_value(message, bytewise=bool(situation.bytewise))
    )


def _autopilot_version(situation: Situation, frame: Frame, _time_s: float) -> Situation:
    assert isinstance(frame.message, m.AutopilotVersion)
    return with_version(situation, frame.message)


def _text(situation: Situation, frame: Frame, _time_s: float) -> Situation:
    assert isinstance(frame.message, m.Statustext)
    return with_banner(situation, frame.message.text)


def _global_position(situation: Situation, frame: Frame, time_s: float) -> Situation:
    message = frame.message
    assert isinstance(message, m.GlobalPositionInt)
    position = _place(message.lat, message.lon)
    if position is None:
        return situation
    heading_deg = None if message.hdg == _HEADING_UNKNOWN else message.hdg / 100
    pose = Pose(position, heading_deg, (message.vy / 100, message.vx / 100))
    stops = situation.stops.moved(position, pose.speed_mps, time_s)
    return replace(situation, pose=Known(pose, time_s, "GLOBAL_POSITION_INT"), stops=stops)


def _gps_raw(situation: Situation, frame: Frame, time_s: float) -> Situation:
    message = frame.message
    assert isinstance(message, m.GpsRawInt)
    fix = Fix(message.fix_type, message.h_acc / 1000 if message.h_acc else None)
    if situation.fix is not None and situation.fix.value == fix:
        return situation
    return replace(situation, fix=Known(fix, time_s, "GPS_RAW_INT"))


def _home_position(situation: Situation, frame: Frame, time_s: float) -> Situation:
    message = frame.message
    assert isinstance(message, m.HomePosition)
    home = _place(message.latitude, message.longitude)
    return replace(situation, home=Known(home, time_s, "HOME_POSITION")) if home else situation


def _read_back_count(situation: Situation, frame: Frame, time_s: float) -> Situation:
    message = frame.message
    assert isinstance(message, m.MissionCount)
    return _begin(situation, message, time_s, to_vehicle=False)


def _read_back_item(situation: Situation, frame: Frame, time_s: float) -> Situation:
    return _add_item(situation, frame.message, time_s, to_vehicle=False)


def _acknowledged(situation: Situation, frame: Frame, time_s: float) -> Situation:
    """Close an upload: taken over if the vehicle accepted it and every item was seen."""
    message = frame.message
    assert isinstance(message, m.MissionAck)
    for kind in kinds_of(message.mission_type):
        transfer = situation.transfers.get((kind, True))
        if transfer is None or message.type == m.MissionResult.INVALID_SEQUENCE:
            continue
        if message.type != m.MissionResult.ACCEPTED:
            situation = _refused(situation, kind, transfer, message.type)
        elif transfer.is_complete:
            situation = _take_over(situation, kind, transfer, time_s)
        else:  # accepted without our having seen it all: what we knew is stale
            situation = _forgotten(situation, kind)
    return situation


def _refused(situation: Situation, kind: ListKind, transfer: ListTransfer, result: int) -> Situation:
    situation = _without_transfer(situation, kind, to_vehicle=True)
    if kind is not ListKind.FENCE or transfer.count is None:
        return situation
    known = mission_result(result)
    name = known.name if known is not None else str(result)
    return _with_fence_trouble(situation, f"fence upload: the vehicle refused it ({name})")


def _with_fence_trouble(situation: Situation, trouble: str | None) -> Situation:
    return replace(situation, reading=replace(situation.reading, fence_trouble=trouble))


def _forgotten(situation: Situation, kind: ListKind) -> Situation:
    if kind is ListKind.FENCE:
        return replace(situation, fence=None)
    if kind is ListKind.RALLY:
        return replace(situation, rally=None)
    return replace(situation, mission=None)


# What others ask of the vehicle.


def _upload_count(situation: Situation, message: Message, time_s: float) -> Situation:
    assert isinstance(message, m.MissionCount)
    return _begin(situation, message, time_s, to_vehicle=True)


def _upload_item(situation: Situation, message: Message, time_s: float) -> Situation:
    assert isinstance(message, (m.MissionItem, m.MissionItemInt))
    if message.current in (_GUIDED_TARGET, _GUIDED_ALTITUDE):
        is_ignored = message.current == _GUIDED_ALTITUDE or message.frame not in _GLOBAL_FRAMES
        if is_ignored or not _autopilot(situation).goes_to_guided_items:
            return situation
        item = item_from_message(message)
        return _targeted(situation, _place(item.lat_e7, item.lon_e7), time_s, TargetMessage.GUIDED_ITEM)
    return _add_item(situation, message, time_s, to_vehicle=True)


def _clear(situation: Situation, message: Message, _time_s: float) -> Situation:
    assert isinstance(message, m.MissionClearAll)
    for kind in kinds_of(message.mission_type):
        situation = _with_transfer(situation, kind, ListTransfer(to_vehicle=True, count=0, items={}))
    return situation


def _partial_write(situation: Situation, message: Message, _time_s: float) -> Situation:
    kind = _kind(message)
    return _with_transfer(situation, kind, ListTransfer(True, None, {})) if kind else situation


def _command_int(situation: Situation, message: Message, time_s: float) -> Situation:
    assert isinstance(message, m.CommandInt)
    if message.command != Command.DO_REPOSITION or message.frame not in _GLOBAL_FRAMES:
        return situation
    return _targeted(situation, _place(message.x, message.y), time_s, TargetMessage.REPOSITION)


def _command_long(situation: Situation, message: Message, time_s: float) -> Situation:
    assert isinstance(message, m.CommandLong)
    if message.command != Command.DO_REPOSITION:
        return situation
    try:
        position = checked_lat_lon(message.param5, message.param6)
    except InvalidPositionError:
        return situation
    return _targeted(situation, position if position != (0, 0) else None, time_s, TargetMessage.REPOSITION)


def _position_target(situation: Situation, message: Message, time_s: float) -> Situation:
    assert isinstance(message, m.SetPositionTargetGlobalInt)
    if not _autopilot(situation).goes_to_position_targets:
        return situation
    if message.type_mask & _IGNORE_X_OR_Y or message.coordinate_frame not in _GLOBAL_FRAMES:
        return situation
    position = _place(message.lat_int, message.lon_int)
    return _targeted(situation, position, time_s, TargetMessage.POSITION_TARGET)


_TOLD: dict[type[Message], Callable[[Situation, Frame, float], Situation]] = {
    m.Heartbeat: _heartbeat,
    m.ParamValue: _param_value,
    m.AutopilotVersion: _autopilot_version,
    m.Statustext: _text,
    m.GlobalPositionInt: _global_position,
    m.GpsRawInt: _gps_raw,
    m.HomePosition: _home_position,
    m.MissionCount: _read_back_count,
    m.MissionItem: _read_back_item,
    m.MissionItemInt: _read_back_item,
    m.MissionAck: _acknowledged,
}
_ASKED: dict[type[Message], Callable[[Situation, Message, float], Situation]] = {
    m.MissionCount: _upload_count,
    m.MissionItem: _upload_item,
    m.MissionItemInt: _upload_item,
    m.MissionClearAll: _clear,
    m.MissionWritePartialList: _partial_write,
    m.CommandInt: _command_int,
    m.CommandLong: _command_long,
    m.SetPositionTargetGlobalInt: _position_target,
}
FOLDED = frozenset({*_TOLD, *_ASKED})
"""The message types that `fold` looks at."""


# Lists on their way.


def _begin(situation: Situation, message: m.MissionCount, time_s: float, *, to_vehicle: bool) -> Situation:
    kind = _kind(message)
    if kind is None:
        return situation
    transfer = ListTransfer(to_vehicle, message.count, {})
    if transfer.is_complete and not to_vehicle:  # an empty list needs no items
        return _take_over(situation, kind, transfer, time_s)
    return _with_transfer(situation, kind, transfer)


def _add_item(situation: Situation, message: Any, time_s: float, *, to_vehicle: bool) -> Situation:  # noqa: ANN401 - either item message
    kind = _kind(message)
    if kind is None:
        return situation
    item = item_from_message(message)
    known = situation.transfers.get((kind, to_vehicle))
    if known is None:
        if _is_held(situation, kind, message.seq, item):  # repeated after the end
            return situation
        known = ListTransfer(to_vehicle, None, {})
    transfer = replace(known, items={**known.items, message.seq: item})
    if transfer.is_complete and not to_vehicle:
        return _take_over(situation, kind, transfer, time_s)
    return _with_transfer(situation, kind, transfer)


def _is_held(situation: Situation, kind: ListKind, seq: int, item: MissionItem) -> bool:
    """Return whether an item is one that the vehicle is known to hold there."""
    held: tuple[MissionItem, ...] = ()
    if kind is ListKind.FENCE and situation.fence is not None:
        held = fence_to_items(situation.fence.value)
    elif kind is ListKind.MISSION and situation.mission is not None:
        held = situation.mission.value.items
        if _has_home_item(situation):  # home, which is the vehicle's own, stands before them
            held = (item, *held)
    return seq < len(held) and _core(held[seq]) == _core(item)


def _core(item: MissionItem) -> tuple[int, float, int, int]:
    return item.command, item.params[0], item.lat_e7, item.lon_e7


def _with_transfer(situation: Situation, kind: ListKind, transfer: ListTransfer) -> Situation:
    return _with_transfers(situation, {**situation.transfers, (kind, transfer.to_vehicle): transfer})


def _without_transfer(situation: Situation, kind: ListKind, *, to_vehicle: bool) -> Situation:
    transfers = {key: value for key, value in situation.transfers.items() if key != (kind, to_vehicle)}
    return _with_transfers(situation, transfers)


def _with_transfers(
    situation: Situation, transfers: Mapping[tuple[ListKind, bool], ListTransfer]
) -> Situation:
    reading = replace(situation.reading, transfers=MappingProxyType(transfers))
    return replace(situation, reading=reading)


def _take_over(situation: Situation, kind: ListKind, transfer: ListTransfer, time_s: float) -> Situation:
    source = f"{kind} {'upload' if transfer.to_vehicle else 'read-back'}"
    return with_list(situation, kind, transfer.in_order(), time_s, source, tells_home=not transfer.to_vehicle)


def with_list(
    situation: Situation,
    kind: ListKind,
    items: tuple[MissionItem, ...],
    time_s: float,
    source: str,
    *,
    tells_home: bool = True,
) -> Situation:
    """Make a complete list what the vehicle holds.

    Parameters
    ----------
    situation : Situation
        What is known so far.
    kind : ListKind
        Which list.
    items : tuple of MissionItem
        The list as it goes over the wire, for an ArduPilot mission with home at 0.
    time_s, source
        When and from what it is known.
    tells_home : bool
        Whether item 0 of a mission is the vehicle's report of its home (not in an upload: what is sent there is not stored).
    """
    # A finished transfer settles what half-seen ones before it left open.
    for to_vehicle in (True, False):
        situation = _without_transfer(situation, kind, to_vehicle=to_vehicle)
    if kind is ListKind.FENCE:
        return _with_fence(situation, items, time_s, source)
    if kind is ListKind.RALLY:
        placed = [item for item in items if _place(item.lat_e7, item.lon_e7)]
        return replace(situation, rally=Known(rally_from_items(placed), time_s, source))
    return _with_mission(situation, items, time_s, source, tells_home=tells_home)


def _with_fence(
    situation: Situation, items: tuple[MissionItem, ...], time_s: float, source: str
) -> Situation:
    try:
        fence = fence_from_items(items)
    except FenceError as error:
        return _with_fence_trouble(situation, f"{source}: {error}")
    return _with_fence_trouble(replace(situation, fence=Known(fence, time_s, source)), None)


def _autopilot(situation: Situation) -> AutopilotTable:
    return autopilot_of(ardupilot=situation.ardupilot, firmware=situation.firmware)


def _has_home_item(situation: Situation) -> bool:
    return _autopilot(situation).lists.form.has_home_item


def _with_mission(
    situation: Situation, items: tuple[MissionItem, ...], time_s: float, source: str, *, tells_home: bool
) -> Situation:
    if not _has_home_item(situation):
        return replace(situation, mission=Known(Mission(items), time_s, source))
    mission = Mission(without_home(items))
    if tells_home and items and (home := _place(items[0].lat_e7, items[0].lon_e7)):
        mission = replace(mission, home=home)
        situation = replace(situation, home=Known(home, time_s, f"{source}, item 0"))
    return replace(situation, mission=Known(mission, time_s, source))


def _targeted(
    situation: Situation, position: LatLon | None, time_s: float, source: TargetMessage
) -> Situation:
    return replace(situation, target=Known(position, time_s, source)) if position else situation


def _place(lat_e7: int, lon_e7: int) -> LatLon | None:
    """Return a position; None for (0, 0), which means "no fix" or "here", and for an impossible one."""
    if (lat_e7, lon_e7) == (0, 0):
        return None
    try:
        return checked_lat_lon(*from_e7(lat_e7, lon_e7))
    except InvalidPositionError:
        return None


def _kind(message: Any) -> ListKind | None:  # noqa: ANN401 - any message of the mission protocol
    return KINDS.get(message.mission_type)


def kinds_of(mission_type: int) -> tuple[ListKind, ...]:
    """Return the lists that a mission_type stands for: one, all, or none that is known here."""
    if mission_type == m.MissionType.ALL:
        return tuple(ListKind)
    kind = KINDS.get(mission_type)
    return (kind,) if kind else ()
