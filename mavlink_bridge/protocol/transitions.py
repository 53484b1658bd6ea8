"""Every transition of every protocol machine, in tables.

Two rules: all transitions live here, and this file knows nothing of messages or time. A machine turns what it receives, and the
passing of time, into an event; the table of its states holds where that leads. An event that a state does not list is ignored
there; a state that a table does not list is an end. The machines run by these tables and the state diagrams in the documentation are drawn from them.

How a transfer goes wrong, and its event: the vehicle is silent for longer than our patience (SILENCE), it is busy with
another ground station (DENIED) for longer than our patience (RIVAL_STAYS), or it refuses (REFUSAL).
"""

from __future__ import annotations

from enum import StrEnum, auto
from typing import TypeVar

StateT = TypeVar("StateT", bound=StrEnum)
EventT = TypeVar("EventT", bound=StrEnum)


class DownloadState(StrEnum):
    """Where a download is."""

    IDLE = auto()
    COUNTING = auto()  # asked how many items there are
    FETCHING = auto()  # several item requests in flight
    WAITING = auto()  # another ground station writes this list
    COMPLETE = auto()
    REFUSED = auto()
    BUSY = auto()
    SILENT = auto()
    TOO_SLOW = auto()  # it answers, but not so that the list could come within the bound


class DownloadEvent(StrEnum):
    """What moves a download."""

    START = auto()
    COUNT = auto()
    COUNT_ZERO = auto()
    ALL_ITEMS = auto()
    LIST_CHANGED = auto()  # an item past the end, or another count: ask again
    DENIED = auto()
    RETRY = auto()
    REFUSAL = auto()
    RIVAL_STAYS = auto()
    SILENCE = auto()
    TIME_IS_UP = auto()  # too few items came


DOWNLOAD = {
    DownloadState.IDLE: {DownloadEvent.START: DownloadState.COUNTING},
    DownloadState.COUNTING: {
        DownloadEvent.COUNT: DownloadState.FETCHING,
        DownloadEvent.COUNT_ZERO: DownloadState.COMPLETE,
        DownloadEvent.DENIED: DownloadState.WAITING,
        DownloadEvent.REFUSAL: DownloadState.REFUSED,
        DownloadEvent.SILENCE: DownloadState.SILENT,
    },
    DownloadState.FETCHING: {
        DownloadEvent.COUNT: DownloadState.FETCHING,
        DownloadEvent.COUNT_ZERO: DownloadState.COMPLETE,
        DownloadEvent.ALL_ITEMS: DownloadState.COMPLETE,
        DownloadEvent.LIST_CHANGED: DownloadState.COUNTING,
        DownloadEvent.DENIED: DownloadState.WAITING,
        DownloadEvent.SILENCE: DownloadState.SILENT,
        DownloadEvent.TIME_IS_UP: DownloadState.TOO_SLOW,
    },
    DownloadState.WAITING: {
        DownloadEvent.RETRY: DownloadState.COUNTING,
        DownloadEvent.RIVAL_STAYS: DownloadState.BUSY,
    },
}


class UndisturbedReadState(StrEnum):
    """Where the reading of a list that others may write is."""

    IDLE = auto()
    READING = auto()
    SETTLING = auto()  # somebody else wrote meanwhile: waiting until that is over
    COMPLETE = auto()
    FAILED = auto()  # the download did not come to its end
    DISTURBED = auto()  # others keep writing


class UndisturbedReadEvent(StrEnum):
    """What moves such a reading."""

    START = auto()
    READ = auto()
    DISTURBANCE = auto()
    QUIET = auto()
    FAILURE = auto()
    OTHERS_STAY = auto()


UNDISTURBED_READ = {
    UndisturbedReadState.IDLE: {UndisturbedReadEvent.START: UndisturbedReadState.READING},
    UndisturbedReadState.READING: {
        UndisturbedReadEvent.READ: UndisturbedReadState.COMPLETE,
        UndisturbedReadEvent.DISTURBANCE: UndisturbedReadState.SETTLING,
        UndisturbedReadEvent.FAILURE: UndisturbedReadState.FAILED,
        UndisturbedReadEvent.OTHERS_STAY: UndisturbedReadState.DISTURBED,
    },
    UndisturbedReadState.SETTLING: {
        UndisturbedReadEvent.QUIET: UndisturbedReadState.READING,
        UndisturbedReadEvent.OTHERS_STAY: UndisturbedReadState.DISTURBED,
    },
}


