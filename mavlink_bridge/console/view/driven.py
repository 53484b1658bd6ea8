"""What was driven against what was promised: one drive, piece by piece and place by place.

A drive is all that leads to one request: who stops it by HOLD and goes on drives another piece of it, on a plan of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from mavlink_bridge.console.view.places import finite, place
from mavlink_bridge.console.view.plans import plan_id
from mavlink_bridge.console.view.sections import AfterPiece, AfterSample, AfterView
from missions.picture.outlines import driven_samples

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.director import Director
    from mavlink_bridge.director.drive_watch import DriveWatch
    from missions.geo import LatLon
    from missions.picture.outlines import DrivenSample
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Known, Pose

_MOST_PLACES = 20_000
"""Of one piece: more than an hour of positions. Beyond that every second one is left out, and the rest come half as often; chosen."""

_SHOWN = 400  # places in a piece's profile, as of a plan's
_KEPT_M = 0.005  # half of the last digit that clearances are shown with


class Passed(NamedTuple):
    """Where the vehicle was."""

    time_s: float
    position: LatLon
    speed_mps: float


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """What was driven of one plan without a stop for another.

    Parameters
    ----------
    plan : Plan
        What was promised.
    begun_s : float
        When.
    passed : tuple of Passed
        Where it was.
    least_m : float
        The least clearance of all positions that were heard, also of those left out of `passed`.
    breaches : int
    has_arrived : bool
        Whether it went to the plan's end.
    """

    plan: Plan
    begun_s: float
    passed: tuple[Passed, ...]
    least_m: float
    breaches: int
    has_arrived: bool


@dataclass(eq=False, slots=True)
class _PieceUnderWay:
    """One that is being driven."""

    watch: DriveWatch
    plan: Plan
    begun_s: float
    passed: list[Passed] = field(default_factory=list)
    least_m: float = math.inf
    every: int = 1
    skipped: int = 0

    def add(self, here: Passed) -> None:
        """Take where the vehicle is; the newest place is always there."""
        if self.passed and self.passed[-1].time_s == here.time_s:
            return
        if self.skipped and self.skipped < self.every:
            self.passed.pop()
        self.skipped = self.skipped + 1 if self.skipped < self.every else 1
        self.passed.append(here)
        if len(self.passed) > _MOST_PLACES:
            self.passed = self.passed[:-1:2] + self.passed[-1:]
            self.every, self.skipped = 2 * self.every, 1

    @property
    def whole(self) -> Piece:
        """What is known of it by now."""
        watch = self.watch
        return Piece(
            self.plan, self.begun_s, tuple(self.passed), self.least_m, watch.breaches, watch.has_arrived
        )


class DriveLog:
    """Writes down the newest drive, in the bridge's loop; `so_far` may be asked from any thread."""

    def __init__(self) -> None:
        self._request: Request | None = None
        self._pieces: tuple[_PieceUnderWay, ...] = ()

    def follow(self, director: Director, pose: Known[Pose]) -> None:
        """Take where the vehicle is."""
        watch, plan = director.drive, director.plan
        if watch is None or plan is None or pose.time_s is None:
            return
        last = self._pieces[-1] if self._pieces else None
        if last is None or watch is not last.watch or plan is not last.plan:
            request = director.orders.request
            goes_on = last is not None and request == self._request and not last.watch.has_arrived
            is_same_watch = last is not None and watch is last.watch
            begun_s = pose.time_s if is_same_watch else watch.begun_s
            last, self._request = _PieceUnderWay(watch, plan, begun_s), request
            self._pieces = (*self._pieces, last) if goes_on or is_same_watch else (last,)
        last.least_m = min(last.least_m, watch.least_clearance_m)
        last.add(Passed(pose.time_s, pose.value.position, pose.value.speed_mps))

    def so_far(self) -> tuple[Piece, ...]:
        """Return the pieces of the newest drive, in their order; those of which hardly anything was seen are left out."""
        return tuple(piece for one in self._pieces if len((piece := one.whole).passed) > 1)


def after_view(pieces: Sequence[Piece]) -> AfterView | None:
    """Return a drive against what was promised for each of its pieces; None where nothing was driven."""
    if not pieces:
        return None
    views = [_piece_view(one) for one in pieces]
    least = min(views, key=lambda one: math.inf if one.least_m is None else one.least_m)
    promised = [one.promised_m for one in views if one.promised_m is not None]
    return AfterView(
        plan_id=views[-1].plan_id,
        promised_m=min(promised) if len(promised) == len(views) else None,
        is_kept=all(one.is_kept for one in views),
        has_arrived=views[-1].has_arrived,
        least_m=least.least_m,
        least_at=least.least_at,
        predicted_s=views[0].predicted_s,
        took_s=round(pieces[-1].passed[-1].time_s - pieces[0].begun_s, 1),
        driven_m=round(sum(one.driven_m for one in views), 2),
        length_m=views[0].length_m,
        deviation_max_m=max(one.deviation_max_m for one in views),
        outside_max_m=max(one.outside_max_m for one in views),
        breaches=sum(one.breaches for one in views),
        pieces=tuple(views),
    )


def _piece_view(piece: Piece) -> AfterPiece:
    plan, passed = piece.plan, piece.passed
    samples = driven_samples(plan, [one.position for one in passed])
    at = min(range(len(samples)), key=lambda index: samples[index].clearance_m)
    least_m = min(samples[at].clearance_m, piece.least_m)
    promised_m = plan.clearance_m
    return AfterPiece(
        plan_id=plan_id(plan),
        promised_m=finite(promised_m),
        is_kept=piece.breaches == 0 and least_m >= (promised_m or 0.0) - _KEPT_M,
        has_arrived=piece.has_arrived,
        least_m=finite(least_m, 2),
        least_at=place(passed[at].position) if math.isfinite(least_m) else None,
        predicted_s=round(plan.duration_s, 1),
        took_s=round(passed[-1].time_s - piece.begun_s, 1),
        driven_m=round(samples[-1].along_m, 2),
        length_m=round(plan.length_m, 2),
        deviation_max_m=round(max(one.deviation_m for one in samples), 2),
        outside_max_m=round(max(one.outside_m for one in samples), 2),
        breaches=piece.breaches,
        profile=_profile(samples, passed, at),
    )


def _profile(samples: Sequence[DrivenSample], passed: Sequence[Passed], at: int) -> tuple[AfterSample, ...]:
    every = max(1, math.ceil(len(samples) / _SHOWN))
    kept = sorted({*range(0, len(samples), every), at, len(samples) - 1})
    return tuple(
        AfterSample(
            s_m=round(samples[index].along_m, 2),
            clearance_m=finite(samples[index].clearance_m, 2),
            deviation_m=round(samples[index].deviation_m, 2),
            speed_mps=round(passed[index].speed_mps, 2),
            time_s=round(passed[index].time_s, 1),
        )
        for index in kept
    )
