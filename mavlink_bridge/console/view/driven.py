"""What was driven against what was promised: one drive, place by place."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mavlink_bridge.console.view.places import finite, place
from mavlink_bridge.console.view.plans import plan_id
from mavlink_bridge.console.view.sections import AfterSample, AfterView
from missions.picture.outlines import driven_samples

if TYPE_CHECKING:
    from mavlink_bridge.director import Director
    from mavlink_bridge.director.drive_watch import DriveWatch
    from missions.geo import LatLon
    from missions.planned import Plan
    from missions.situation import Known, Pose

_MOST_PLACES = 20_000  # of one drive; chosen: more than an hour of positions
_SHOWN = 400  # of them in the profile, as of a plan's


@dataclass(eq=False, slots=True)
class Driven:
    """A drive as it was seen."""

    plan: Plan
    begun_s: float
    times_s: list[float] = field(default_factory=list)
    positions: list[LatLon] = field(default_factory=list)
    speeds_mps: list[float] = field(default_factory=list)
    breaches: int = 0


class DriveLog:
    """Writes down the drive under way."""

    def __init__(self) -> None:
        self._drive: DriveWatch | None = None
        self._driven: Driven | None = None

    def follow(self, director: Director, pose: Known[Pose]) -> None:
        """Take where the vehicle is."""
        drive = director.drive
        if drive is None or director.plan is None or pose.time_s is None:
            return
        if drive is not self._drive:
            self._drive, self._driven = drive, Driven(director.plan, drive.begun_s)
        driven = self._driven
        assert driven is not None
        driven.breaches = drive.breaches
        is_new = not driven.times_s or driven.times_s[-1] != pose.time_s
        if is_new and len(driven.times_s) < _MOST_PLACES:
            driven.times_s.append(pose.time_s)
            driven.positions.append(pose.value.position)
            driven.speeds_mps.append(pose.value.speed_mps)

    def take(self) -> Driven | None:
        """Return the drive that has ended; None where none was seen."""
        driven, self._driven = self._driven, None
        return driven if driven is not None and len(driven.positions) > 1 else None


def after_view(driven: Driven) -> AfterView:
    """Return a drive against its plan."""
    plan = driven.plan
    samples = driven_samples(plan, driven.positions)
    least = min(samples, key=lambda one: one.clearance_m)
    every = max(1, math.ceil(len(samples) / _SHOWN))
    kept = sorted({*range(0, len(samples), every), samples.index(least), len(samples) - 1})
    return AfterView(
        plan_id=plan_id(plan),
        promised_m=finite(plan.clearance_m),
        least_m=finite(least.clearance_m, 2),
        least_at=place(driven.positions[samples.index(least)]) if math.isfinite(least.clearance_m) else None,
        predicted_s=round(plan.duration_s, 1),
        took_s=round(driven.times_s[-1] - driven.begun_s, 1),
        driven_m=round(samples[-1].along_m, 2),
        length_m=round(plan.length_m, 2),
        deviation_max_m=round(max(one.deviation_m for one in samples), 2),
        outside_max_m=round(max(one.outside_m for one in samples), 2),
        breaches=driven.breaches,
        profile=tuple(
            AfterSample(
                s_m=round(samples[index].along_m, 2),
                clearance_m=finite(samples[index].clearance_m, 2),
                deviation_m=round(samples[index].deviation_m, 2),
                speed_mps=round(driven.speeds_mps[index], 2),
                time_s=round(driven.times_s[index], 1),
            )
            for index in kept
        ),
    )
