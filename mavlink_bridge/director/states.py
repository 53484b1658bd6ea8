"""Every transition of the director, in one table.

All transitions live here, and this file knows nothing of messages or time. The director's parts turn what they hear, the passing of time and
the outcomes of machines into cues; a cue that a state does not list is ignored there. What parts tell each other without a move of the state
is a notice. The state diagram in the documentation is drawn from this table; what is done on each cue and notice stands in `handlers.HANDLERS`.
"""

from __future__ import annotations

from enum import StrEnum, auto


class State(StrEnum):
    """Where the director is."""

    LISTENING = auto()  # no heartbeat of the vehicle yet
    LEARNING = auto()  # parameters, fence, mission, home, position
    READY = auto()  # everything is known; no route is wanted or none was found
    HOLDING = auto()  # a new route is wanted: the vehicle is stopped first
    PLANNING = auto()
    PROPOSED = auto()  # a plan stands; it is reported, or waits for a yes
    UPLOADING = auto()
    WITHDRAWING = auto()  # taken over in mid-upload: no half mission is left behind, nothing more is done
    VERIFIED = auto()  # the mission is on the vehicle
    ENFORCED = (
        auto()
    )  # and its fence counts, as far as it will; on ArduPilot a fence counts at once, and this is passed over
    STARTING = auto()  # looking once more, arming where asked, switching to AUTO, to the first item
    DRIVING = auto()
    ARRIVED = auto()
    LET_GO = auto()  # the operator took over, or another station changed the mission: waits for a new target
    CLASHING = (
        auto()
    )  # somebody spoke with our ids in mid-upload: no half mission is left behind, nothing more is done
    CLASHED = auto()  # somebody speaks with our ids: waits for a target that is typed, and heeds nothing else
    LOST = auto()  # the vehicle's heartbeat is missing
    DONE = auto()  # a single job has come to its end
    FAILED = auto()  # a single job could not be done


class Cue(StrEnum):
    """What moves the director."""

    FOUND = auto()
    LEARNT = auto()
    TARGET = auto()  # a route is wanted
    TARGET_WHILE_MOVING = auto()  # the same, and the vehicle may move and may be stopped
    HELD = auto()  # it stands, or it is known where it will stand
    NOT_FORESEEN = auto()  # no plan can be made from there: it has to stand first
    PLANNED = auto()
    NO_PLAN = auto()
    UPLOAD = auto()
    UPLOAD_VERIFIED = auto()
    ENFORCED = auto()  # the vehicle's fence counts by now, and it takes the mission
    RENEWED = auto()  # its fence is another one, and does not count yet
    DRIVE = auto()
    ADOPTED = auto()  # the vehicle is on a drive that an earlier run has begun
    RESUMED = auto()  # our mission is being driven, though we did not start it just now
    STILL_THERE = auto()  # our mission is on the vehicle as we left it
    STARTED = auto()
    REACHED = auto()
    TAKEN_OVER = auto()  # somebody else switched the mode, disarmed, or changed the mission
    CLASH = auto()  # a frame with our own ids that we did not send
    TYPED = auto()  # after that a target was typed: all is read anew, then it is gone into
    SILENCE = auto()
    HEARD = auto()
    REBOOTED = auto()
    TROUBLE = auto()  # a machine came to a bad end; the vehicle is as the event says
    END = auto()  # the single job is done
    GIVE_UP = auto()  # the single job cannot be done


class Notice(StrEnum):
    """What one part signals for others to act upon, where the state stays or where the answer decides how it moves."""

    TARGET_CAME = auto()  # the inbox holds it
    TARGET_WAITS = auto()  # it came at an inconvenient time
    TARGET_AGAIN = auto()  # it was said once more
    TARGET_IS_DUE = auto()  # one that has waited may be gone into
    ROUTE_WANTED = auto()  # by somebody
    ROUTE_OUTDATED = auto()  # by nobody: what it rests on was changed
    FENCE_CHANGED = auto()
    OBSTACLES_CHANGED = auto()
    MISSION_READ = auto()  # the vehicle's mission was read again
    MISSION_TAKEN = auto()  # it is somebody else's now
    MISSION_HEARD = auto()  # its end may be a target
    RALLY_HEARD = auto()
    WAYS_KNOWN = auto()  # the ways home were laid out anew
    WAY_CHOSEN = auto()  # a way home inside the mission, by the operator
    LEARNING_FAILED = auto()
    GONE_ON = auto()  # on the route, as far as was better than a HOLD at once
    HOLD_ASKED = auto()  # by a person at a page of ours, who has let go of everything else with it
    HOLD_ENDED = auto()  # taken, or not
    HELD_UNSEEN = auto()  # taken, and whoever took the vehicle before that was not seen
    SWITCHED_BACK = auto()  # the vehicle accepted AUTO, and is in another mode
    DRIVEN_IN_HOLD = auto()  # somebody sends the vehicle to a place in the mode that stops
    MISSION_INVALID = auto()  # the vehicle does not drive our mission any more, and holds
    UPLOAD_ENDED = auto()  # well or badly; the state has moved already
    DRIVE_ENDED = auto()


