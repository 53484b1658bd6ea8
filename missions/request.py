"""What is asked of a plan: to go to a place, to visit several, or to repair a mission. What makes no sense is refused where it is made."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from numbers import Real
from typing import Any, Self, TypeVar

from missions.errors import RequestError
from missions.geo import LatLon, checked_lat_lon
from missions.situation import Mission
from missions.vehicle import Footprint

_Word = TypeVar("_Word", bound=StrEnum)

POINT = Footprint()
"""A vehicle of no size: its clearance counts from where its position is known."""

_LENGTHS = ("clearance_m", "corner_allowance_m", "snap_m", "position_error_m", "reserve_m")


class Method(StrEnum):
    """How a path is searched for."""

    OPTIMAL = "optimal"
    PBPP_TAUT = "pbpp-taut"
    PBPP = "pbpp"


class Order(StrEnum):
    """In which order targets are visited."""

    GIVEN = "given"
    BEST = "best"


class End(StrEnum):
    """What the vehicle does at the end of a mission."""

    HOLD = "hold"
    LOITER = "loiter"
    RTL = "rtl"


class _Kinds(type):
    """Lets ``Request(...)`` make a `Tour` or a `RepairMission`, as it did both when there was one kind."""

    def __call__(cls, *words: Any, **named: Any) -> Any:  # noqa: ANN401 - an instance of the class, or of one below it
        if cls is not Request:
            return super().__call__(*words, **named)
        if len(words) > len(_DEFAULTS):
            raise TypeError(f"Request() takes {', '.join(_DEFAULTS)}; {len(words)} were given")
        return request_of(**dict(zip(_DEFAULTS, words, strict=False)), **named)


@dataclass(frozen=True, kw_only=True)
class Request(metaclass=_Kinds):
    """What is asked of every plan; None leaves it to the situation and the vehicle.

    ``Request(...)`` itself makes a `Tour` of any number of targets, or a `RepairMission` where there is ``via`` or ``via_own``.

    Parameters
    ----------
    start : LatLon, optional
        Default: the vehicle's position, else home.
    clearance_m : float, optional
        Promised for the rover as it drives. Default: from FENCE_MARGIN.
    widest : bool
        Take the widest route there is; its clearance is the largest possible.
    corner_allowance_m : float, optional
        Room for cut corners and tracking error everywhere on top of the clearance; 0 plans the drawn lines only. Default: the route is
        fitted to the drive model, with no more room than each corner needs.
    snap_m : float
        A blocked target is moved to free ground within this distance.
    method : Method
        ``optimal``, ``pbpp-taut`` or ``pbpp``.
    position_error_m : float, optional
        How far off the vehicle's position may be. Default: from the GPS fix type.
    reserve_m : float
        Extra clearance of your own, for wind and slip.
    speed_mps : float, optional
        Driven with this speed (DO_CHANGE_SPEED). Default: the vehicle's own.
    footprint : Footprint
        The rectangle the vehicle covers.
    escape : bool
        Whether a vehicle inside an exclusion or outside the fence may drive out.
    trusts_model : bool
        Promise also where the drive lies outside what was measured.
    accepts_less : bool
        Where no route keeps the clearance, take the widest there is.

    Raises
    ------
    RequestError
        A word or number that makes no sense; which one, and its value.
    InvalidPositionError
        A place that is not on Earth.
    """

    start: LatLon | None = None
    clearance_m: float | None = None
    widest: bool = False
    corner_allowance_m: float | None = None
    snap_m: float = 0.0
    method: Method = Method.OPTIMAL
    position_error_m: float | None = None
    reserve_m: float = 0.0
    speed_mps: float | None = None
    footprint: Footprint = POINT
    escape: bool = False
    trusts_model: bool = False
    accepts_less: bool = False

    def __post_init__(self) -> None:
        if self.start is not None:
            self._set("start", _place("start", self.start))
        for name in _LENGTHS:
            _check_number(name, getattr(self, name), is_zero_allowed=True)
        _check_number("speed_mps", self.speed_mps, is_zero_allowed=False)
        if self.widest and self.clearance_m is not None:
            raise _senseless("clearance_m", self.clearance_m, "none beside the widest route")
        self._set("method", _word("method", self.method, Method))
        if not isinstance(self.footprint, Footprint):
            raise _senseless("footprint", self.footprint, "a Footprint")

    @property
    def targets(self) -> tuple[LatLon, ...]:
        """The places that were given."""
        return ()

    @property
    def repairs(self) -> bool:
        """Whether a mission is to be repaired."""
        return False

    def to(self, target: LatLon) -> Self:  # noqa: ARG002 - for those that have one
        """Return the request with another target in place of its own; a mission that is repaired keeps its places."""
        return self

    def words(self) -> dict[str, Any]:
        """Return the words from which `request_of` makes a request for the same."""
        return {name: getattr(self, name, default) for name, default in _DEFAULTS.items()}

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)


@dataclass(frozen=True, kw_only=True)
class GoTo(Request):
    """Go to one place, and stop there.

    Parameters
    ----------
    target : LatLon, optional
        Default: the newest target, else the last navigation item of the mission.
    """

    target: LatLon | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.target is not None:
            self._set("target", _place("target", self.target))

    @property
    def targets(self) -> tuple[LatLon, ...]:
        """The target, if one was given."""
        return () if self.target is None else (self.target,)

    def to(self, target: LatLon) -> Self:
        """Return the request with another target."""
        return replace(self, target=target)


@dataclass(frozen=True, kw_only=True)
class Tour(Request):
    """Visit several places, return home, or end with loiter or RTL.

    Parameters
    ----------
    targets : sequence of LatLon
        Default: one, as for `GoTo`.
    order : Order
        ``given``: the targets in their order; ``best``: in the shortest one.
    comes_back : bool
        Whether the route leads home after the last target; to the start where home is not known.
    end : End
        At the end ``hold``, ``loiter`` or ``rtl``.
    way_home_inside : bool
        Whether the mission holds behind its end, for each leg, a way home to be chosen; it ends in ``hold`` then.
    places : sequence of pairs of str and LatLon
        Where ways home may lead, beside home and the rally points, each with its name.
    """

    targets: tuple[LatLon, ...] = ()
    order: Order = Order.GIVEN
    comes_back: bool = False
    end: End = End.HOLD
    way_home_inside: bool = False
    places: tuple[tuple[str, LatLon], ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set("targets", _places(self.targets))
        self._set("order", _word("order", self.order, Order))
        self._set("end", _word("end", self.end, End))
        self._set("places", _named_places(self.places))
        if self.way_home_inside and self.end is not End.HOLD:
            raise _senseless("end", self.end, "hold, beside a way home inside")

    def to(self, target: LatLon) -> Self:
        """Return the request with one target in place of all of its own."""
        return replace(self, targets=(target,))


@dataclass(frozen=True, kw_only=True)
class RepairMission(Request):
    """Repair a mission around the fences; its places, order, speeds and end stay.

    Parameters
    ----------
    mission : Mission, optional
        Default: the one that the situation holds.
    """

    mission: Mission | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.mission, Mission | None):
            raise _senseless("mission", self.mission, "a Mission")
        for name in ("widest", "accepts_less", "corner_allowance_m", "speed_mps", "escape"):
            if getattr(self, name) != _DEFAULTS[name]:
                raise _senseless(
                    name,
                    getattr(self, name),
                    "none: a repair keeps the mission's own speeds and goes by the drive model",
                )

    @property
    def repairs(self) -> bool:
        """Whether a mission is to be repaired."""
        return True

    def words(self) -> dict[str, Any]:
        """Return the words from which `request_of` makes a request for the same."""
        return {**super().words(), "via": self.mission, "via_own": self.mission is None}


_LATER_WORDS = ("trusts_model", "accepts_less", "way_home_inside", "places")
_TOUR_WORDS = ("targets", "order", "comes_back", "end", "way_home_inside", "places")
_DEFAULTS: dict[str, Any] = {
    "start": None,
    "targets": (),
    **{one.name: one.default for one in fields(Tour) if one.name not in _LATER_WORDS},
    "via": None,
    "via_own": False,
    "trusts_model": False,
    "accepts_less": False,
    "way_home_inside": False,
    "places": (),
}
"""What `request_of` knows, in the order in which `Request` takes it, as it is where it is left out."""


def request_of(*, via: Mission | None = None, via_own: bool = False, **words: Any) -> Request:  # noqa: ANN401 - the fields of all kinds
    """Return a `Tour`, or a `RepairMission` where there is a mission to repair.

    Parameters
    ----------
    via : Mission, optional
        A mission to repair.
    via_own : bool
        Repair the mission that the situation holds.
    **words
        The fields of `Tour` or `RepairMission`.

    Raises
    ------
    RequestError
        They do not go together, or one makes no sense.
    """
    if via is None and not via_own:
        return Tour(**words)
    if via is not None and via_own:
        raise _senseless("via_own", via_own, "none beside another mission to repair")
    tour = Tour(**{name: words.pop(name) for name in _TOUR_WORDS if name in words})
    for name in _TOUR_WORDS:
        if (value := getattr(tour, name)) != _DEFAULTS[name]:
            raise _senseless(name, value, "none: a repair keeps the mission's own places, order and end")
    return RepairMission(mission=via, **words)


def conditions(request: Request) -> dict[str, Any]:
    """Return what a request asks for whatever its kind."""
    return {one.name: getattr(request, one.name) for one in fields(Request)}


def _place(name: str, value: Any) -> LatLon:  # noqa: ANN401 - whatever was given
    try:
        lat_deg, lon_deg = value
        return checked_lat_lon(lat_deg, lon_deg)
    except (TypeError, ValueError):
        raise _senseless(name, value, "a latitude and a longitude in degrees") from None


def _places(values: Iterable[Any]) -> tuple[LatLon, ...]:
    try:
        return tuple(_place("targets", value) for value in values)
    except TypeError:
        raise _senseless("targets", values, "a sequence of places") from None


def _named_places(values: Iterable[Any]) -> tuple[tuple[str, LatLon], ...]:
    try:
        return tuple((str(name), _place("places", position)) for name, position in values)
    except (TypeError, ValueError):
        raise _senseless("places", values, "a sequence of pairs of a name and a place") from None


def _word(name: str, value: str, words: type[_Word]) -> _Word:
    try:
        return words(value)
    except ValueError:
        raise _senseless(name, value, f"one of {', '.join(words)}") from None


def _check_number(name: str, value: Any, *, is_zero_allowed: bool) -> None:  # noqa: ANN401 - whatever was given
    if value is None and _DEFAULTS[name] is None:
        return
    is_number = not isinstance(value, bool) and isinstance(value, Real) and math.isfinite(value)
    if not is_number or value < 0 or (value == 0 and not is_zero_allowed):
        raise _senseless(name, value, f"a finite number {'of at least' if is_zero_allowed else 'above'} 0")


def _senseless(name: str, value: object, expected: str) -> RequestError:
    plain = value.value if isinstance(value, StrEnum) else value
    return RequestError(f"{name} {plain!r}: expected {expected}", field=name, value=plain)
