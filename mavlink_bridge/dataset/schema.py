"""The tables of a dataset: their columns with types and units. docs/dataset.md is made from this."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

_PATTERN = re.compile(r"[\[*?]")

SCHEMA_VERSION: Final = 2
"""Goes up when a column is renamed, removed or means something else; a dataset of another version is refused, not guessed at."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column: name with its unit, DuckDB's type, what it means. Where a value is not known it is NULL."""

    name: str
    sql: str
    meaning: str


@dataclass(frozen=True, slots=True)
class Table:
    """One table.

    Parameters
    ----------
    name : str
    about : str
        What a row is.
    columns : tuple of Column
        In the files; `PARTITION` comes from the folders' names.
    is_partitioned : bool
        By month and vehicle; otherwise the table is small.
    """

    name: str
    about: str
    columns: tuple[Column, ...]
    is_partitioned: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its columns in the files."""
        return tuple(column.name for column in self.columns)

    @property
    def every_column(self) -> tuple[Column, ...]:
        """Its columns as they are read, those from the folders' names included."""
        return (*self.columns, *PARTITION) if self.is_partitioned else self.columns


PARTITION: Final = (
    Column(
        "month",
        "VARCHAR",
        "when the log begins, UTC: 2026-08; `undated` where the log has no times of its own",
    ),
    Column("vehicle", "INTEGER", "MAVLink system id"),
)
"""What the folders' names say: ``month=2026-08/vehicle=1``."""

_LOG = Column("log", "VARCHAR", "the log: the first 16 hexadecimal digits of its SHA-256")
_TIME = Column("time_s", "DOUBLE", "since the log's first record, by a clock that only goes forward")
_DRIVE = Column("drive", "INTEGER", "the drive's number in its log and vehicle, from 1")
_LAT = Column("lat_deg", "DOUBLE", "latitude, WGS 84")
_LON = Column("lon_deg", "DOUBLE", "longitude, WGS 84")


def _texts(*names_and_meanings: str) -> tuple[Column, ...]:
    return tuple(
        Column(name, "VARCHAR", meaning)
        for name, meaning in zip(names_and_meanings[::2], names_and_meanings[1::2], strict=True)
    )


def _numbers(sql: str, *names_and_meanings: str) -> tuple[Column, ...]:
    return tuple(
        Column(name, sql, meaning)
        for name, meaning in zip(names_and_meanings[::2], names_and_meanings[1::2], strict=True)
    )


