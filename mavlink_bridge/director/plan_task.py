"""What the director waits for and the shell has made: plans, and ways home; making them takes a while, in which messages go on."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from missions.errors import MissionError, PlanCheckError
from missions.fence import Obstacles
from missions.planning.homeward import at_home, home_field, plan_home
from missions.planning.plan import plan as make_plan

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from missions.geo import LatLon
    from missions.planned import Plan
    from missions.request import Request
    from missions.routing.way_home import WayHome, WaysHome
    from missions.situation import Situation


@dataclass(eq=False, slots=True)
class PlanTask:
    """A plan to be made; each is itself alone.

    It is made in a thread of the shell's. A plain flag is all that passes between that and the director: one sets it, once, and the other reads it.

    Parameters
    ----------
    situation : Situation
        What was known when it was asked for.
    request : Request
        What is asked of it.
    is_dropped : bool
        Whether nobody waits for it any more.
    """

    situation: Situation
    request: Request
    is_dropped: bool = False

    def made(self, planner: Callable[..., Plan] = make_plan) -> Plan | MissionError:
        """Return the plan, or why there is none: dropped, for one; a defect of ours is a reason too, and no end of what waits for the plan."""
        try:
            return self._planned(planner)
        except MissionError as error:
            return error
        except Exception as error:  # noqa: BLE001 - whatever it is, the vehicle must not lose its bridge by it
            return _defect(error)

    def _planned(self, planner: Callable[..., Plan]) -> Plan:
        return planner(self.situation, self.request, should_stop=lambda: self.is_dropped)


class AtHomeError(MissionError):
    """The vehicle stands at a place to go home to: nothing is to be driven."""


@dataclass(eq=False, slots=True)
class HomeTask(PlanTask):
    """A plan to the nearest place to go home to.

    Parameters
    ----------
    places : mapping of str to LatLon
        Places beside home and the rally points.
    ways : WaysHome or None
        The ways home of the field, where they are known as it is now.
    """

    places: Mapping[str, LatLon] = field(default_factory=dict)
    ways: WaysHome | None = None

    def _planned(self, planner: Callable[..., Plan]) -> Plan:
        fence = replace(self.situation, obstacles=Obstacles())
        ways = self.ways or home_field(fence, self.request, self.places)
        if (place := at_home(self.situation, ways)) is not None:
            raise AtHomeError(f"at {place.name} already: there is nothing to drive", place=place.name)
        return plan_home(
            self.situation, self.request, ways, planner=planner, should_stop=lambda: self.is_dropped
        )


@dataclass(frozen=True, slots=True)
class HomeWays:
    """The ways home of a field, and the one from where the vehicle was; None where there is none."""

    ways: WaysHome
    way: WayHome | None


@dataclass(eq=False, slots=True)
class WaysTask:
    """The way home from where a vehicle is, and where the field is another one its ways home before that; each task is itself alone.

    Parameters
    ----------
    situation : Situation
        What was known when it was asked for.
    request : Request
        What is asked of every plan.
    places : mapping of str to LatLon
        Places beside home and the rally points.
    ways : WaysHome or None
        The ways home of the field, where they are known as it is now.
    """

    situation: Situation
    request: Request
    places: Mapping[str, LatLon]
    ways: WaysHome | None

    def made(self) -> HomeWays | MissionError:
        """Return the ways, or why there are none."""
        try:
            ways = self.ways or home_field(self.situation, self.request, self.places)
            pose = self.situation.pose
            assert pose is not None
            found = ways.in_order(pose.value.position, may_escape=self.request.escape)
            return HomeWays(ways, next(found, None))
        except MissionError as error:
            return error
        except Exception as error:  # noqa: BLE001 - as of a plan
            return _defect(error)


def _defect(error: Exception) -> MissionError:
    defect = PlanCheckError(f"planning failed: {type(error).__name__}: {error}. This is a bug in pbpp")
    defect.__cause__ = error
    return defect
