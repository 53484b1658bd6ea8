"""A route that keeps what is asked of it, the widest there is, or why there is none: one answer for all that may be asked.

**What holds.** A route that keeps some clearance serves whoever asks for less. So where lines cannot be fitted to what is asked, or only to
be driven slowly, they are fitted to more, step by step up to what the ground leaves, and the quickest counts that keeps what is asked; only
where none do is it refused. The widest route is the one that keeps most of all that are looked at: from the widest clearance that lines can
be drawn at downwards; then the next steps above the best are asked for as anybody would ask, as long as there is a route. Where the start
refuses, routes that begin otherwise are looked for: another way, or leading away first.

Where a route is hard to fit, that is where much had to be mended or much time was lost, it is fitted at the next clearances of a grid too, which
is the same for whoever asks, as long as what is drawn there may come out quicker; the quickest is taken.

That no more can be had than the widest keeps, that all up to it can, and that less clearance never takes longer, does not follow all the same: for
that all clearances would have to be fitted for each plan. docs/clearance-ladder.md counts the exceptions.

**Why.** Fitting is a heuristic (`routing.route_search`): at one clearance it fails by a centimetre and at the next it succeeds. Without this
4.53 m were refused and 4.6 m planned, and the widest route kept less than others did.
A route that is driven slowly somewhere is fitted once more, in short rounds that end elsewhere (`fitting.local_search.Fitting`): on four of
seven such plans of `benchmarks/drive.py` it became 13 to 33 % quicker.
Fits that begin millimetres apart may end far apart, each with another place where it fails or is slow. So where no fit keeps enough, or the
quickest is not certain to win, lines are made that follow one of them and then another (`fitting.splice`): of five starts within 0.3 m that took
31 to 49 s, and one that was refused, all took 29 to 35 s.

What the vehicle keeps on its first legs, as it leaves the place where it stands, no clearance that is asked for can change: it is told apart
(`DrivenRoute.lead_away_m`).
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from missions.drive_model import corner_forecast
from missions.fitting.local_search import CRAWL_MEASUREMENTS, FIT_MEASUREMENTS
from missions.ground.legs import reserve_m
from missions.routing.drawn_route import widest_drawn_m
from missions.routing.no_route import NoRoute, NoRouteKind
from missions.routing.route_search import SLOW_MPS, DrivenRoute, RouteSearch, SharedWork
from missions.words import metres

if TYPE_CHECKING:
    from missions.fitting.cost import Measured
    from missions.promise import Promise
    from missions.routing.bottleneck import NarrowestPlace
    from missions.routing.drawn_route import Sought
    from missions.vehicle import Vehicle

STEP_M = 0.1
"""Between the clearances that lines are fitted to, where those asked for do not do."""

_STEPS_DOWN = (0, 2, 8, 32)
"""Steps below the widest that are looked at one after another. Chosen, not measured: they bound the time until a refusal."""
_STEPS_UP = (1, 3)
"""Steps above what is asked that are looked at first: nearly what is asked, and mostly they do."""
_OTHERWISE_STEPS = (
    64  # above a clearance at which the start refuses, within which routes that begin otherwise are sought
)
_OTHER_MEASUREMENTS = FIT_MEASUREMENTS + CRAWL_MEASUREMENTS
_GOOD_SHARE = 0.5  # for fitting in short rounds
GRID_M = 0.5
"""Between the clearances that all who ask for less look at too, where a route is hard to fit: the same for all, so that less is not slower."""
_GRID_FITTED = 5  # chosen, not measured: it bounds the time
# On the ladder (docs/clearance-ladder.md), 593 rungs of 9 hard places, fitted routes take 0.95 to 1.04 of the time that their lines would as drawn
# where less than a metre is missing in all, 0.82 to 1.06 where more is: what lost more, or had that much to mend, may be quicker elsewhere
_LOST, _MUCH_LOST = 1.02, 1.04
_HARD_M = 1.0
_HARD_SHARE, _EASY_SHARE = 0.85, 0.98
_SHARE_SPREAD = (
    0.08  # between neighbours of the grid on one place: what came out so much better than the last is rare
)
_CERTAIN = 1.06
"""Of the least time that a route can take: no other is quicker by more than a twentieth, a waypoint or two aside."""
_ALL_M = 0.01  # what keeps so little less than it aims at is as wide as can be

_NOTHING_ADVICE = (
    "less clearance does not help this vehicle: turn it by hand to face the route, drive slower (--speed), or widen the "
    "narrowest place"
)

Found = tuple["Promise", DrivenRoute]


@dataclass(frozen=True, eq=False)
class PromisedRoute:
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
    _tried: dict[float, RouteSearch] = field(default_factory=dict, init=False)
    _known: SharedWork = field(default_factory=SharedWork, init=False)

    def find(self, asked: Promise) -> Found | NoRoute:
        """Return a route that keeps at least what is asked, and what is promised for it; else why there is none."""
        found = self._fitted(asked)
        if isinstance(found, NoRoute) and found.at_start:
            found = self._search(asked.required_m, asked.required_m).nearer_start() or found
        if isinstance(found, DrivenRoute):
            found = self._quickest_of_more(self._quicker(found, asked), asked)
            return _promised(asked, found), found
        if found.kind is not NoRouteKind.TOO_NARROW or found.is_held:
            return found
        return self._compared(found, asked) if self.sought.compares else self._drawn_only(found)

    def _fitted(self, asked: Promise) -> DrivenRoute | NoRoute:
        """Return a route that keeps at least what is asked; else why none was found."""
        direct = self._search(asked.required_m, asked.required_m)
        found = direct.find(briefly=True)
        if not _is_good(found) and (isinstance(found, DrivenRoute) or found.kind is NoRouteKind.CORNER):
            found = self._with_more(direct, found, asked)
        if isinstance(found, NoRoute) and found.kind is NoRouteKind.CORNER:
            found = direct.combined() or found
        return found

    def _quicker(self, found: DrivenRoute, asked: Promise) -> DrivenRoute:
        """Return the quickest of several kinds of routes, or the one found where none can be clearly quicker.

        Where it is driven slowly somewhere they are fitted in short rounds too; of all that were fitted another one is made.
        """
        search = self._search(asked.required_m, asked.required_m)
        if found.cost_s <= _CERTAIN * search.least_s:
            return found
        others: list[DrivenRoute | NoRoute | None] = []
        if found.is_slow_somewhere:
            others.append(replace(search, good_share=_GOOD_SHARE).find(briefly=True))
        others.append(search.combined())
        driven = [one for one in (found, *others) if isinstance(one, DrivenRoute)]
        return min(driven, key=lambda one: one.cost_s)

    def _quickest_of_more(self, found: DrivenRoute, asked: Promise) -> DrivenRoute:
        """Return a route, or a quicker one to the same places fitted to more clearance, where it is hard to fit: a little more, and the grid's next."""
        required_m = asked.required_m
        if found.targets != tuple(self.sought.targets):
            return found  # a blocked target was moved as little as has to be: at more clearance it would be moved further
        if (
            _lost_share(found) > _MUCH_LOST and _kept_m(found) < required_m + STEP_M
        ):  # else a little more was tried
            for more_m in (round(required_m + step * STEP_M, 9) for step in _STEPS_UP):
                other = self._other_search(more_m, required_m).find(briefly=True)
                if isinstance(other, NoRoute):
                    break
                found = min(found, other, key=lambda one: one.cost_s)
        if _lost_share(found) > _LOST or _missing_m(found.outlook) > _HARD_M:
            found = self._quickest_of_grid(found, asked)
        return found

    def _quickest_of_grid(self, found: DrivenRoute, asked: Promise) -> DrivenRoute:
        """Return a route, or a quicker one fitted to the grid's next clearances, as long as what is drawn there may come out quicker."""
        first = math.floor(asked.promised_m / GRID_M + 1e-6) + 1
        hard_share = _HARD_SHARE
        for number in range(first, first + _GRID_FITTED):
            required_m = round(number * GRID_M + asked.error_m, 9)
            search = replace(self._search(required_m, required_m), measurements=_OTHER_MEASUREMENTS)
            look = search.outlook
            share = hard_share if _missing_m(look) > _HARD_M else _EASY_SHARE
            if look is None or share * look.kept_cost_s >= found.cost_s:
                break
            other = search.find(briefly=True)
            if isinstance(other, NoRoute):
                break
            hard_share = max(hard_share, other.cost_s / look.kept_cost_s - _SHARE_SPREAD)
            found = min(found, other, key=lambda one: one.cost_s)
        return found

    def widest(self, asked: Promise) -> Found | NoRoute:
        """Return the route that keeps most, and what is promised for it; else why there is none."""
        most_m = self._most_drawn_m
        if isinstance(most_m, NoRoute):
            return most_m
        found = self._widest(most_m, asked.error_m, 0.0)
        if isinstance(found, DrivenRoute):
            found = self._climbed(found, asked, most_m)
            return _promised(asked, found, is_widest=True), found
        return replace(found, advice=_NOTHING_ADVICE) if found.kind is NoRouteKind.CORNER else found

    def _widest(self, most_m: float, error_m: float, enough_m: float) -> DrivenRoute | NoRoute:
        """Return the route that keeps most, aimed at the widest that lines can be drawn for and, as far as it is enough, at less."""
        best: DrivenRoute | None = None
        why: NoRoute | None = None
        for required_m in (*_downwards(most_m, error_m, enough_m), 0.0):
            if required_m < enough_m or (best is not None and _kept_m(best) >= (enough_m or required_m)):
                break
            found = self._widest_at(required_m, briefly=required_m > 0)
            if isinstance(found, DrivenRoute):
                best = found if best is None or _kept_m(found) > _kept_m(best) else best
            else:
                is_first, why = why is None, found
                least = self._widest_at(0.0) if is_first and found.at_start and not enough_m else None
                if isinstance(least, NoRoute) and least.at_start:
                    # Where the least asks too much of the start, what begins the same way does.
                    others = [
                        self._widest_at(other_m, briefly=True) for other_m in self._begun_otherwise_m(0.0)
                    ]
                    return max(
                        (other for other in others if isinstance(other, DrivenRoute)),
                        key=_kept_m,
                        default=least,
                    )
        if best is not None:
            return best
        assert why is not None
        return why

    def _climbed(self, best: DrivenRoute, asked: Promise, most_m: float) -> DrivenRoute:
        """Return a route that keeps more, asked for as anybody would ask for the next steps, as far as there is one; at last the widest drawn.

        Where the best so far creeps the widest drawn is not tried: it is harder still, and trying it was half the time of a refusal.
        """
        while (required_m := _next_step_m(best, asked.error_m)) <= most_m:
            found = self._fitted(replace(asked, promised_m=required_m - asked.error_m))
            if isinstance(found, NoRoute) or _kept_m(found) <= _kept_m(best):
                break
            best = found
        if best.is_slow or _kept_m(best) >= _whole_cm(most_m):
            return best
        found = self._widest_at(_whole_cm(most_m), briefly=True)
        return found if isinstance(found, DrivenRoute) and _kept_m(found) > _kept_m(best) else best

    def _with_more(
        self, direct: RouteSearch, first: DrivenRoute | NoRoute, asked: Promise
    ) -> DrivenRoute | NoRoute:
        """Return a route fitted to what is asked, or to more of it where that does not do; the first lines tried are known."""
        enough_m = asked.required_m
        is_held = isinstance(first, NoRoute) and first.is_held
        quick = [first]
        for required_m in (round(enough_m + step * STEP_M, 9) for step in _STEPS_UP):
            if is_held or _is_good(quick[-1]):
                break
            quick.append(self._other_search(required_m, enough_m).find(briefly=True))
        if driven := [found for found in quick if isinstance(found, DrivenRoute)]:
            return min(driven, key=lambda found: found.cost_s)
        why = direct.find()
        if isinstance(why, DrivenRoute):
            return why
        if why.at_start:
            for other_m in self._begun_otherwise_m(enough_m):
                other = self._other_search(other_m, enough_m).find(briefly=True)
                if isinstance(other, DrivenRoute):
                    return other
        most_m = 0.0 if why.is_held else self._most_drawn_m
        assert not isinstance(most_m, NoRoute)  # lines were drawn, and could not be fitted
        widest = self._widest(most_m, asked.error_m, enough_m) if most_m > enough_m else why
        return widest if isinstance(widest, DrivenRoute) and _kept_m(widest) >= enough_m else why

    def _widest_at(self, required_m: float, *, briefly: bool = False) -> DrivenRoute | NoRoute:
        """Return the route that keeps most where so much is aimed at; each is tried once."""
        if required_m not in self._tried:
            search = self._other_search(required_m, max(required_m - _ALL_M, 0.0))
            self._tried[required_m] = replace(search, any_speed=True)
        return self._tried[required_m].widest(briefly=briefly)

    def _begun_otherwise_m(self, from_m: float) -> list[float]:
        """Return the least steps above a clearance at which drawn routes begin otherwise than at it: another way, or leading away first."""
        least = self._search(from_m, 0.0)

        def is_other(step: int) -> bool:
            return self._search(round(from_m + step * STEP_M, 9), 0.0).begins_otherwise(least)

        first = bisect.bisect_left(range(1, _OTHERWISE_STEPS), x=True, key=is_other) + 1
        return [round(from_m + step * STEP_M, 9) for step in (first, first + 1)]

    def _compared(self, why: NoRoute, asked: Promise) -> NoRoute:
        """Return why there is no route, with what the widest one keeps while this vehicle drives it."""
        widest = self.widest(asked)
        if isinstance(widest, NoRoute):
            text = f"{why.text}, and this vehicle can drive none of the routes tried, at any clearance"
            return replace(why, text=text, advice=_NOTHING_ADVICE)
        promised_m = widest[0].promised_m
        facts = {**why.facts, "widest_m": round(promised_m, 3)}
        text = f"no route keeps {self.sought.asked} while driving; the widest keeps {metres(promised_m)}"
        place = self._narrowest
        if place.clearance_m < promised_m:  # the start itself, which the route leaves behind
            return replace(why, text=text, facts=facts)
        return replace(
            why,
            text=f"{text} ({metres(place.clearance_m)} along straight legs){place.where}",
            facts={**facts, "widest_drawn_m": round(place.clearance_m, 3)},
        )

    def _drawn_only(self, why: NoRoute) -> NoRoute:
        """Return why there is no route, with what the widest one keeps along straight legs; what it keeps while driven is not looked for."""
        place = self._narrowest
        facts = {key: value for key, value in why.facts.items() if key != "widest_m"}
        text = f"no route keeps {self.sought.asked}; along straight legs the widest keeps {metres(place.clearance_m)}{place.where}"
        return replace(why, text=text, facts={**facts, "widest_drawn_m": round(place.clearance_m, 3)})

    @property
    def _narrowest(self) -> NarrowestPlace:
        """The narrowest place of the widest route over all ends, where there is one."""
        places = filter(None, self.sought.narrowest_places())
        return min(places, key=lambda place: place.clearance_m)

    @cached_property
    def _most_drawn_m(self) -> float | NoRoute:
        """The most that lines can be drawn for, as slowly as can be; why there are none where there are none at all."""
        slow_mps = min(SLOW_MPS, self.vehicle.speed_mps)
        band_m = corner_forecast(0.0, self.vehicle, speed_mps=slow_mps).outside_overshoot_m
        beside_m = band_m + reserve_m(self.sought.ground)
        return widest_drawn_m(self.sought, beside_m)

    def _other_search(self, required_m: float, enough_m: float) -> RouteSearch:
        """Return what looks for a route at a clearance that was not asked for: one route is fitted to it, and given up sooner."""
        return replace(self._search(required_m, enough_m), measurements=_OTHER_MEASUREMENTS)

    def _search(self, required_m: float, enough_m: float) -> RouteSearch:
        return RouteSearch(self.sought, required_m, self.vehicle, self.heading_deg, enough_m, self._known)


