"""A route whose driven band keeps the promise; where there is none, the widest one, or an error that names its clearance."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from missions.promise import NARROWEST_BAND_M
from missions.routing.bottleneck import kept_m
from missions.routing.no_route import NoRoute, NoRouteKind
from missions.routing.route_search import DrivenRoute, RouteSearch
from missions.words import metres

if TYPE_CHECKING:
    from missions.promise import Promise
    from missions.routing.drawn_route import Sought
    from missions.vehicle import Vehicle

_SHARES = (1.0, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1, 0.0)
"""What of the widest clearance is tried one after another."""

_MEASUREMENTS = 600
"""For each of them."""

_NOTHING_ADVICE = (
    "less clearance does not help this vehicle: turn it by hand to face the route, drive slower (--speed), or widen the "
    "narrowest place"
)


@dataclass(frozen=True, eq=False)
class FittedRoute:
    """What a route is sought with.

    Parameters
    ----------
    sought : Sought
        The field, the ends, and how to search.
    vehicle : Vehicle
        What drives.
    heading_deg : float or None
        Where it faces.
    """

    sought: Sought
    vehicle: Vehicle
    heading_deg: float | None
    _known: dict[float, DrivenRoute | NoRoute] = field(default_factory=dict, init=False)

    def find(self, asked: Promise) -> tuple[Promise, DrivenRoute] | NoRoute:
        """Return a route and what is promised for it; else why there is none, with what the widest one would keep."""
        found = self._search(asked.required_m).find()
        if isinstance(found, DrivenRoute):
            return asked, found
        return self._compared(found, asked) if found.kind is NoRouteKind.TOO_NARROW else found

    def widest(self, asked: Promise) -> tuple[Promise, DrivenRoute] | NoRoute:
        """Return the widest route there is, and what is promised for it; else why there is none."""
        widest_m = kept_m(self.sought.narrowest_places())
        why: NoRoute | None = None
        for share in _SHARES:
            required_m = max(0.0, math.floor(100 * share * (widest_m - NARROWEST_BAND_M)) / 100)
            found = self._tried(required_m)
            if isinstance(found, DrivenRoute):
                promised_m = max(0.0, required_m - asked.error_m)
                return replace(asked, promised_m=promised_m, error_m=required_m - promised_m), found
            is_first, why = why is None, found
            if is_first and found.at_start:
                # Where the least asks too much of the start, what lies between does.
                least = self._tried(0.0)
                if isinstance(least, NoRoute) and least.at_start:
                    why = least
                    break
        assert why is not None
        return replace(why, advice=_NOTHING_ADVICE) if why.kind is NoRouteKind.CORNER else why

    def _tried(self, required_m: float) -> DrivenRoute | NoRoute:
        """Return the route that keeps a given clearance, or why there is no such route; each is tried once."""
        if required_m not in self._known:
            self._known[required_m] = self._search(required_m, _MEASUREMENTS).find()
        return self._known[required_m]

    def _compared(self, why: NoRoute, asked: Promise) -> NoRoute:
        """Return why there is no route, with what the widest route keeps while this vehicle drives it."""
        widest = self.widest(asked)
        if isinstance(widest, NoRoute):
            text = f"{why.text}, and none of those tried can be driven by this vehicle at any clearance"
            return replace(why, text=text, advice=_NOTHING_ADVICE)
        promised_m = widest[0].promised_m
        places = filter(None, self.sought.narrowest_places())
        place = min(places, key=lambda place: place.clearance_m)
        return replace(
            why,
            text=f"no route keeps {metres(asked.promised_m)} while driving; the widest keeps {metres(promised_m)} "
            f"({metres(place.clearance_m)} drawn){place.where}",
            facts={
                **why.facts,
                "widest_m": round(promised_m, 3),
                "widest_drawn_m": round(place.clearance_m, 3),
            },
        )

    def _search(self, required_m: float, measurements: int | None = None) -> RouteSearch:
        return RouteSearch(self.sought, required_m, self.vehicle, self.heading_deg, measurements)
