"""What can go wrong with fences, files and missions.

::

    MissionError
    ├── InvalidPositionError     a latitude or longitude out of range, or too near a pole
    ├── FenceError               a fence that cannot be used: which polygon, which item
    ├── FenceMissingError        no fence is known, or only a part of it
    ├── MissionFormatError       a file that cannot be read: file, line, what was expected
    ├── VehicleError             a parameter or a footprint that no vehicle can have
    ├── RequestError             what is asked of a plan makes no sense: which word, and its value
    ├── SituationError           position, home or target is not known
    ├── PlanStoppedError         nobody waits for the plan any more
    ├── PlanCheckError           a finished route failed its own check: a defect, never to be driven
    └── RouteError               no route
        ├── StartBlockedError    the vehicle stands where it must not be
        ├── TargetBlockedError   the target lies where the vehicle must not be
        ├── NoRouteError         start and target are not connected
        ├── ExtrapolatedError    a route outside what was measured, which promises nothing and so is not uploaded
        └── MissionTooLongError  the vehicle cannot hold that many items
"""

from __future__ import annotations

from collections.abc import Callable


class MissionError(Exception):
    """Root of the package's errors; ``details`` holds the numbers a person or a script needs."""

    def __init__(self, message: str, **details: object) -> None:
        super().__init__(message)
        self.details = details


class InvalidPositionError(MissionError):
    """A latitude or longitude that is not a number, out of range, or too near a pole."""


class FenceError(MissionError):
    """A fence that cannot be used; the message says which polygon or item and why."""


class FenceMissingError(MissionError):
    """No fence is known, or only a part of one was transferred."""


class MissionFormatError(MissionError):
    """A file that cannot be read; the message says which file, where, and what was expected."""


class VehicleError(MissionError):
    """A parameter out of its range, or an invalid footprint; the message says which and its value."""


class RequestError(MissionError):
    """What is asked of a plan makes no sense; the message says which word, its value and what was expected."""


class PlanStoppedError(MissionError):
    """Planning was stopped from outside (``should_stop``): nobody waits for the plan any more."""

    @classmethod
    def when(cls, should_stop: Callable[[], bool] | None) -> Callable[[], bool] | None:
        """Return what ends planning wherever it is asked whether to stop, and at once if so: half an answer is of no use to anybody.

        Raises
        ------
        PlanStoppedError
            It is to stop already.
        """
        if should_stop is None:
            return None

        def asked() -> bool:
            if should_stop():
                raise cls("planning was stopped: the plan is no longer needed")
            return False

        asked()
        return asked


class SituationError(MissionError):
    """Something a plan needs (position, home, target) is not known."""


class RouteError(MissionError):
    """No route keeps what was asked."""


class StartBlockedError(RouteError):
    """The vehicle stands inside an exclusion or outside the fence; the message says in which fence, how far in, and where free ground is."""


class TargetBlockedError(RouteError):
    """The target lies inside an exclusion, outside the fence or too near a fence; the message says which, and the nearest free point."""


class NoRouteError(RouteError):
    """Start and target are not connected; the message says which fences separate them."""


class ExtrapolatedError(RouteError):
    """A route that lies outside what was measured, so that nothing is promised of it: it is not taken to a vehicle; the message says why."""


class MissionTooLongError(RouteError):
    """The mission needs more items than the vehicle holds; the message says how many it needs and what it holds."""


class PlanCheckError(MissionError):
    """A finished route failed its check against the fence: a defect of this program."""
