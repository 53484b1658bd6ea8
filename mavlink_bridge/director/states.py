"""Every transition of the director, in one table.

All transitions live here, and this file knows nothing of messages or time. The director turns what it hears, the passing of time and
the outcomes of its machines into cues; a cue that a state does not list is ignored there. The state diagram in the documentation is
drawn from this table.
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
    VERIFIED = auto()  # the mission is on the vehicle
    STARTING = auto()  # arming where asked, switching to AUTO, to the first item
    DRIVING = auto()
    ARRIVED = auto()
    LET_GO = (
        auto()
    )  # the operator took over, or somebody changed the mission: nothing is done until a new target comes
    LOST = auto()  # the vehicle's heartbeat is missing
    DONE = auto()  # a single job has come to its end
    FAILED = auto()  # a single job could not be done


class Cue(StrEnum):
    """What moves the director."""

    FOUND = auto()
    LEARNT = auto()
    TARGET = auto()  # a route is wanted
    TARGET_WHILE_MOVING = auto()  # the same, and the vehicle moves and may be stopped
    HELD = auto()
    PLANNED = auto()
    NO_PLAN = auto()
    UPLOAD = auto()
    UPLOAD_VERIFIED = auto()
    DRIVE = auto()
    RESUMED = auto()  # our mission is still being driven
    STARTED = auto()
    REACHED = auto()
    TAKEN_OVER = auto()
    SILENCE = auto()
    HEARD = auto()
    REBOOTED = auto()
    TROUBLE = auto()  # a machine came to a bad end; the vehicle is as the event says
    END = auto()  # the single job is done
    GIVE_UP = auto()  # the single job cannot be done


_ALWAYS = {Cue.SILENCE: State.LOST, Cue.REBOOTED: State.LEARNING, Cue.GIVE_UP: State.FAILED}
_WANTED = {Cue.TARGET: State.PLANNING, Cue.TARGET_WHILE_MOVING: State.HOLDING}

TRANSITIONS: dict[State, dict[Cue, State]] = {
    State.LISTENING: {Cue.FOUND: State.LEARNING, Cue.GIVE_UP: State.FAILED},
    State.LEARNING: {**_ALWAYS, Cue.LEARNT: State.READY, Cue.REBOOTED: State.LEARNING},
    State.READY: {**_ALWAYS, **_WANTED, Cue.RESUMED: State.DRIVING},
    State.HOLDING: {
        **_ALWAYS,
        Cue.HELD: State.PLANNING,
        Cue.TAKEN_OVER: State.LET_GO,
        Cue.TROUBLE: State.READY,
    },
    State.PLANNING: {
        **_ALWAYS,
        **_WANTED,
        Cue.PLANNED: State.PROPOSED,
        Cue.NO_PLAN: State.READY,
        Cue.TAKEN_OVER: State.LET_GO,
    },
    State.PROPOSED: {
        **_ALWAYS,
        **_WANTED,
        Cue.UPLOAD: State.UPLOADING,
        Cue.TAKEN_OVER: State.LET_GO,
        Cue.END: State.DONE,
    },
    State.UPLOADING: {
        Cue.UPLOAD_VERIFIED: State.VERIFIED,
        Cue.TROUBLE: State.READY,
        Cue.GIVE_UP: State.FAILED,
    },
    State.VERIFIED: {
        **_ALWAYS,
        **_WANTED,
        Cue.DRIVE: State.STARTING,
        Cue.TAKEN_OVER: State.LET_GO,
        Cue.END: State.DONE,
    },
    State.STARTING: {
        **_ALWAYS,
        **_WANTED,
        Cue.STARTED: State.DRIVING,
        Cue.TROUBLE: State.VERIFIED,
        Cue.TAKEN_OVER: State.LET_GO,
    },
    State.DRIVING: {
        **_ALWAYS,
        **_WANTED,
        Cue.REACHED: State.ARRIVED,
        Cue.TAKEN_OVER: State.LET_GO,
    },
    State.ARRIVED: {**_ALWAYS, **_WANTED, Cue.TAKEN_OVER: State.LET_GO, Cue.END: State.DONE},
    State.LET_GO: {**_ALWAYS, **_WANTED},
    State.LOST: {Cue.HEARD: State.LEARNING, Cue.REBOOTED: State.LEARNING, Cue.GIVE_UP: State.FAILED},
    State.DONE: {},
    State.FAILED: {},
}
