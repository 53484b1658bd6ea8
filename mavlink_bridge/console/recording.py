"""A log as it is shown: the director's run over it, kept so that any moment of it can be looked at. No web library is needed."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from mavlink_bridge.console.view.drives import DriveShown
from mavlink_bridge.console.view.events import event_view, text_view
from mavlink_bridge.console.view.fields import asked_view, fence_view, mission_view
from mavlink_bridge.console.view.instruments import Instruments
from mavlink_bridge.console.view.places import place, places
from mavlink_bridge.console.view.plans import no_route_view, plan_id, plan_view
from mavlink_bridge.console.view.sections import ReplayView
from mavlink_bridge.console.view.track import Track
from mavlink_bridge.director import EventName, State
from mavlink_bridge.errors import LogError
from mavlink_bridge.replay.replay import replay_log
from missions.errors import MissionError

if TYPE_CHECKING:
    from pathlib import Path

    from mavlink_bridge.console.view.sections import (
        DriveView,
        EventView,
        FenceView,
        LinkView,
        PlanView,
        VehicleView,
    )
    from mavlink_bridge.director import Director, Orders
    from mavlink_bridge.mavlink.messages import Frame
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation

_EVERY_S = 0.2
"""Between two moments that are kept, where nothing is decided: positions come four times a second."""

_KEPT_DRAWINGS = 64  # of fences and plans; chosen: each is some ten kilobytes


@dataclass(frozen=True, eq=False, slots=True)
class Moment:
    """What was known and decided at a time."""

    time_s: float
    situation: Situation
    request: Request
    plan: Plan | None
    trouble: MissionError | None
    has_our_mission: bool
    current_seq: int | None
    link: LinkView
    vehicle: VehicleView
    drive: DriveView


class Recording:
    """A log that was read.

    Parameters
    ----------
    log : Path
        A telemetry log; with a journal of the bridge beside it the run is repeated.
    orders : Orders
        What is asked of plans where there is no journal.

    Raises
    ------
    LogError
        It cannot be used, or holds nothing of a vehicle.
    """

    def __init__(self, log: Path, orders: Orders) -> None:
        self.name = log.name
        self.moments: list[Moment] = []
        self.events: list[EventView] = []
        self.track = Track()
        self._request = orders.request
        self._instruments = Instruments()
        self._drive = DriveShown()
        self._kept: tuple[object, ...] = ()
        for event in replay_log(log, orders, look=self._look):
            if event.name is not EventName.PROGRESS:
                self.events.append(event_view(event))
        if not self.moments:
            raise LogError(f"{log} holds no vehicle's messages", file=str(log))
        self.events.sort(key=lambda one: one.time_s)
        self._times_s = [one.time_s for one in self.moments]

    @property
    def begin_s(self) -> float:
        """The time of the first moment."""
        return self._times_s[0]

    @property
    def end_s(self) -> float:
        """The time of the last one."""
        return self._times_s[-1]

    def moment(self, time_s: float) -> Moment:
        """Return the moment at a time: the last one up to then, the first before all."""
        return self.moments[max(0, bisect_right(self._times_s, time_s) - 1)]

    def _look(self, director: Director, frame: Frame, time_s: float) -> None:
        """Keep the moment where something was decided, or a little time has passed."""
        situation = director.situation
        if (frame.system, frame.component) == (situation.system, situation.component):
            self._instruments.receive(frame, time_s)
            self.events += [text_view(one, time_s) for one in self._instruments.take_texts()]
        pose = situation.pose
        if pose is not None:
            self.track.add(time_s, pose.value.position, pose.value.speed_mps, situation.mode)
        kept = (director.state, director.plan, situation.fence, situation.mission)
        is_same = all(one is other for one, other in zip(kept, self._kept, strict=False)) and self._kept
        if is_same and time_s - self.moments[-1].time_s < _EVERY_S:
            return
        if self.moments and time_s < self.moments[-1].time_s:
            return  # the log's clock was set back
        self._kept = kept
        trouble = director.trouble
        stands = plan_id(director.plan) if director.plan is not None else ""
        self.moments.append(
            Moment(
                time_s=time_s,
                situation=situation,
                request=director.orders.request,
                plan=director.plan,
                trouble=trouble if isinstance(trouble, MissionError) else None,
                has_our_mission=director.has_our_mission,
                current_seq=self._instruments.current_seq,
                link=self._instruments.link(
                    director.heard_s, time_s, is_lost=director.state is State.LOST, trouble=""
                ),
                vehicle=self._instruments.vehicle(situation, self._request.footprint),
                drive=self._drive.view(director, stands, time_s, can_resume=False),
            )
        )


class RecordedSections:
    """The sections of a log at any moment; what is drawn anew only where it differs is kept.

    Parameters
    ----------
    recording : Recording
        The log.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._fence = lru_cache(_KEPT_DRAWINGS)(_fence)
        self._plan = lru_cache(_KEPT_DRAWINGS)(_plan)

    def at(self, time_s: float) -> dict[str, Any]:
        """Return the sections at a time."""
        recording = self._recording
        moment = recording.moment(time_s)
        situation = moment.situation
        rally = situation.rally
        now_s = min(max(time_s, recording.begin_s), recording.end_s)
        return {
            "link": moment.link,
            "vehicle": moment.vehicle,
            "drive": moment.drive,
            "fence": self._fence(_Grounds(situation, moment.request)),
            "plan": self._plan(_Pictured(moment)),
            "mission": mission_view(
                situation, matches_plan=moment.has_our_mission, current_seq=moment.current_seq
            ),
            "rally": places(point.position for point in rally.value) if rally else (),
            "home": place(situation.home.value) if situation.home else None,
            "request": asked_view(moment.request),
            "replay": ReplayView(
                begin_s=recording.begin_s, end_s=recording.end_s, now_s=now_s, name=recording.name
            ),
        }


class _Grounds:
    """What a fence's drawing rests on; two are one where nothing of that differs."""

    def __init__(self, situation: Situation, request: Request) -> None:
        self.situation = situation
        self.request = request
        self._key = (situation.fence, situation.home, situation.obstacles.known, request)

    def __hash__(self) -> int:
        return hash((id(self._key[0]), id(self._key[1])))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Grounds):
            return NotImplemented
        return self._key == other._key and self.situation.parameters == other.situation.parameters


class _Pictured:
    """What a plan's drawing rests on."""

    def __init__(self, moment: Moment) -> None:
        self.moment = moment
        self._key = moment.plan if moment.plan is not None else moment.trouble

    def __hash__(self) -> int:
        return hash(id(self._key))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Pictured) and self._key is other._key


def _fence(grounds: _Grounds) -> FenceView:
    return fence_view(grounds.situation, grounds.request, "log")


def _plan(drawn: _Pictured) -> PlanView | None:
    moment = drawn.moment
    if moment.plan is not None:
        return replace(plan_view(moment.plan, moment.situation, moment.request), by="director")
    if moment.trouble is not None:
        return replace(no_route_view(moment.trouble, moment.situation, moment.request), by="director")
    return None