class UploadState(StrEnum):
    """Where one push of a list is."""

    IDLE = auto()
    ANNOUNCED = auto()  # MISSION_COUNT sent, no request yet
    SENDING = auto()  # the vehicle asks, we push ahead of it
    WAITING = auto()  # another ground station writes this list
    ACCEPTED = auto()
    REFUSED = auto()
    BUSY = auto()
    UNCONFIRMED = auto()  # over, and only a read-back shows how


class UploadEvent(StrEnum):
    """What moves a push."""

    START = auto()
    REQUEST = auto()
    OUT_OF_SEQUENCE = auto()
    ACCEPTED = auto()
    DENIED = auto()
    RETRY = auto()
    REFUSAL = auto()
    CANCELLED = auto()
    COUNT = auto()  # answers our list request: the vehicle takes no items any more
    RIVAL_STAYS = auto()
    SILENCE = auto()


UPLOAD = {
    UploadState.IDLE: {UploadEvent.START: UploadState.ANNOUNCED},
    UploadState.ANNOUNCED: {
        UploadEvent.REQUEST: UploadState.SENDING,
        UploadEvent.ACCEPTED: UploadState.ACCEPTED,
        UploadEvent.DENIED: UploadState.WAITING,
        UploadEvent.REFUSAL: UploadState.REFUSED,
        UploadEvent.SILENCE: UploadState.UNCONFIRMED,
    },
    UploadState.SENDING: {
        UploadEvent.REQUEST: UploadState.SENDING,
        UploadEvent.OUT_OF_SEQUENCE: UploadState.SENDING,
        UploadEvent.DENIED: UploadState.SENDING,
        UploadEvent.ACCEPTED: UploadState.ACCEPTED,
        UploadEvent.REFUSAL: UploadState.REFUSED,
        UploadEvent.CANCELLED: UploadState.UNCONFIRMED,
        UploadEvent.COUNT: UploadState.UNCONFIRMED,
        UploadEvent.SILENCE: UploadState.UNCONFIRMED,
    },
    UploadState.WAITING: {
        UploadEvent.RETRY: UploadState.ANNOUNCED,
        UploadEvent.RIVAL_STAYS: UploadState.BUSY,
    },
}


class VerifiedUploadState(StrEnum):
    """Where a safe upload is."""

    IDLE = auto()
    READING_OLD = auto()
    STORING_BACKUP = auto()  # waiting for the shell to have stored the old list
    CHECKING_VEHICLE = auto()  # waiting to know that it does not drive the list
    PUSHING = auto()
    READING_BACK = auto()
    RESTORING = auto()
    READING_RESTORED = auto()
    VERIFIED = auto()
    UNCHANGED = auto()  # the old list, never replaced
    RESTORED = auto()  # the old list, put back
    DIFFERENT = auto()
    UNKNOWN = auto()
    NOT_STARTED = auto()  # nothing was written


class VerifiedUploadEvent(StrEnum):
    """What moves a safe upload."""

    START = auto()
    TOO_LARGE = auto()
    READ_OLD = auto()  # what is read is the old list
    READ_WANTED = auto()  # what is read is the list to be uploaded
    READ_UNFINISHED = auto()  # part old, part new: our own unfinished write
    READ_FOREIGN = auto()  # neither: somebody else's list
    READ_AGAIN = (
        auto()
    )  # not the wanted list: believed only when a second read agrees; or written by others since
    READ_UNSTEADY = auto()  # it was another list at each read
    READ_FAILED = auto()
    OTHERS_WRITE = auto()  # another station keeps writing the list
    BACKUP_STORED = auto()
    CLEAR_TO_WRITE = auto()
    NOT_CLEAR = auto()
    PUSH_ENDED = auto()
    PUSH_AGAIN = auto()
    NO_TIME_LEFT = auto()  # not enough of it to put the old list back
    TIME_IS_UP = auto()