def _downwards(most_m: float, error_m: float, enough_m: float) -> tuple[float, ...]:
    """Return what is aimed at for the widest route, most first: whole steps of what is promised, and the widest drawn where something is enough."""
    steps = _steps(most_m - error_m)
    # Rounded, so that what comes to the same is the same, and is fitted once.
    wholes = [round(error_m + (steps - down) * STEP_M, 9) for down in _STEPS_DOWN if steps > down]
    if not wholes or wholes[0] < enough_m:
        return (_whole_cm(most_m), *wholes)
    return (wholes[0], _whole_cm(most_m), *wholes[1:]) if enough_m else tuple(wholes)


def _whole_cm(most_m: float) -> float:
    return math.floor(100 * most_m) / 100


def _steps(promised_m: float) -> int:
    """Return how many whole steps a clearance has, rounding aside."""
    return math.floor(promised_m / STEP_M + 1e-6)


def _next_step_m(found: DrivenRoute, error_m: float) -> float:
    """Return what is aimed at to promise a step more than a route does."""
    return round(error_m + (_steps(_kept_m(found) - error_m) + 1) * STEP_M, 9)


def _is_good(found: DrivenRoute | NoRoute) -> bool:
    """Return whether there is no reason to aim at more: all is kept that was aimed at, and it is not driven slowly."""
    return isinstance(found, DrivenRoute) and found.is_whole and not found.is_slow


def _lost_share(found: DrivenRoute) -> float:
    """Return what a route costs, as a share of what its lines would as they were drawn."""
    return found.cost_s / found.outlook.kept_cost_s if found.outlook is not None else 1.0


def _missing_m(outlook: Measured | None) -> float:
    return sum(outlook.missing_m) if outlook is not None else 0.0


def _kept_m(found: DrivenRoute) -> float:
    return found.kept_m or 0.0


def _promised(asked: Promise, found: DrivenRoute, *, is_widest: bool = False) -> Promise:
    """Return what is promised for a route: what it keeps, to the centimetre; where that is less than is kept for errors, nothing."""
    kept_m = _kept_m(found)
    promised_m = max(0.0, math.floor(100 * (kept_m - asked.error_m) + 1e-6) / 100)
    if not is_widest:
        promised_m = max(promised_m, asked.promised_m)
        return replace(asked, promised_m=promised_m)
    return replace(asked, promised_m=promised_m, error_m=min(asked.error_m, kept_m))