_FILES = Table(
    "files",
    "a file that was looked at, by its path; several may be the same log",
    (
        *_texts("path", "the file"),
        *_numbers(
            "BIGINT", "bytes", "its size", "changed_ns", "when it was last changed, nanoseconds since 1970"
        ),
        _LOG,
    ),
    is_partitioned=False,
)
_LOGS = Table(
    "logs",
    "a log, by its content, whether it could be read or not",
    (
        _LOG,
        *_texts("sha256", "checksum of the file", "name", "the file's name"),
        Column("bytes", "BIGINT", "the file's size"),
        *_texts(
            "problem", "why it could not be read; NULL where it could, and then the columns below are filled"
        ),
        Column("begins_utc", "TIMESTAMP", "its first record; NULL in a log without times"),
        Column("duration_s", "DOUBLE", "from the first record to the last"),
        Column("has_timestamps", "BOOLEAN", "false for a raw log"),
        Column("clock_jumps", "INTEGER", "how often its clock was set while it was written"),
        *_texts("clock_trouble", "says if its clock stands still; then its times and speeds mean nothing"),
        *_numbers(
            "BIGINT",
            *("frames", "messages in it", "unknown_ids", "messages of ids that pbpp's dialect does not have"),
            *("bad_crcs", "messages with a wrong checksum", "gaps", "places where bytes had to be skipped"),
            *("skipped_bytes", "bytes in those places", "orphan_timestamps", "times without a message"),
            *(
                "untimed_frames",
                "messages without a time",
                "wrong_timestamps",
                "times far off their neighbours",
            ),
            *(
                "truncated_bytes",
                "bytes of a record that the end of the file cuts off",
                "broken_gzip",
                "1 if the gzip data ends too early",
            ),
        ),
        Column("vehicles", "INTEGER", "how many vehicles were heard"),
    ),
    is_partitioned=False,
)
_VEHICLES = Table(
    "vehicles",
    "a vehicle in a log",
    (
        _LOG,
        Column("begins_utc", "TIMESTAMP", "the log's first record"),
        *_texts("site", "where: home, else the first position, rounded to 0.01° (about 1 km): 40.07,-105.23"),
        *_numbers("INTEGER", "component", "MAVLink component id", "mav_type", "MAV_TYPE of its heartbeat"),
        *_texts("firmware", "the autopilot's version, where the log tells it"),
        *_numbers("DOUBLE", "home_lat_deg", "home at the log's end", "home_lon_deg", "home at the log's end"),
        *_numbers(
            "INTEGER",
            *("mission_items", "items of the mission it holds at the end, as it counts them"),
            *(
                "rally_points",
                "rally points it holds at the end",
                "fences",
                "different fences that held in turn",
            ),
            *("inclusion_polygons", "of the last fence", "exclusion_polygons", "of the last fence"),
            *("inclusion_circles", "of the last fence", "exclusion_circles", "of the last fence"),
            *("fence_vertices", "of the last fence"),
        ),
        *_texts("fence_trouble", "why its fence is not known"),
        Column("driven_m", "DOUBLE", "while armed, without the wandering of a standing vehicle's position"),
        *_numbers(
            "INTEGER",
            *(
                "positions",
                "GLOBAL_POSITION_INT in all",
                "positions_without_fix",
                "positions without a place",
            ),
            *("targets_seen", "targets it was sent", "parameters_seen", "parameters that the log reports"),
        ),
        Column("least_clearance_m", "DOUBLE", "of its track while armed; 0 where it left the fence"),
        Column("nearest_time_s", "DOUBLE", "when the track was nearest"),
        *_numbers(
            "DOUBLE",
            "nearest_lat_deg",
            "where the track was nearest",
            "nearest_lon_deg",
            "where the track was nearest",
        ),
        *_texts("nearest_zone", "to which zone"),
    ),
)
_MESSAGES = Table(
    "messages",
    "all messages of one type from one sender in a log",
    (
        _LOG,
        *_numbers(
            "INTEGER", "system", "the sender", "component", "the sender", "message_id", "MAVLink's number"
        ),
        *_texts("name", "MAVLink's name"),
        Column("count", "BIGINT", "how many"),
        Column("rate_hz", "DOUBLE", "mean rate between the first and the last"),
    ),
)
_POSITIONS = Table(
    "positions",
    "a GLOBAL_POSITION_INT",
    (
        _LOG,
        _TIME,
        Column("boot_s", "DOUBLE", "the vehicle's own time since it booted"),
        Column("lat_deg", "DOUBLE", "latitude, WGS 84; NULL before the first fix (0/0 on the wire)"),
        Column("lon_deg", "DOUBLE", "longitude, WGS 84; NULL before the first fix"),
        *_numbers("FLOAT", "speed_mps", "over ground", "heading_deg", "clockwise from north"),
        Column("item", "INTEGER", "the mission item (seq) that it drove to, by MISSION_CURRENT"),
        *_texts("mode", "by its heartbeat"),
        Column("armed", "BOOLEAN", "by its heartbeat"),
        Column(
            "clearance_m", "FLOAT", "of the track from the position before to this one; NULL without a fence"
        ),
    ),
)
_DRIVES = Table(
    "drives",
    "a drive of a mission: armed, in AUTO",
    (
        _LOG,
        _DRIVE,
        Column("begun_s", "DOUBLE", "since the log's first record"),
        *_texts("site", "as in `vehicles`"),
        *_numbers(
            "INTEGER",
            *("first_item", "the first mission item (seq) driven to", "last_item", "the last one"),
            *("items", "waypoints from the first item on", "reached", "how many of them were reached"),
        ),
        Column("arrived", "BOOLEAN", "whether the last of them was"),
        Column("took_s", "DOUBLE", "from the start to the last waypoint reached, by the vehicle's own clock"),
        *_numbers("DOUBLE", "driven_s", "the whole drive", "driven_m", "the whole drive"),
    ),
)
_GRADES = Table(
    "grades",
    "how a drive compares with what the drive model predicts; one for each row of `drives`",
    (
        _LOG,
        _DRIVE,
        Column("least_clearance_m", "DOUBLE", "of the track; NULL where no fence was known"),
        *_numbers(
            "DOUBLE",
            "deviation_m",
            "the farthest off the mission's lines",
            "mean_deviation_m",
            "the mean of it",
        ),
        Column(
            "outside_m",
            "DOUBLE",
            "the farthest outside the predicted corridor; NULL where nothing could be predicted",
        ),
        Column(
            "is_as_predicted", "BOOLEAN", "whether it stayed within the corridor and 0.25 m of position error"
        ),
        *_numbers(
            "DOUBLE",
            *("predicted_took_s", "as predicted", "predicted_least_clearance_m", "as predicted"),
            *("predicted_deviation_m", "as predicted"),
        ),
        *_texts("notes", "what to know before comparing; several are separated by semicolons"),
    ),
)
_LEGS = Table(
    "legs",
    "a leg of a drive, with the corner at its end",
    (
        _LOG,
        _DRIVE,
        Column("leg", "INTEGER", "its number in the drive, from 1"),
        Column("item", "INTEGER", "the mission item (seq) that it leads to"),
        *_numbers("DOUBLE", "length_m", "from waypoint to waypoint"),
        *_numbers("DOUBLE", "speed_mps", "in force: the mission's, or that of a station's DO_CHANGE_SPEED"),
        *_numbers("DOUBLE", "driven_mps", "the fastest it was in its middle third"),
        *_numbers("DOUBLE", "predicted_driven_mps", "as predicted: on a short leg less than `speed_mps`"),
        *_numbers(
            "DOUBLE",
            *(
                "straight_m",
                "the farthest off its line in its middle third",
                "predicted_straight_m",
                "as predicted",
            ),
            *("turn_deg", "change of course at its end, to the right positive; NULL at the last leg"),
        ),
        Column("stands", "BOOLEAN", "whether the rover was predicted to stop or turn on the spot there"),
        *_numbers(
            "DOUBLE",
            *("inside_cut_m", "the farthest off the two legs to the inside of the turn"),
            *("outside_overshoot_m", "the farthest to its outside"),
            *("predicted_inside_cut_m", "as predicted", "predicted_outside_overshoot_m", "as predicted"),
            *("inside_beyond_m", "how far outside the predicted corridor it was there, inside the turn"),
            *("outside_beyond_m", "the same outside the turn"),
        ),
        Column(
            "is_bounded",
            "BOOLEAN",
            "whether corners like this kept within the drive model when it was measured",
        ),
        Column(
            "gap_m",
            "DOUBLE",
            "the farthest from one position to the next: between them a cut may have been deeper",
        ),
        Column("is_whole", "BOOLEAN", "whether it drove the leg and on, past the middle of the next"),
    ),
)
_BREACHES = Table(
    "breaches",
    "a stretch outside the fence while armed, or a breach that the autopilot reported",
    (
        _LOG,
        *_texts("source", "`track`: measured on the positions; `autopilot`: reported by FENCE_STATUS"),
        _TIME,
        Column("ended_s", "DOUBLE", "since the log's first record; NULL for a reported one"),
        Column("deepest_m", "DOUBLE", "the farthest from allowed ground"),
        *_numbers("DOUBLE", "lat_deg", "where it was deepest", "lon_deg", "where it was deepest"),
        *_numbers("DOUBLE", "begun_lat_deg", "where it began", "begun_lon_deg", "where it began"),
        *_texts("zone", "the zone that forbids it there"),
        *_numbers(
            "INTEGER",
            "count",
            "the autopilot's count of breaches",
            "breach_type",
            "FENCE_BREACH, as MAVLink numbers it",
        ),
    ),
)
_TARGETS = Table(
    "targets",
    "a place that somebody sent the vehicle to (the last 1,000 of a log)",
    (
        *(_LOG, _TIME, _LAT, _LON),
        *_texts("source", "which message"),
        *_numbers(
            "INTEGER",
            "station_system",
            "who sent it",
            "station_component",
            "who sent it",
            "said",
            "how often it was repeated within seconds",
        ),
    ),
)
_TRANSFERS = Table(
    "transfers",
    "a fence, mission or rally list on its way",
    (
        _LOG,
        *_texts("kind", "which list", "way", "upload, read-back, clear or partial write"),
        *_numbers("INTEGER", "station_system", "who wrote or read", "station_component", "who wrote or read"),
        *_numbers(
            "DOUBLE", "begun_s", "since the log's first record", "ended_s", "since the log's first record"
        ),
        *_numbers("INTEGER", "announced", "items as announced", "seen", "different items seen"),
        *_texts(
            "ending",
            "complete, partial, unanswered or refused",
            "result",
            "MAV_MISSION_RESULT of the MISSION_ACK",
        ),
        Column("repeats", "INTEGER", "how often an item or the announcement came again"),
    ),
)
_MODES = Table(
    "modes",
    "a stretch in one mode, armed or not",
    (
        _LOG,
        Column("mode", "BIGINT", "custom_mode of the heartbeat"),
        *_texts("name", "the mode's name"),
        Column("armed", "BOOLEAN", "by the heartbeat"),
        *_numbers(
            "DOUBLE", "begun_s", "since the log's first record", "ended_s", "since the log's first record"
        ),
        Column("driven_m", "DOUBLE", "driven in it"),
    ),
)
_PARAMETERS = Table(
    "parameters",
    "a parameter that affects the drive, at the log's end",
    (_LOG, *_texts("name", "the parameter"), Column("value", "DOUBLE", "its value")),
)
_EVENTS = Table(
    "events",
    "what happened besides: a parameter changed, a fence took hold; or what could not be reported",
    (
        _LOG,
        Column("time_s", "DOUBLE", "since the log's first record; NULL for what concerns the whole log"),
        *_texts(
            "event",
            "`parameter`, `fence` or `note`",
            "name",
            "the parameter, or the fence's zones",
            "text",
            "in words",
        ),
        *_numbers("DOUBLE", "before", "a parameter's value before", "after", "a parameter's value after"),
    ),
)

