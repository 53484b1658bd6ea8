"""What is shown of the director and of the drive: where it is, how far, how near to the fence; and what came of a HOLD. Clock-free."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

from mavlink_bridge.console.view.places import finite, place
from mavlink_bridge.console.view.sections import DriveView, HoldView
from mavlink_bridge.director import ON_VEHICLE, State

if TYPE_CHECKING:
    from mavlink_bridge.director import Director
    from mavlink_bridge.director.drive_watch import DriveWatch
    from missions.geo import LatLon
    from missions.planned import Plan

STATE_TEXTS = {
    State.LISTENING: "listening for the vehicle",
    State.LEARNING: "reading parameters, fence and mission",
    State.READY: "ready",
    State.HOLDING: "stopping",
    State.PLANNING: "planning",
    State.PROPOSED: "planned",
    State.UPLOADING: "uploading and reading back",
    State.WITHDRAWING: "taken over; ending the upload",
    State.VERIFIED: "verified on the vehicle",
    State.ENFORCED: "verified on the vehicle, its fence enforced",
    State.STARTING: "switching to AUTO",
    State.DRIVING: "driving",
    State.ARRIVED: "arrived",
    State.LET_GO: "interrupted: waiting for a new target",
    State.CLASHING: "another program uses our ids; finishing the upload",
    State.CLASHED: "another program uses our ids",
    State.LOST: "no heartbeat",
    State.DONE: "done",
    State.FAILED: "failed",
}

_STANDING_MPS = 0.3  # as `director.halter.STILL_MPS`
_NO_ANSWER_S = 10.0  # longer than a HOLD is repeated for; chosen, not measured


class DriveShown:
    """Keeps what is shown of a drive, also after its end."""

    def __init__(self) -> None:
        self._state: State | None = None
        self._since_s = 0.0
        self._drive: DriveWatch | None = None
        self._last = DriveView()
        self._least_at: LatLon | None = None
        self._least_m = math.inf

    def view(self, director: Director, plan_id: str, now_s: float, *, can_resume: bool) -> DriveView:
        """Return what is shown now.

        Parameters
        ----------
        director : Director
        plan_id : str
            Of the plan that stands.
        now_s : float
            The time.
        can_resume : bool
            Whether there is a target to go on to.
        """
        if director.state is not self._state:
            self._state, self._since_s = director.state, now_s
        self._follow(director)
        facts = self._of_drive(director.drive, director.plan)
        way = director.way_home
        trouble = director.trouble
        self._last = DriveView(
            state=str(director.state),
            state_text=STATE_TEXTS[director.state],
            since_s=round(self._since_s, 1),
            awaits_start=director.state in ON_VEHICLE,
            awaits_upload=director.awaits_confirmation,
            plan_id=plan_id,
            can_resume=can_resume,
            is_left_armed=director.is_left_armed,
            trouble=str(trouble) if trouble is not None else "",
            way_home=f"{way.place.name}, {way.length_m:.0f} m, about {way.time_s:.0f} s"
            if way is not None
            else director.no_way_home and f"none: {director.no_way_home}",
            **facts,
        )
        return self._last

    def _follow(self, director: Director) -> None:
        """Note where the drive came nearest to a fence."""
        drive, pose = director.drive, director.situation.pose
        if drive is not self._drive:
            self._drive = drive
            if drive is not None:
                self._least_at, self._least_m = None, math.inf
        if drive is not None and drive.least_clearance_m < self._least_m and pose is not None:
            self._least_m, self._least_at = drive.least_clearance_m, pose.value.position

    def _of_drive(self, drive: DriveWatch | None, plan: Plan | None) -> dict[str, Any]:
        """Return the facts of the drive under way, else those of the last one."""
        if drive is None or plan is None:
            last = self._last
            kept = [
                "begun_s",
                "next_seq",
                "progress_m",
                "length_m",
                "left_m",
                "driven_m",
                "deviation_m",
                "corridor_ok",
                "least_clearance_m",
                "least_at",
                "asked_m",
                "breaches",
            ]
            return {name: getattr(last, name) for name in kept}
        # Before the first position of the drive its watch knows the way behind the first waypoint only.
        left_m = drive.distance_left_m if drive.driven_m else plan.length_m
        return {
            "is_driving": True,
            "begun_s": round(drive.begun_s, 1),
            "next_seq": drive.item,
            "progress_m": round(max(0.0, plan.length_m - left_m), 1),
            "length_m": round(plan.length_m, 1),
            "left_m": round(left_m, 1),
            "eta_s": round(drive.time_left_s if drive.driven_m else plan.duration_s, 1),
            "driven_m": round(drive.driven_m, 1),
            "deviation_m": round(drive.deviation_m, 2),
            "corridor_ok": not drive.is_outside,
            "least_clearance_m": finite(drive.least_clearance_m, 2),
            "least_at": place(self._least_at) if self._least_at is not None else None,
            "asked_m": finite(plan.clearance_m),
            "breaches": drive.breaches,
        }


NO_LINK = "the link is closed: HOLD is sent if it opens within a minute; use the transmitter, or the e-stop"


class HoldShown:
    """Follows the newest HOLD that a page asked for to what the vehicle did."""

    def __init__(self) -> None:
        self._view = HoldView()

    def ask(self, page: str, now_s: float, *, is_linked: bool = True) -> None:
        """Take notice that a page asked for HOLD, and that it is being sent, or will be where the link is closed just now."""
        text = "HOLD sent; waiting for the vehicle" if is_linked else NO_LINK
        state: Literal["sent", "no_answer"] = "sent" if is_linked else "no_answer"
        self._view = HoldView(state=state, text=text, by=page, asked_s=now_s)

    def view(self, director: Director, now_s: float) -> HoldView:
        """Return what came of it so far: what heartbeats show, never what was acknowledged."""
        view, asked_s = self._view, self._view.asked_s
        if asked_s is None or view.state == "none":
            return view
        doing = director.watch.doing(now_s)
        if view.state in ("answered", "stopped") and doing.mode not in (None, doing.modes.hold):
            self._view = HoldView(text="the vehicle has left HOLD", by=view.by)
            return self._view
        if view.state == "stopped":
            return view
        is_shown = director.watch.heartbeat_s > asked_s and doing.mode == doing.modes.hold
        if is_shown and view.state != "answered":
            self._view = HoldView(
                state="answered",
                text="the vehicle is in HOLD: it rolls on until it stands",
                by=view.by,
                asked_s=asked_s,
                answered_s=now_s,
            )
        elif view.state == "answered" and doing.speed_mps is not None and doing.speed_mps <= _STANDING_MPS:
            self._view = HoldView(
                state="stopped",
                text="the vehicle is in HOLD and stands",
                by=view.by,
                asked_s=asked_s,
                answered_s=view.answered_s,
            )
        elif view.state == "sent" and now_s - asked_s > _NO_ANSWER_S:
            self._view = HoldView(
                state="no_answer",
                text="no heartbeat shows HOLD: use the transmitter, or the e-stop",
                by=view.by,
                asked_s=asked_s,
            )
        return self._view