VERIFIED_UPLOAD = {
    VerifiedUploadState.IDLE: {
        VerifiedUploadEvent.START: VerifiedUploadState.READING_OLD,
        VerifiedUploadEvent.TOO_LARGE: VerifiedUploadState.NOT_STARTED,
    },
    VerifiedUploadState.READING_OLD: {
        VerifiedUploadEvent.READ_WANTED: VerifiedUploadState.VERIFIED,
        VerifiedUploadEvent.READ_OLD: VerifiedUploadState.STORING_BACKUP,
        VerifiedUploadEvent.READ_FAILED: VerifiedUploadState.NOT_STARTED,
        VerifiedUploadEvent.OTHERS_WRITE: VerifiedUploadState.NOT_STARTED,
        VerifiedUploadEvent.TIME_IS_UP: VerifiedUploadState.NOT_STARTED,
    },
    VerifiedUploadState.STORING_BACKUP: {
        VerifiedUploadEvent.BACKUP_STORED: VerifiedUploadState.CHECKING_VEHICLE
    },
    VerifiedUploadState.CHECKING_VEHICLE: {
        VerifiedUploadEvent.CLEAR_TO_WRITE: VerifiedUploadState.PUSHING,
        VerifiedUploadEvent.NOT_CLEAR: VerifiedUploadState.NOT_STARTED,
        VerifiedUploadEvent.READ_AGAIN: VerifiedUploadState.READING_OLD,
        VerifiedUploadEvent.OTHERS_WRITE: VerifiedUploadState.NOT_STARTED,
        VerifiedUploadEvent.TIME_IS_UP: VerifiedUploadState.NOT_STARTED,
    },
    VerifiedUploadState.PUSHING: {
        VerifiedUploadEvent.PUSH_ENDED: VerifiedUploadState.READING_BACK,
        VerifiedUploadEvent.TIME_IS_UP: VerifiedUploadState.UNKNOWN,
    },
    VerifiedUploadState.READING_BACK: {
        VerifiedUploadEvent.READ_WANTED: VerifiedUploadState.VERIFIED,
        VerifiedUploadEvent.READ_AGAIN: VerifiedUploadState.READING_BACK,
        VerifiedUploadEvent.PUSH_AGAIN: VerifiedUploadState.PUSHING,
        VerifiedUploadEvent.READ_OLD: VerifiedUploadState.UNCHANGED,
        VerifiedUploadEvent.READ_UNFINISHED: VerifiedUploadState.RESTORING,
        VerifiedUploadEvent.NO_TIME_LEFT: VerifiedUploadState.DIFFERENT,
        VerifiedUploadEvent.READ_FOREIGN: VerifiedUploadState.DIFFERENT,
        VerifiedUploadEvent.READ_UNSTEADY: VerifiedUploadState.UNKNOWN,
        VerifiedUploadEvent.READ_FAILED: VerifiedUploadState.UNKNOWN,
        VerifiedUploadEvent.OTHERS_WRITE: VerifiedUploadState.UNKNOWN,
        VerifiedUploadEvent.TIME_IS_UP: VerifiedUploadState.UNKNOWN,
    },
    VerifiedUploadState.RESTORING: {
        VerifiedUploadEvent.PUSH_ENDED: VerifiedUploadState.READING_RESTORED,
        VerifiedUploadEvent.TIME_IS_UP: VerifiedUploadState.UNKNOWN,
    },
    VerifiedUploadState.READING_RESTORED: {
        VerifiedUploadEvent.READ_OLD: VerifiedUploadState.RESTORED,
        VerifiedUploadEvent.READ_AGAIN: VerifiedUploadState.READING_RESTORED,
        VerifiedUploadEvent.PUSH_AGAIN: VerifiedUploadState.RESTORING,
        VerifiedUploadEvent.READ_UNFINISHED: VerifiedUploadState.DIFFERENT,
        VerifiedUploadEvent.READ_FOREIGN: VerifiedUploadState.DIFFERENT,
        VerifiedUploadEvent.READ_UNSTEADY: VerifiedUploadState.UNKNOWN,
        VerifiedUploadEvent.READ_FAILED: VerifiedUploadState.UNKNOWN,
        VerifiedUploadEvent.OTHERS_WRITE: VerifiedUploadState.UNKNOWN,
        VerifiedUploadEvent.TIME_IS_UP: VerifiedUploadState.UNKNOWN,
    },
}


