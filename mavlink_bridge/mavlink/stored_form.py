"""What an autopilot makes of a list when it stores it; so that what is read back can be compared with what was sent.

A `StoredForm` is one autopilot's; PX4's stands in `px4_form`, ArduPilot's here, from ArduPilot's ``AP_Mission::mavlink_int_to_mission_cmd`` and from measurement: item 0 of a mission is the vehicle's own home;
frames 5, 6 and 11 read back as 0, 3 and 10; each command keeps some parameters, some of them as whole numbers; altitudes are
stored in whole centimetres; ``current`` and ``autocontinue`` are not stored. A fence keeps ``param1`` and the place, a rally
point the place and whole metres. Positions are degE7 and must be equal to the last digit.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.parameter_values import float32
from missions.items import Command, CoordinateFrame, MissionItem, with_home

if TYPE_CHECKING:
    from missions.geo import LatLon

_FRAMES = {
    int(CoordinateFrame.MISSION): int(CoordinateFrame.GLOBAL),
    int(CoordinateFrame.GLOBAL_INT): int(CoordinateFrame.GLOBAL),
    int(CoordinateFrame.GLOBAL_RELATIVE_ALT_INT): int(CoordinateFrame.GLOBAL_RELATIVE_ALT),
    int(CoordinateFrame.GLOBAL_TERRAIN_ALT_INT): int(CoordinateFrame.GLOBAL_TERRAIN_ALT),
}

Kept = float | str | None
_MOST_EXACT_RADIUS_M = 255.0
"""Of circles beyond it ArduPilot keeps tens of metres."""


def _float32(value: float) -> Kept:
    return "nan" if math.isnan(value) else float32(value)


def _whole(value: float) -> Kept:
    return float(math.trunc(value)) if math.isfinite(value) else str(value)


def _sign(value: float) -> Kept:
    return -1.0 if value < 0 else 1.0


def _flag(value: float) -> Kept:
    return 1.0 if value > 0 else 0.0


def _turns(value: float) -> Kept:
    return math.trunc(value * 256) / 256 if 0 < value < 1 else _whole(value)


def _turn_radius(value: float) -> Kept:
    if not math.isfinite(value) or abs(value) <= _MOST_EXACT_RADIUS_M:
        return _whole(value)
    return math.copysign(10.0 * math.trunc(min(_MOST_EXACT_RADIUS_M, abs(value) * 0.1)), value)


def _hundredths(value: float) -> Kept:
    return float(math.trunc(value * 100.0)) if math.isfinite(value) else str(value)


def _odd(value: float) -> Kept:
    return float(math.trunc(abs(value)) % 2) if math.isfinite(value) else str(value)


def _float16(value: float) -> Kept:
    if not math.isfinite(value):
        return str(value)
    try:
        return float(struct.unpack("<e", struct.pack("<e", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def _dropped(value: float) -> Kept:  # noqa: ARG001 - one of a family
    return None


_KEEPS_ALL = (_float32, _float32, _float32, _float32)
KEEPERS = {
    keep.__name__[1:]: keep
    for keep in (_float32, _float16, _whole, _sign, _flag, _turns, _turn_radius, _hundredths, _odd, _dropped)
}
"""What may be kept of a parameter, by name."""

_ROWS = [
    line.split(",")
    for line in Path(__file__).with_name("stored_commands.csv").read_text(encoding="ascii").splitlines()[1:]
]
"""Command by command what ArduPilot keeps of each parameter, where it takes NaN, and whether it keeps the place.

