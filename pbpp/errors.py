"""Errors of the planner, all under one root.

::

    PlanningError
    ├── InvalidGeometryError    a ring or a point that cannot be used
    ├── NoPathError             start and goal lie in free space, but no path joins them
    ├── StartBlockedError       the start lies outside free space
    ├── GoalBlockedError        the goal lies outside free space
    ├── SearchStoppedError      the caller stopped the search before it had any path
    └── TooManyBlocksError      the block partition would be larger than its limit
"""

from __future__ import annotations


class PlanningError(Exception):
    """Root of all errors of the planner."""


class InvalidGeometryError(PlanningError):
    """A ring or a point cannot be used.

    Parameters
    ----------
    message : str
        What is wrong.
    part : tuple of (str, int), optional
        Which input: ``("inclusion", i)`` or ``("exclusion", i)``.
    """

    def __init__(self, message: str, part: tuple[str, int] | None = None) -> None:
        super().__init__(message)
        self.part = part


class NoPathError(PlanningError):
    """Start and goal lie in free space, but no path joins them.

    Parameters
    ----------
    clearance_m : float
        The clearance asked for, in metres.
    """

    def __init__(self, clearance_m: float) -> None:
        super().__init__(f"no path joins start and goal at a clearance of {clearance_m:g} m")
        self.clearance_m = clearance_m


class _BlockedError(PlanningError):
    """An end of the path lies outside free space."""

    end = "point"

    def __init__(
        self,
        point_m: tuple[float, float],
        clearance_m: float,
        distance_m: float,
        nearest_free_m: tuple[float, float] | None,
    ) -> None:
        place = f"the {self.end} ({point_m[0]:.3f}, {point_m[1]:.3f}) m"
        if nearest_free_m is None:
            text = f"{place} is blocked: there is no free space at a clearance of {clearance_m:g} m"
        else:
            text = (
                f"{place} is blocked: at a clearance of {clearance_m:g} m free space is {distance_m:.3f} m away, "
                f"at ({nearest_free_m[0]:.3f}, {nearest_free_m[1]:.3f}) m"
            )
        super().__init__(text)
        self.point_m = point_m
        self.clearance_m = clearance_m
        self.distance_m = distance_m
        self.nearest_free_m = nearest_free_m


class StartBlockedError(_BlockedError):
    """The start lies outside free space.

    Parameters
    ----------
    point_m : tuple of float
        The start, (east, north) in metres.
    clearance_m : float
        The clearance asked for, in metres.
    distance_m : float
        How far free space is from it, in metres; infinite if there is none.
    nearest_free_m : tuple of float or None
        The nearest point of free space, (east, north) in metres; None if there is none.
    """

    end = "start"


class GoalBlockedError(_BlockedError):
    """The goal lies outside free space.

    Parameters
    ----------
    point_m : tuple of float
        The goal, (east, north) in metres.
    clearance_m : float
        The clearance asked for, in metres.
    distance_m : float
        How far free space is from it, in metres; infinite if there is none.
    nearest_free_m : tuple of float or None
        The nearest point of free space, (east, north) in metres; None if there is none.
    """

    end = "goal"


class SearchStoppedError(PlanningError):
    """The caller stopped the search before it had any path."""

    def __init__(self) -> None:
        super().__init__("the search was stopped before it had found any path")


class TooManyBlocksError(PlanningError):
    """The block partition would be larger than its limit.

    Parameters
    ----------
    blocks : int
        How many blocks there would be at least.
    limit : int
        The most that are made.
    """

    def __init__(self, blocks: int, limit: int) -> None:
        super().__init__(
            f"the partition would have at least {blocks} blocks, more than the limit of {limit}: "
            'use method="optimal", which needs no blocks and is shorter'
        )
        self.blocks = blocks
        self.limit = limit