class ParameterState(StrEnum):
    """Where a parameter transfer is."""

    IDLE = auto()
    LISTING = auto()  # all were asked for, they stream in
    ASKING = auto()  # single ones are asked for
    SETTING = auto()
    DONE = auto()
    SILENT = auto()


class ParameterEvent(StrEnum):
    """What moves a parameter transfer."""

    START_ALL = auto()
    START_SOME = auto()
    START_SET = auto()
    GAPS = auto()  # the stream has ended and some are missing
    ALL_HERE = auto()
    CONFIRMED = auto()
    GIVEN_UP = auto()  # the vehicle answers, but not with what is missing
    SILENCE = auto()  # or too little came in too long a time


PARAMETERS = {
    ParameterState.IDLE: {
        ParameterEvent.START_ALL: ParameterState.LISTING,
        ParameterEvent.START_SOME: ParameterState.ASKING,
        ParameterEvent.START_SET: ParameterState.SETTING,
    },
    ParameterState.LISTING: {
        ParameterEvent.GAPS: ParameterState.ASKING,
        ParameterEvent.ALL_HERE: ParameterState.DONE,
        ParameterEvent.SILENCE: ParameterState.SILENT,
    },
    ParameterState.ASKING: {
        ParameterEvent.ALL_HERE: ParameterState.DONE,
        ParameterEvent.GIVEN_UP: ParameterState.DONE,
        ParameterEvent.SILENCE: ParameterState.SILENT,
    },
    ParameterState.SETTING: {
        ParameterEvent.CONFIRMED: ParameterState.DONE,
        ParameterEvent.GIVEN_UP: ParameterState.DONE,
        ParameterEvent.SILENCE: ParameterState.SILENT,
    },
}


class CommandState(StrEnum):
    """Where a command is."""

    IDLE = auto()
    SENT = auto()
    IN_PROGRESS = auto()
    DONE = auto()
    SILENT = auto()


class CommandEvent(StrEnum):
    """What moves a command."""

    START = auto()
    PROGRESS = auto()
    RESULT = auto()
    SILENCE = auto()


COMMAND = {
    CommandState.IDLE: {CommandEvent.START: CommandState.SENT},
    CommandState.SENT: {
        CommandEvent.PROGRESS: CommandState.IN_PROGRESS,
        CommandEvent.RESULT: CommandState.DONE,
        CommandEvent.SILENCE: CommandState.SILENT,
    },
    CommandState.IN_PROGRESS: {
        CommandEvent.PROGRESS: CommandState.IN_PROGRESS,
        CommandEvent.RESULT: CommandState.DONE,
        CommandEvent.SILENCE: CommandState.SILENT,
    },
}


class VersionState(StrEnum):
    """Where the question for AUTOPILOT_VERSION is."""

    IDLE = auto()
    ASKING = auto()
    TOLD = auto()
    NOT_TOLD = auto()


class VersionEvent(StrEnum):
    """What moves the question for AUTOPILOT_VERSION."""

    START = auto()
    VERSION = auto()
    GIVEN_UP = auto()  # refused, or granted without its coming
    SILENCE = auto()


VERSION = {
    VersionState.IDLE: {VersionEvent.START: VersionState.ASKING},
    VersionState.ASKING: {
        VersionEvent.VERSION: VersionState.TOLD,
        VersionEvent.GIVEN_UP: VersionState.NOT_TOLD,
        VersionEvent.SILENCE: VersionState.NOT_TOLD,
    },
}


class FindState(StrEnum):
    """Where the search for the vehicle is."""

    IDLE = auto()
    LISTENING = auto()  # no autopilot heard yet
    COMPARING = auto()  # one was heard; others may follow
    FOUND = auto()
    NOT_FOUND = auto()


class FindEvent(StrEnum):
    """What moves the search for the vehicle."""

    START = auto()
    HEARD = auto()
    NAMED_ONE_HEARD = auto()
    TIME_IS_UP = auto()
    CHOICE_FAILED = auto()
    IDENTITY_TAKEN = auto()  # somebody else speaks with our ids