Signal = Cue | Notice
"""What a part hands up to the director."""

_ALWAYS = {
    Cue.SILENCE: State.LOST,
    Cue.REBOOTED: State.LEARNING,
    Cue.CLASH: State.CLASHED,
    Cue.GIVE_UP: State.FAILED,
}
_WANTED = {Cue.TARGET: State.PLANNING, Cue.TARGET_WHILE_MOVING: State.HOLDING}
_OURS = {**_ALWAYS, **_WANTED, Cue.TAKEN_OVER: State.LET_GO}

TRANSITIONS: dict[State, dict[Cue, State]] = {
    State.LISTENING: {Cue.FOUND: State.LEARNING, Cue.GIVE_UP: State.FAILED},
    State.LEARNING: {**_ALWAYS, Cue.LEARNT: State.READY, Cue.TAKEN_OVER: State.LEARNING},
    State.READY: {
        **_OURS,
        Cue.ADOPTED: State.DRIVING,
        Cue.RESUMED: State.DRIVING,
        Cue.STILL_THERE: State.VERIFIED,
    },
    State.HOLDING: {
        **_ALWAYS,
        Cue.TARGET_WHILE_MOVING: State.HOLDING,
        Cue.HELD: State.PLANNING,
        Cue.TAKEN_OVER: State.LET_GO,
        Cue.TROUBLE: State.READY,
    },
    State.PLANNING: {
        **_OURS,
        Cue.PLANNED: State.PROPOSED,
        Cue.NO_PLAN: State.READY,
        Cue.NOT_FORESEEN: State.HOLDING,
    },
    State.PROPOSED: {**_OURS, Cue.UPLOAD: State.UPLOADING, Cue.END: State.DONE},
    State.UPLOADING: {
        Cue.UPLOAD_VERIFIED: State.VERIFIED,
        Cue.TAKEN_OVER: State.WITHDRAWING,
        Cue.REBOOTED: State.WITHDRAWING,
        Cue.CLASH: State.CLASHING,
        Cue.TROUBLE: State.READY,
        Cue.GIVE_UP: State.FAILED,
    },
    State.WITHDRAWING: {
        Cue.TAKEN_OVER: State.WITHDRAWING,
        Cue.CLASH: State.CLASHING,
        Cue.UPLOAD_VERIFIED: State.LET_GO,
        Cue.TROUBLE: State.LET_GO,
        Cue.GIVE_UP: State.FAILED,
    },
    State.VERIFIED: {
        **_OURS,
        Cue.ENFORCED: State.ENFORCED,
        Cue.DRIVE: State.STARTING,
        Cue.RESUMED: State.DRIVING,
        Cue.END: State.DONE,
    },
    State.ENFORCED: {
        **_OURS,
        Cue.RENEWED: State.VERIFIED,
        Cue.DRIVE: State.STARTING,
        Cue.RESUMED: State.DRIVING,
    },
    State.STARTING: {
        **_OURS,
        Cue.STARTED: State.DRIVING,
        Cue.RENEWED: State.VERIFIED,
        Cue.TROUBLE: State.VERIFIED,
    },
    State.DRIVING: {**_OURS, Cue.REACHED: State.ARRIVED},
    State.ARRIVED: {**_OURS, Cue.END: State.DONE},
    State.LET_GO: {**_ALWAYS, **_WANTED},
    State.CLASHING: {
        Cue.CLASH: State.CLASHING,  # again, after a target was typed: that counts for nothing either
        Cue.UPLOAD_VERIFIED: State.CLASHED,
        Cue.TROUBLE: State.CLASHED,
        Cue.GIVE_UP: State.FAILED,
    },
    State.CLASHED: {Cue.TYPED: State.LEARNING, Cue.END: State.DONE, Cue.GIVE_UP: State.FAILED},
    State.LOST: {
        Cue.HEARD: State.LEARNING,
        Cue.REBOOTED: State.LEARNING,
        Cue.CLASH: State.CLASHED,
        Cue.GIVE_UP: State.FAILED,
    },
    State.DONE: {},
    State.FAILED: {},
}

ON_VEHICLE = frozenset({State.VERIFIED, State.ENFORCED})
"""States in which our mission is on the vehicle, and nobody drives it."""

AT_WORK = frozenset(
    {
        State.HOLDING,
        State.UPLOADING,
        State.WITHDRAWING,
        State.CLASHING,
        State.STARTING,
        State.DRIVING,
    }
)
"""States in which something is under way on the vehicle that should not be left in the middle."""
