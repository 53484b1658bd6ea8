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
            return planner(self.situation, self.request, should_stop=lambda: self.is_dropped)
        except MissionError as error:
            return error
        except Exception as error:  # noqa: BLE001 - whatever it is, the vehicle must not lose its bridge by it
            defect = PlanCheckError(
                f"planning failed: {type(error).__name__}: {error}. This is a bug in pbpp"
            )
            defect.__cause__ = error
            return defect