FIND = {
    FindState.IDLE: {FindEvent.START: FindState.LISTENING},
    FindState.LISTENING: {
        FindEvent.HEARD: FindState.COMPARING,
        FindEvent.NAMED_ONE_HEARD: FindState.FOUND,
        FindEvent.CHOICE_FAILED: FindState.NOT_FOUND,
        FindEvent.IDENTITY_TAKEN: FindState.NOT_FOUND,
    },
    FindState.COMPARING: {
        FindEvent.HEARD: FindState.COMPARING,
        FindEvent.NAMED_ONE_HEARD: FindState.FOUND,
        FindEvent.TIME_IS_UP: FindState.FOUND,
        FindEvent.CHOICE_FAILED: FindState.NOT_FOUND,
        FindEvent.IDENTITY_TAKEN: FindState.NOT_FOUND,
    },
}


class SwitchState(StrEnum):
    """Where a mode switch is."""

    IDLE = auto()
    SENT = auto()
    ACCEPTED = auto()
    SEEN = auto()
    REFUSED = auto()
    LEFT = auto()  # accepted, or done unseen for all that is known, and shown is something else
    UNANSWERED = auto()


class SwitchEvent(StrEnum):
    """What moves it."""

    START = auto()
    ACCEPTED = auto()
    REFUSED = auto()
    SEEN = auto()
    LEFT = auto()
    SILENCE = auto()


MODE_SWITCH: dict[SwitchState, dict[SwitchEvent, SwitchState]] = {
    SwitchState.IDLE: {SwitchEvent.START: SwitchState.SENT},
    SwitchState.SENT: {
        SwitchEvent.ACCEPTED: SwitchState.ACCEPTED,
        SwitchEvent.REFUSED: SwitchState.REFUSED,
        SwitchEvent.SEEN: SwitchState.SEEN,
        SwitchEvent.LEFT: SwitchState.LEFT,
        SwitchEvent.SILENCE: SwitchState.UNANSWERED,
    },
}
MODE_SWITCH_UNTIL_SEEN: dict[SwitchState, dict[SwitchEvent, SwitchState]] = {
    **MODE_SWITCH,
    SwitchState.SENT: {
        SwitchEvent.ACCEPTED: SwitchState.ACCEPTED,
        SwitchEvent.SEEN: SwitchState.SEEN,
        SwitchEvent.LEFT: SwitchState.LEFT,
        SwitchEvent.SILENCE: SwitchState.UNANSWERED,
    },
    SwitchState.ACCEPTED: {
        SwitchEvent.SEEN: SwitchState.SEEN,
        SwitchEvent.SILENCE: SwitchState.UNANSWERED,
    },
}
"""The same where the answer may be that to another command: only a heartbeat that shows the mode ends it."""

MODE_SWITCH_BY_HEARTBEAT: dict[SwitchState, dict[SwitchEvent, SwitchState]] = {
    **MODE_SWITCH_UNTIL_SEEN,
    SwitchState.SENT: {
        **MODE_SWITCH_UNTIL_SEEN[SwitchState.SENT],
        SwitchEvent.REFUSED: SwitchState.REFUSED,
    },
    SwitchState.ACCEPTED: {
        **MODE_SWITCH_UNTIL_SEEN[SwitchState.ACCEPTED],
        SwitchEvent.LEFT: SwitchState.LEFT,
    },
}
"""The same where the vehicle accepts what it does not do (PX4 1.17), but refuses only what it does not do: then it, or somebody, has decided otherwise."""


def _with_ends(table: dict[StateT, dict[EventT, StateT]]) -> dict[StateT, dict[EventT, StateT]]:
    """Return a table with a row for each state."""
    return {state: table.get(state, {}) for state in type(next(iter(table)))}


TABLES = {
    "find": _with_ends(FIND),
    "download": _with_ends(DOWNLOAD),
    "undisturbed_read": _with_ends(UNDISTURBED_READ),
    "upload": _with_ends(UPLOAD),
    "verified_upload": _with_ends(VERIFIED_UPLOAD),
    "parameters": _with_ends(PARAMETERS),
    "command": _with_ends(COMMAND),
    "mode_switch": _with_ends(MODE_SWITCH_BY_HEARTBEAT),  # the others have some of its steps
    "version": _with_ends(VERSION),
}
"""All tables by name, for the documentation and the tests."""
