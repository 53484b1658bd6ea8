"""A route whose driven band keeps the promise; where there is none, the widest one, or an error that names its clearance."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from missions.errors import NoRouteError, RouteError
from missions.ground.legs import reserve_m
from missions.promise import NARROWEST_BAND_M
from missions.routing.bottleneck import kept_m, narrowest_places
from missions.routing.route_search import DrivenRoute, RouteSearch
from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from missions.geo import LocalPoint
    from missions.ground.ground import Ground
    from missions.promise import Promise
    from missions.request import Request
    from missions.routing.bottleneck import NarrowestPlace
    from missions.vehicle import Vehicle

_SHARES = (1.0, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1, 0.0)
"""What of the widest clearance is tried one after another."""

_MEASUREMENTS = 600
"""For each of them."""

_NOTHING_ADVICE = (
    "less clearance does not help this vehicle: turn it by hand to face its way, let it drive slower (--speed), or widen the "
    "narrowest place"
)


@dataclass(frozen=True, eq=False)
class FittedRoute:
    """What a route is sought with.

    Parameters
    ----------
    ground : Ground
        The field.
    ends : sequence of LocalPoint
        Start and targets.
    request : Request
        What is asked.
    vehicle : Vehicle
        What drives.
    heading_deg : float or None
        Where it faces.
    should_stop : callable, optional
        Asked now and then; True ends the search.
    """

    ground: Ground
    ends: Sequence[LocalPoint]
    request: Request
    vehicle: Vehicle
    heading_deg: float | None
    should_stop: Callable[[], bool] | None = None
    _known: dict[float, DrivenRoute | RouteError] = field(default_factory=dict, init=False)

    def find(self, asked: Promise) -> tuple[Promise, DrivenRoute]:
        """Return a route and what is promised for it.

        Raises
        ------
        StartBlockedError, TargetBlockedError, NoRouteError
            No route; with what the widest one would keep.
        """
        if self.request.widest:
            return self._widest(asked, self._places())
        try:
            return asked, self._search(asked.required_m).find()
        except NoRouteError as error:
            if "widest_m" not in error.details:
                raise
            raise self._told(error, asked) from None

    def _places(self) -> list[NarrowestPlace | None]:
        return narrowest_places(self.ground, self.ends, self.should_stop)

    def _widest(self, asked: Promise, places: Sequence[NarrowestPlace | None]) -> tuple[Promise, DrivenRoute]:
        widest_m = kept_m(places)
        refusal: RouteError | None = None
        for share in _SHARES:
            required_m = max(0.0, math.floor(100 * share * (widest_m - NARROWEST_BAND_M)) / 100)
            found = self._tried(required_m)
            if isinstance(found, RouteError):
                is_first, refusal = refusal is None, found
                if is_first and found.details.get("at_start"):
                    # Where the least asks too much of the start, what lies between does.
                    least = self._tried(0.0)
                    if isinstance(least, RouteError) and least.details.get("at_start"):
                        refusal = least
                        break
                continue
            promised_m = max(0.0, required_m - asked.error_m)
            return replace(asked, promised_m=promised_m, error_m=required_m - promised_m), found
        assert refusal is not None
        if "corner" in refusal.details:
            refusal.details["advice"] = _NOTHING_ADVICE
        raise refusal

    def _tried(self, required_m: float) -> DrivenRoute | RouteError:
        """Return the route that keeps a given clearance, or why there is no such route; each is tried once."""
        if required_m not in self._known:
            try:
                self._known[required_m] = self._search(required_m, _MEASUREMENTS).find()
            except RouteError as error:
                self._known[required_m] = error
        return self._known[required_m]

    def _told(self, error: NoRouteError, asked: Promise) -> NoRouteError:
        """Return the error with what the widest route keeps while this vehicle drives it."""
        places = self._places()
        place = min((place for place in places if place), key=lambda place: place.clearance_m)
        try:
            widest, _ = self._widest(asked, places)
        except RouteError:
            return NoRouteError(
                f"{error}, and none of those tried can be driven by this vehicle at any clearance",
                **{**error.details, "advice": _NOTHING_ADVICE},
            )
        return NoRouteError(
            f"no route keeps {metres(asked.promised_m)} while driving; the widest keeps {metres(widest.promised_m)} "
            f"({metres(place.clearance_m)} drawn){place.where}",
            **{
                **error.details,
                "widest_m": round(widest.promised_m, 3),
                "widest_drawn_m": round(place.clearance_m, 3),
            },
        )

    def _search(self, required_m: float, measurements: int | None = None) -> RouteSearch:
        start, *targets = self.ends
        return RouteSearch(
            self.ground,
            start,
            targets,
            required_m,
            reserve_m(self.ground),
            self.vehicle,
            self.heading_deg,
            self.request.snap_m,
            self.request.method,
            self.should_stop,
            self.request.escape,
            measurements,
        )
