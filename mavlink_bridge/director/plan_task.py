"""A plan that the director waits for: making it takes a while, in which messages go on, so the shell has it made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from missions.errors import MissionError
from missions.planning.plan import plan as make_plan

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation


@dataclass(frozen=True, eq=False, slots=True)
class PlanTask:
    """A plan to be made; each is itself alone.

    Parameters
    ----------
    situation : Situation
        What was known when it was asked for.
    request : Request
        What is asked of it.
    """

    situation: Situation
    request: Request

    def made(self, planner: Callable[[Situation, Request], Plan] = make_plan) -> Plan | MissionError:
        """Make it; give it, or why there is none."""
        try:
            return planner(self.situation, self.request)
        except MissionError as error:
            return error
