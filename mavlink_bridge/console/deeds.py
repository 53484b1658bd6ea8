"""What a page may have done to the vehicle: each deed as data, what permission and control it needs, and how it is refused. Clock-free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from mavlink_bridge.console.wire import Problem

if TYPE_CHECKING:
    from mavlink_bridge.console.answers import Looked
    from mavlink_bridge.console.view.sections import Permissions
    from missions.fence import Fence
    from missions.geo import LatLon
    from missions.request import Tour


class Refusal(Exception):  # noqa: N818 - an answer to a page, not a failure
    """A deed is not done; the problem says why, the status is HTTP's."""

    def __init__(self, problem: Problem, status: int = 409) -> None:
        super().__init__(problem.message)
        self.problem = problem
        self.status = status


@dataclass(frozen=True, slots=True)
class Deed:
    """What a page asks for.

    Attributes
    ----------
    needs : tuple of str
        The permissions it needs.
    needs_control : bool
        Whether only the page that holds control may ask for it.
    only_stops : bool
        Whether it only ends what is wanted: it is done though nobody waits for its answer any more.
    """

    needs: ClassVar[tuple[str, ...]] = ()
    needs_control: ClassVar[bool] = True
    only_stops: ClassVar[bool] = False


@dataclass(frozen=True, slots=True)
class TakeTargets(Deed):
    """Take targets: the bridge plans to them from where the vehicle is, and proposes the plan. With ``--drive`` a moving vehicle is held for it."""

    request: Tour


@dataclass(frozen=True, slots=True)
class UploadPlan(Deed):
    """Write a plan: the one that stands, or one that was looked at, once the bridge has made the same."""

    needs: ClassVar[tuple[str, ...]] = ("upload",)
    plan_id: str = ""
    looked: Looked | None = None


@dataclass(frozen=True, slots=True)
class UploadFence(Deed):
    """Write a fence."""

    needs: ClassVar[tuple[str, ...]] = ("upload",)
    fence: Fence


@dataclass(frozen=True, slots=True)
class Restore(Deed):
    """Put a backup back."""

    needs: ClassVar[tuple[str, ...]] = ("upload",)
    name: str


@dataclass(frozen=True, slots=True)
class Start(Deed):
    """Drive the plan that is verified on the vehicle."""

    needs: ClassVar[tuple[str, ...]] = ("upload", "drive")
    plan_id: str


@dataclass(frozen=True, slots=True)
class Resume(Deed):
    """Go on to the last target: a new route from where the vehicle stands, uploaded and driven at once."""

    needs: ClassVar[tuple[str, ...]] = ("upload", "drive")


@dataclass(frozen=True, slots=True)
class Hold(Deed):
    """Stop the vehicle: every page may, whoever holds control."""

    needs: ClassVar[tuple[str, ...]] = ("drive",)
    needs_control: ClassVar[bool] = False
    only_stops: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class TakeControl(Deed):
    """Take notice that the page has control now: what another one waits for is not done any more."""

    only_stops: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class GiveControl(Deed):
    """Take notice that the page has given up control: what it waits for is not done any more."""

    only_stops: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class Blocked(Deed):
    """An obstacle is there."""

    position: LatLon | None
    radius_m: float


@dataclass(frozen=True, slots=True)
class ClearBlocked(Deed):
    """Forget all obstacles."""


_OPTIONS = {"upload": "--upload", "drive": "--upload --drive", "arm": "--upload --drive --arm"}


def check_permitted(deed: Deed, can: Permissions) -> None:
    """Refuse a deed that the server was not started for.

    Raises
    ------
    Refusal
        It needs a permission that was not given.
    """
    for name in deed.needs:
        if not getattr(can, name):
            raise Refusal(
                Problem(
                    kind="not_permitted",
                    message=f"pbpp serve was started without --{name}: nothing was sent",
                    advice=f"start it with {_OPTIONS[name]}",
                ),
                403,
            )


NOT_HERE = Refusal(
    Problem(
        kind="not_here",
        message="there is no vehicle here",
        advice="pbpp serve --connect CONNECTION serves one; pbpp serve --demo a simulated one",
    ),
    409,
)
"""Refuses what needs a vehicle where there is none."""


def not_now(message: str, advice: str = "") -> Refusal:
    """Return the refusal of what cannot be done as things are."""
    return Refusal(Problem(kind="not_now", message=message, advice=advice))