Of DO_SET_CAM_TRIGG_DIST newer firmware keeps the third parameter, too.
"""

_KEPT_PARAMS = {
    int(command): tuple(KEEPERS[param or "dropped"] for param in params)
    for command, _, *params, _, _ in _ROWS
}
STORED_WITH_PLACE = frozenset(int(command) for command, *_, has_place in _ROWS if has_place)
"""Commands stored with a place and a frame (``AP_Mission::stored_in_location``); others read back with frame 0 and mostly without a place."""

_NAN_TAKEN = {(int(command), int(param) - 1) for command, *_, params, _ in _ROWS for param in params.split()}
"""Commands and the parameters of theirs, counted from 0, in which ArduPilot takes NaN."""

_POLYGON_VERTICES = frozenset(
    {Command.FENCE_POLYGON_VERTEX_INCLUSION, Command.FENCE_POLYGON_VERTEX_EXCLUSION}
)


@dataclass(frozen=True, slots=True)
class Difference:
    """One item that is not what was wanted.

    Parameters
    ----------
    seq : int
        Its place in the list, for missions with home at 0.
    wanted, found : MissionItem, optional
        None where a list ends before the other.
    """

    seq: int
    wanted: MissionItem | None
    found: MissionItem | None

    def __str__(self) -> str:
        if self.wanted is None:
            return f"item {self.seq} should not be there"
        if self.found is None:
            return f"item {self.seq} is missing"
        return f"item {self.seq} is {_brief(self.found)} instead of {_brief(self.wanted)}"


def _brief(item: MissionItem) -> str:
    params = ", ".join(f"{value:g}" for value in item.params)
    return f"command {int(item.command)} ({params}) at {item.position}, {item.alt_m:g} m in frame {int(item.frame)}"


@dataclass(frozen=True, slots=True)
class StoredItem:
    """An item as an autopilot stores it.

    Parameters
    ----------
    fixed : tuple
        What has to be equal: NaN stands in it as a word.
    place : tuple of int
        The place in degE7.
    alt_m : float
        The altitude, equal to a centimetre.
    yaw_deg : float
        A heading that comes back through radians: equal to a thousandth of a degree, whole turns left out.
    may_lose_place : bool
        Whether place and altitude may also come back as 0.
    """

    fixed: tuple[object, ...]
    place: tuple[int, int]
    alt_m: float = 0.0
    yaw_deg: float = 0.0
    may_lose_place: bool = False


@dataclass(frozen=True, slots=True)
class StoredForm:
    """How an autopilot wants lists sent, and what it makes of them.

    Parameters
    ----------
    has_home_item : bool
        Whether a mission's item 0 is the vehicle's own home.
    stored : callable
        Returns an item of a list as it is stored.
    sendable : callable
        Returns an item as the autopilot takes it, nothing changed of what it keeps and uses.
    arranged : callable
        Returns a list in the order in which the autopilot reads it right.
    """

    has_home_item: bool
    stored: Callable[[MissionItem, MissionType], StoredItem]
    sendable: Callable[[MissionItem, MissionType], MissionItem]
    arranged: Callable[[Sequence[MissionItem], MissionType], tuple[MissionItem, ...]]

    def prepared(self, items: Sequence[MissionItem], mission_type: MissionType) -> tuple[MissionItem, ...]:
        """Return a list as it is to be sent."""
        return tuple(self.sendable(item, mission_type) for item in self.arranged(items, mission_type))

    def own_items(self, items: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
        """Return a mission as it goes over the wire without a home item."""
        return tuple(items[int(self.has_home_item) :])

    def mission_of(self, items: Sequence[MissionItem], home: LatLon) -> tuple[MissionItem, ...]:
        """Return a mission as it goes over the wire."""
        return with_home(items, home) if self.has_home_item else tuple(items)

    def first_compared(self, mission_type: MissionType) -> int:
        """Return the first item of a list that is compared: home is the vehicle's own."""
        return int(self.has_home_item and mission_type is MissionType.MISSION)


def _sendable(item: MissionItem, mission_type: MissionType) -> MissionItem:  # noqa: ARG001 - one shape for all autopilots
    """Return an item with 0 for a NaN that ArduPilot would refuse and of which it keeps nothing.

    QGroundControl leaves headings unset (null), and ArduPilot refuses that of NAV_LOITER_UNLIM (ArduPilot #27482).
    """
    keepers = _KEPT_PARAMS.get(int(item.command), _KEEPS_ALL)
    a, b, c, d = (
        0.0
        if math.isnan(value) and keep in (_dropped, _flag) and (int(item.command), i) not in _NAN_TAKEN
        else value
        for i, (value, keep) in enumerate(zip(item.params, keepers, strict=True))
    )
    return item if not any(map(math.isnan, item.params)) else replace(item, params=(a, b, c, d))


def _stored(item: MissionItem, mission_type: MissionType) -> StoredItem:
    command = int(item.command)
    place = (item.lat_e7, item.lon_e7)
    if mission_type is MissionType.FENCE:
        keep = _whole if command in _POLYGON_VERTICES else _float32
        param1 = None if command == Command.FENCE_RETURN_POINT else keep(item.params[0])
        return StoredItem((command, param1), place)
    if mission_type is MissionType.RALLY:
        return StoredItem((command, _whole(item.alt_m)), place)
    keepers = _KEPT_PARAMS.get(command, _KEEPS_ALL)
    params = tuple(keep(value) for keep, value in zip(keepers, item.params, strict=True))
    if command not in STORED_WITH_PLACE:
        return StoredItem((command, params), place, item.alt_m, may_lose_place=True)
    frame = _FRAMES.get(int(item.frame), int(item.frame))
    return StoredItem((command, frame, params), place, item.alt_m)


