"""What ArduPilot makes of a list when it stores it, in one place; so that what is read back can be compared with what was sent.

From ArduPilot's ``AP_Mission::mavlink_int_to_mission_cmd`` and from measurement: item 0 of a mission is the vehicle's own home;
frames 5, 6 and 11 read back as 0, 3 and 10; each command keeps some parameters, some of them as whole numbers; altitudes are
stored in whole centimetres; ``current`` and ``autocontinue`` are not stored. A fence keeps ``param1`` and the place, a rally
point the place and whole metres. Positions are degE7 and must be equal to the last digit.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.parameter_values import float32
from missions.items import Command, CoordinateFrame, MissionItem

_FRAMES = {
    int(CoordinateFrame.MISSION): int(CoordinateFrame.GLOBAL),
    int(CoordinateFrame.GLOBAL_INT): int(CoordinateFrame.GLOBAL),
    int(CoordinateFrame.GLOBAL_RELATIVE_ALT_INT): int(CoordinateFrame.GLOBAL_RELATIVE_ALT),
    int(CoordinateFrame.GLOBAL_TERRAIN_ALT_INT): int(CoordinateFrame.GLOBAL_TERRAIN_ALT),
}

_Stored = float | str | None
_MOST_EXACT_RADIUS_M = 255.0
"""Of circles beyond it ArduPilot keeps tens of metres."""


def _float32(value: float) -> _Stored:
    return "nan" if math.isnan(value) else float32(value)


def _whole(value: float) -> _Stored:
    return float(math.trunc(value)) if math.isfinite(value) else str(value)


def _sign(value: float) -> _Stored:
    return -1.0 if value < 0 else 1.0


def _flag(value: float) -> _Stored:
    return 1.0 if value > 0 else 0.0


def _turns(value: float) -> _Stored:
    return math.trunc(value * 256) / 256 if 0 < value < 1 else _whole(value)


def _turn_radius(value: float) -> _Stored:
    if not math.isfinite(value) or abs(value) <= _MOST_EXACT_RADIUS_M:
        return _whole(value)
    return math.copysign(10.0 * math.trunc(min(_MOST_EXACT_RADIUS_M, abs(value) * 0.1)), value)


def _hundredths(value: float) -> _Stored:
    return float(math.trunc(value * 100.0)) if math.isfinite(value) else str(value)


def _odd(value: float) -> _Stored:
    return float(math.trunc(abs(value)) % 2) if math.isfinite(value) else str(value)


def _float16(value: float) -> _Stored:
    if not math.isfinite(value):
        return str(value)
    try:
        return float(struct.unpack("<e", struct.pack("<e", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def _dropped(value: float) -> _Stored:  # noqa: ARG001 - one of a family
    return None


_KEEPS_ALL = (_float32, _float32, _float32, _float32)
_KEEPERS = {
    keep.__name__[1:]: keep
    for keep in (_float32, _float16, _whole, _sign, _flag, _turns, _turn_radius, _hundredths, _odd, _dropped)
}
_ROWS = [
    line.split(",")
    for line in Path(__file__).with_name("stored_commands.csv").read_text(encoding="ascii").splitlines()[1:]
]
"""Command by command what ArduPilot keeps of each parameter, where it takes NaN, and whether it keeps the place.

Of DO_SET_CAM_TRIGG_DIST newer firmware keeps the third parameter, too.
"""

_KEPT_PARAMS = {
    int(command): tuple(_KEEPERS[param or "dropped"] for param in params)
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


def sendable_params(item: MissionItem) -> tuple[float, float, float, float]:
    """Return an item's parameters, with 0 for a NaN that ArduPilot would refuse and of which it keeps nothing.

    QGroundControl leaves headings unset (null), and ArduPilot refuses that of NAV_LOITER_UNLIM (ArduPilot #27482).
    """
    keepers = _KEPT_PARAMS.get(int(item.command), _KEEPS_ALL)
    a, b, c, d = (
        0.0
        if math.isnan(value) and keep in (_dropped, _flag) and (int(item.command), i) not in _NAN_TAKEN
        else value
        for i, (value, keep) in enumerate(zip(item.params, keepers, strict=True))
    )
    return a, b, c, d


def is_same_item(a: MissionItem, b: MissionItem, mission_type: MissionType, *, coarse: bool = False) -> bool:
    """Return whether two items are the same once stored; ``coarse`` compares positions as 32-bit floats carry them."""
    if a == b:
        return True
    stored_a, stored_b = _stored(a, mission_type), _stored(b, mission_type)
    if stored_a.fixed != stored_b.fixed:
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
    *,
    coarse: bool = False,
) -> tuple[Difference, ...]:
    """Return the items in which a list as read back differs from the one wanted, home left out.

    A mission of only the home item is an empty mission.
    """
    first = 1 if mission_type is MissionType.MISSION else 0
    longest = max(len(wanted), len(found))
    result = []
    for seq in range(first, longest):
        a = wanted[seq] if seq < len(wanted) else None
        b = found[seq] if seq < len(found) else None
        if a is None or b is None or not is_same_item(a, b, mission_type, coarse=coarse):
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


@dataclass(frozen=True, slots=True)
class _StoredItem:
    fixed: tuple[object, ...]
    place: tuple[int, int]
    alt_m: float
    may_lose_place: bool = False


def _stored(item: MissionItem, mission_type: MissionType) -> _StoredItem:
    command = int(item.command)
    place = (item.lat_e7, item.lon_e7)
    if mission_type is MissionType.FENCE:
        keep = _whole if command in _POLYGON_VERTICES else _float32
        param1 = None if command == Command.FENCE_RETURN_POINT else keep(item.params[0])
        return _StoredItem((command, param1), place, 0.0)
    if mission_type is MissionType.RALLY:
        return _StoredItem((command, _whole(item.alt_m)), place, 0.0)
    keepers = _KEPT_PARAMS.get(command, _KEEPS_ALL)
    params = tuple(keep(value) for keep, value in zip(keepers, item.params, strict=True))
    if command not in STORED_WITH_PLACE:
        return _StoredItem((command, params), place, item.alt_m, may_lose_place=True)
    frame = _FRAMES.get(int(item.frame), int(item.frame))
    return _StoredItem((command, frame, params), place, item.alt_m)


def _is_near(a_m: float, b_m: float) -> bool:
    """Return whether two altitudes can be the same whole number of centimetres, cut or rounded."""
    if not (math.isfinite(a_m) and math.isfinite(b_m)):
        return str(a_m) == str(b_m)
    # Cut and rounded differ by at most 1.5 cm; the share is what 32-bit floats lose.
    return abs(a_m - b_m) < 0.0151 + 1e-6 * abs(a_m)