TABLES: Final = {
    table.name: table
    for table in (
        *(_FILES, _LOGS, _VEHICLES, _MESSAGES, _POSITIONS, _DRIVES, _GRADES, _LEGS, _BREACHES),
        *(_TARGETS, _TRANSFERS, _MODES, _PARAMETERS, _EVENTS),
    )
}
"""Every table by its name."""


@dataclass(frozen=True, slots=True)
class View:
    """What the tables are joined to, for questions: its name, what a row is, how it is made."""

    name: str
    about: str
    sql: str


VIEWS: Final = (
    View(
        "drive_grades",
        "a drive with its grade, and when it began (`begun_utc`)",
        """SELECT d.*, v.begins_utc + to_microseconds(CAST(d.begun_s * 1e6 AS BIGINT)) AS begun_utc,
    g.* EXCLUDE (log, drive, month, vehicle)
FROM drives d JOIN grades g USING (log, drive, month, vehicle) LEFT JOIN vehicles v USING (log, month, vehicle)""",
    ),
    View(
        "corners",
        "a corner that was driven as a whole: a row of `legs` that has one, with how far it was beyond its bound (negative: within it)",
        """SELECT *, abs(turn_deg) AS angle_deg, inside_cut_m - predicted_inside_cut_m AS inside_excess_m,
    outside_overshoot_m - predicted_outside_overshoot_m AS outside_excess_m
FROM legs WHERE turn_deg IS NOT NULL AND is_whole AND predicted_inside_cut_m IS NOT NULL""",
    ),
    View(
        "track",
        "a position with a fix, with its time (`time_utc`)",
        """SELECT p.*, v.begins_utc + to_microseconds(CAST(p.time_s * 1e6 AS BIGINT)) AS time_utc
FROM positions p LEFT JOIN vehicles v USING (log, month, vehicle) WHERE p.lat_deg IS NOT NULL""",
    ),
)
"""Views beside the tables."""


def literal(path: object) -> str:
    """Return a path as DuckDB reads just that file, and not those that it describes: brackets, stars and question marks are a pattern there."""
    return _PATTERN.sub(r"[\g<0>]", str(path))