def _as_it_is(items: Sequence[MissionItem], mission_type: MissionType) -> tuple[MissionItem, ...]:  # noqa: ARG001 - one shape for all autopilots
    return tuple(items)


ARDUPILOT_FORM = StoredForm(has_home_item=True, stored=_stored, sendable=_sendable, arranged=_as_it_is)
"""ArduPilot's."""


def is_same_item(
    a: MissionItem,
    b: MissionItem,
    mission_type: MissionType,
    form: StoredForm = ARDUPILOT_FORM,
    *,
    coarse: bool = False,
) -> bool:
    """Return whether two items are the same once stored; ``coarse`` compares positions as 32-bit floats carry them."""
    if a == b:
        return True
    stored_a, stored_b = form.stored(a, mission_type), form.stored(b, mission_type)
    if stored_a.fixed != stored_b.fixed or not _is_same_heading(stored_a.yaw_deg, stored_b.yaw_deg):
        return False
    may_lose = stored_a.may_lose_place
    if not (_is_near(stored_a.alt_m, stored_b.alt_m) or (may_lose and 0 in (stored_a.alt_m, stored_b.alt_m))):
        return False
    if may_lose and (0, 0) in (stored_a.place, stored_b.place):
        return True
    if not coarse:
        return stored_a.place == stored_b.place
    return all(
        _float32(x / 1e7) == _float32(y / 1e7) for x, y in zip(stored_a.place, stored_b.place, strict=True)
    )


def differences(
    wanted: Sequence[MissionItem],
    found: Sequence[MissionItem],
    mission_type: MissionType,
    form: StoredForm = ARDUPILOT_FORM,
    *,
    coarse: bool = False,
) -> tuple[Difference, ...]:
    """Return the items in which a list as read back differs from the one wanted, an autopilot's home item left out.

    A mission of only the home item is an empty mission.
    """
    first = form.first_compared(mission_type)
    longest = max(len(wanted), len(found))
    result = []
    for seq in range(first, longest):
        a = wanted[seq] if seq < len(wanted) else None
        b = found[seq] if seq < len(found) else None
        if a is None or b is None or not is_same_item(a, b, mission_type, form, coarse=coarse):
            result.append(Difference(seq, a, b))
    return tuple(result)


def is_unfinished_write(
    found: Sequence[MissionItem],
    old: Sequence[MissionItem],
    new: Sequence[MissionItem],
    mission_type: MissionType,
    *,
    coarse: bool = False,
) -> bool:
    """Return whether a list can be what an abandoned upload of ``new`` over ``old`` leaves: the old cut short, overwritten from the front.

    ArduPilot cuts a mission to the shorter length at MISSION_COUNT and then writes each item as it comes.
    """
    if not min(len(old), len(new)) <= len(found) <= max(len(old), len(new)):
        return False

    def holds(seq: int, items: Sequence[MissionItem]) -> bool:
        return seq < len(items) and is_same_item(found[seq], items[seq], mission_type, coarse=coarse)

    first = 1 if mission_type is MissionType.MISSION else 0
    return all(holds(seq, new) or holds(seq, old) for seq in range(first, len(found)))


def _is_near(a_m: float, b_m: float) -> bool:
    """Return whether two altitudes can be the same whole number of centimetres, cut or rounded."""
    if not (math.isfinite(a_m) and math.isfinite(b_m)):
        return str(a_m) == str(b_m)
    # Cut and rounded differ by at most 1.5 cm; the share is what 32-bit floats lose.
    return abs(a_m - b_m) < 0.0151 + 1e-6 * abs(a_m)


def _is_same_heading(a_deg: float, b_deg: float) -> bool:
    if math.isnan(a_deg) or math.isnan(b_deg):
        return math.isnan(a_deg) and math.isnan(b_deg)
    # A degree in radians as a float of 32 bits and back is 3e-5 degrees off at the most.
    return abs((a_deg - b_deg + 180.0) % 360.0 - 180.0) < 1e-3
