"""A plan that the director waits for: making it takes a while, in which messages go on, so the shell has it made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from missions.errors import MissionError, PlanCheckError
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
        """Return the plan, or why there is none; a defect of ours is one reason, and no end of what waits for the plan."""
        try:
            return planner(self.situation, self.request)
        except MissionError as error:
            return error
        except Exception as error:  # noqa: BLE001 - whatever it is, the vehicle must not lose its bridge by it
            defect = PlanCheckError(f"planning broke down: {type(error).__name__}: {error}. This is a defect")
            defect.__cause__ = error
            return defect
