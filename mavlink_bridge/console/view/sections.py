"""The sections of what is shown: their names and facts. Places are ``[longitude, latitude]`` in degrees, as GeoJSON has them; None is not known.

Times are seconds since 1970 by the server's clock. Every text may come from outside (a vehicle, a file): it is data and never markup.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

Place = tuple[float, float]
"""Longitude and latitude, degrees (WGS 84)."""

Ring = tuple[Place, ...]


@dataclass(frozen=True, slots=True)
class MultiPolygon:
    """GeoJSON: polygons, each an outer ring and its holes."""

    coordinates: tuple[tuple[Ring, ...], ...] = ()
    type: Literal["MultiPolygon"] = "MultiPolygon"


@dataclass(frozen=True, slots=True)
class Polygon:
    """GeoJSON: one polygon."""

    coordinates: tuple[Ring, ...] = ()
    type: Literal["Polygon"] = "Polygon"


@dataclass(frozen=True, slots=True)
class LineString:
    """GeoJSON: a line."""

    coordinates: tuple[Place, ...] = ()
    type: Literal["LineString"] = "LineString"


# What serves the page


@dataclass(frozen=True, slots=True)
class MapSource:
    """Raster tiles under everything: where they are, and whom to thank for them."""

    url: str
    kind: str = "pmtiles"
    attribution: str = ""


@dataclass(frozen=True, slots=True)
class Permissions:
    """What the page may do; the server refuses everything else."""

    upload: bool = False
    drive: bool = False
    arm: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerView:
    """Who serves, and what.

    Parameters
    ----------
    version : str
        Of this program.
    run_id : str
        Another one after each start of the server.
    source : str
        ``live``, ``demo``, ``log`` or ``files``.
    source_name : str
        The connection, or the file's name.
    can : Permissions
    map : MapSource or None
        None draws a metric grid.
    reads, writes : tuple of str
        Suffixes of files that can be imported and exported.
    """

    version: str
    run_id: str
    source: Literal["live", "demo", "log", "files"]
    source_name: str
    can: Permissions = field(default_factory=Permissions)
    map: MapSource | None = None
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlView:
    """Which page may change things; HOLD needs no control.

    Parameters
    ----------
    holder : str or None
        The public name of the page that holds control, such as ``page 2``. Each page learns its own name when it connects.
    since_s : float or None
        Since when.
    is_away : bool
        Whether the holder's page is not connected just now; control is free once it has been away for some seconds.
    pages : tuple of str
        The names of the connected pages.
    """

    holder: str | None = None
    since_s: float | None = None
    is_away: bool = False
    pages: tuple[str, ...] = ()


# The vehicle


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkView:
    """The link to the vehicle.

    Parameters
    ----------
    state : str
        ``none`` (no vehicle here: files), ``closed`` (being opened again), ``listening`` (no heartbeat yet), ``ok``, ``late`` (no heartbeat for 3 s) or ``lost``.
    heard_s : float or None
        When the newest heartbeat came: its age is the message's ``time_s`` less this, and grows while no message comes.
    heartbeats_missed_percent : float or None
        Of the last ten seconds, where one a second is expected.
    rate_hz : float or None
        Frames of the vehicle a second.
    trouble : str
        Why it is closed, or cannot be opened.
    """

    state: Literal["none", "closed", "listening", "ok", "late", "lost"] = "none"
    heard_s: float | None = None
    heartbeats_missed_percent: float | None = None
    rate_hz: float | None = None
    trouble: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class FootprintView:
    """The rectangle that the vehicle covers, and where its GPS antenna sits from the middle."""

    length_m: float
    width_m: float
    gps_forward_m: float = 0.0
    gps_right_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleView:
    """What the vehicle reports of itself.

    Parameters
    ----------
    autopilot, firmware : str
        Empty where not known.
    mode : int or None
        HEARTBEAT.custom_mode; ``mode_text`` is its name.
    position : Place or None
    position_s : float or None
        When it was told.
    fix_kind : int or None
        GPS_FIX_TYPE, ``fix_text`` in words; ``fix_error_m`` the receiver's own figure.
    most_items : int or None
        How many mission items it holds, home included.
    """

    # Many attributes: what one vehicle reports.
    system: int | None = None
    autopilot: str = ""
    firmware: str = ""
    mode: int | None = None
    mode_text: str = ""
    armed: bool | None = None
    position: Place | None = None
    position_s: float | None = None
    heading_deg: float | None = None
    speed_mps: float | None = None
    fix_kind: int | None = None
    fix_text: str = ""
    fix_error_m: float | None = None
    satellites: int | None = None
    battery_percent: int | None = None
    battery_v: float | None = None
    footprint: FootprintView | None = None
    most_items: int | None = None


# The field


@dataclass(frozen=True, slots=True, kw_only=True)
class ZoneFacts:
    """A fence zone as people count it; ``radius_m`` and ``centre`` are a circle's."""

    index: int
    name: str
    kind: Literal["inclusion", "exclusion"]
    shape: Literal["polygon", "circle"]
    radius_m: float | None = None
    centre: Place | None = None


@dataclass(frozen=True, slots=True)
class ZoneFeature:
    """GeoJSON: a zone as it is drawn; a circle as a polygon of many corners, with its centre and radius in the properties."""

    geometry: Polygon
    properties: ZoneFacts
    type: Literal["Feature"] = "Feature"


@dataclass(frozen=True, slots=True)
class Zones:
    """GeoJSON: all zones, in the order in which the autopilot holds them."""

    features: tuple[ZoneFeature, ...] = ()
    type: Literal["FeatureCollection"] = "FeatureCollection"


@dataclass(frozen=True, slots=True)
class HomeCircle:
    """The circle around home that the autopilot enforces besides."""

    centre: Place
    radius_m: float
    geometry: Polygon


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceMeant:
    """What the fence comes to for this vehicle.

    Parameters
    ----------
    free : MultiPolygon
        Where the autopilot lets the vehicle be.
    margin : MultiPolygon
        What of it keeps the asked clearance.
    margin_m : float
        That clearance.
    union : bool
        Whether one inclusion is enough; else all of them at once.
    home_circle : HomeCircle or None
    is_bounded : bool
        Whether an inclusion limits it; else ``free`` ends somewhere far out for drawing alone.
    """

    free: MultiPolygon
    margin: MultiPolygon
    margin_m: float
    union: bool
    home_circle: HomeCircle | None = None
    is_bounded: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleView:
    """A reported obstacle, of which the autopilot does not know; this protects no person."""

    name: str
    position: Place
    radius_m: float
    ends_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceView:
    """The fence as held and as meant.

    Parameters
    ----------
    id : str
        Another one whenever the zones or what they come to change.
    held : Zones
    return_point : Place or None
    meant : FenceMeant or None
        None where it cannot be used; ``trouble`` says why.
    where : str
        ``vehicle``, ``file``, ``log`` or ``drawn``; ``source`` in words.
    enabled : bool or None
        Whether the autopilot enforces the zones.
    time_s : float or None
        When it was learnt.
    trouble : str
        Why there is none, or why it cannot be used; empty where all is well.
    warnings : tuple of str
    """

    id: str = ""
    held: Zones = field(default_factory=Zones)
    return_point: Place | None = None
    meant: FenceMeant | None = None
    obstacles: tuple[ObstacleView, ...] = ()
    where: Literal["none", "vehicle", "file", "log", "drawn"] = "none"
    source: str = ""
    enabled: bool | None = None
    time_s: float | None = None
    trouble: str = ""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class AskedView:
    """What the shown plan was asked for: the request of it, or of the next one."""

    targets: tuple[Place, ...] = ()
    clearance_m: float | None = None
    widest: bool = False
    order: str = "given"
    end: str = "hold"
    comes_back: bool = False
    speed_mps: float | None = None
    reserve_m: float = 0.0


# The plan


@dataclass(frozen=True, slots=True, kw_only=True)
class RoutePoint:
    """A point of the route; ``seq`` is that of its mission item, 0 the start."""

    at: Place
    seq: int
    time_s: float
    text: str


Verdict = Literal["keeps", "near", "breaks", "extrapolated"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LegView:
    """One leg of the route, and what it keeps.

    Parameters
    ----------
    name : str
        By its items: ``2 → 3``.
    index : int
        From 0, along the route.
    start, end : Place
    length_m, time_s : float
    speed_mps : float or None
        What the mission asks for; None is the vehicle's own.
    drawn_m, driven_m : float or None
        The least distance to any fence of the straight line, and predicted for the driven track; None without a fence.
    asked_m : float or None
        What the driven track has to keep.
    verdict : str
        ``keeps``; ``near``: it keeps what a start so near to a fence leaves; ``breaks``; ``extrapolated``: predicted, not promised. Empty where nothing was promised.
    fence : str
        The nearest zone.
    at : Place or None
        Where it is nearest.
    crosses : tuple of str
        Zones that the straight line crosses.
    text : str
        The verdict in words.
    """

    name: str
    index: int
    start: Place
    end: Place
    length_m: float
    time_s: float
    speed_mps: float | None
    drawn_m: float | None
    driven_m: float | None
    asked_m: float | None
    verdict: Verdict
    fence: str = ""
    at: Place | None = None
    crosses: tuple[str, ...] = ()
    text: str = ""


@dataclass(frozen=True, slots=True)
class Narrowest:
    """Where the fences on both sides are nearest to each other: two places on them, how wide it is, and on which leg (from 0)."""

    ends: tuple[Place, Place]
    width_m: float
    leg: int


@dataclass(frozen=True, slots=True)
class ProfileSample:
    """A place along the route: how far, when, the distance to the fence of line and corridor, and the predicted speed."""

    s_m: float
    time_s: float
    drawn_m: float | None
    clearance_m: float | None
    speed_mps: float


@dataclass(frozen=True, slots=True)
class Blocker:
    """A fence that stands in the way, and the outline of it."""

    name: str
    geometry: MultiPolygon | None = None


@dataclass(frozen=True, slots=True)
class WidestRoute:
    """The widest route there is: what it keeps, where it is narrowest and between which fences; ``path`` are its straight legs.

    Parameters
    ----------
    is_driven : bool
        Whether it keeps ``clearance_m`` while driven; else along straight legs, and ``widest`` asks for the route that keeps most while driven.
    """

    clearance_m: float
    at: Place | None = None
    between: tuple[str, ...] = ()
    path: LineString | None = None
    is_driven: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class NoRouteView:
    """Why there is no plan.

    Parameters
    ----------
    kind : str
        The error's name, as in the exit codes: ``NoRouteError``, ``StartBlockedError``, …
    message, advice : str
        For people.
    details : mapping
        Its numbers, for scripts.
    widest : WidestRoute or None
        The widest route, where there is one at all.
    blockers : tuple of Blocker
    at : Place or None
        The place that is meant: the blocked start or target, or the narrowest place.
    """

    kind: str
    message: str
    advice: str = ""
    details: dict[str, Any] = field(default_factory=dict)
    widest: WidestRoute | None = None
    blockers: tuple[Blocker, ...] = ()
    at: Place | None = None


PlanState = Literal["planning", "planned", "no_route", "checked", "repaired"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanView:
    """A plan, a checked mission, or why there is none.

    Parameters
    ----------
    id : str
        Names this plan in requests to upload and start it.
    state : str
        ``planning`` (being made), ``planned``, ``checked``, ``repaired`` or ``no_route``.
    by : str
        ``page`` for a look at what would be, ``director`` for the plan that stands on the bridge and may be uploaded.
    took_s : float or None
        How long it took.
    promised_m : float or None
        What is promised while driving; None where nothing is.
    asked_m : float or None
        What the predicted track has to keep.
    drawn_m, driven_m, start_m : float or None
        The least distance of drawn lines and predicted corridor to a fence; what is promised while leaving a start near to a fence.
    extrapolated : tuple of str
        Why the drive lies outside what was measured; then nothing is promised.
    info, warnings, dangers : tuple of str
        Notes of three levels.
    profile : tuple of ProfileSample
        Along the route, at most 400.
    items : int
        How many mission items, home included.
    is_promised : bool
        Whether every leg keeps its clearance, and that was measured.
    changed : tuple of str
        What a repair has changed.
    """

    # Many attributes: the facts of one route, that the page shows at once.
    id: str
    state: PlanState
    by: Literal["page", "director"] = "page"
    took_s: float | None = None
    request: AskedView = field(default_factory=AskedView)
    start: Place | None = None
    targets: tuple[Place, ...] = ()
    asked_targets: tuple[Place, ...] = ()
    length_m: float | None = None
    straight_line_m: float | None = None
    duration_s: float | None = None
    promised_m: float | None = None
    asked_m: float | None = None
    drawn_m: float | None = None
    driven_m: float | None = None
    start_m: float | None = None
    is_promised: bool = False
    extrapolated: tuple[str, ...] = ()
    info: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    dangers: tuple[str, ...] = ()
    points: tuple[RoutePoint, ...] = ()
    legs: tuple[LegView, ...] = ()
    corridor: MultiPolygon | None = None
    narrowest: Narrowest | None = None
    profile: tuple[ProfileSample, ...] = ()
    items: int = 0
    changed: tuple[str, ...] = ()
    no_route: NoRouteView | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionView:
    """What mission the vehicle holds: its places, and whether it is the plan that stands."""

    id: str = ""
    items: int = 0
    points: tuple[Place, ...] = ()
    matches_plan: bool = False
    time_s: float | None = None
    current_seq: int | None = None


# The drive


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveView:
    """Where the director is, and how the drive goes.

    Parameters
    ----------
    state : str
        The director's state; ``state_text`` in words, ``since_s`` since when.
    awaits_upload, awaits_start : bool
        Whether the plan that stands waits to be uploaded (`/api/upload`), or is verified and waits to be driven (`/api/start`); ``plan_id`` names it.
    can_resume : bool
        Whether the last target can be gone to again (``/api/resume``).
    is_left_armed : bool
        Whether the vehicle stands armed in HOLD because pbpp has armed it, for a drive that has not begun.
    trouble : str
        Why the newest action failed.
    is_driving : bool
        Whether the fields below are of a drive under way; after it they stay as they were at its end.
    progress_m, length_m, left_m, eta_s : float or None
        Along the route; ``eta_s`` is what the drive model expects for the rest.
    deviation_m : float or None
        From the drawn line; ``corridor_ok`` is whether it is inside the predicted corridor.
    least_clearance_m : float or None
        The least so far; ``least_at`` where.
    """

    # Many attributes: the facts of one drive, that the page shows at once.
    state: str = "listening"
    state_text: str = ""
    since_s: float | None = None
    awaits_upload: bool = False
    awaits_start: bool = False
    plan_id: str = ""
    can_resume: bool = False
    is_left_armed: bool = False
    trouble: str = ""
    way_home: str = ""
    is_driving: bool = False
    begun_s: float | None = None
    next_seq: int | None = None
    progress_m: float | None = None
    length_m: float | None = None
    left_m: float | None = None
    eta_s: float | None = None
    driven_m: float | None = None
    deviation_m: float | None = None
    corridor_ok: bool = True
    least_clearance_m: float | None = None
    least_at: Place | None = None
    asked_m: float | None = None
    breaches: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class AfterSample:
    """A place along the driven way."""

    s_m: float
    clearance_m: float | None
    deviation_m: float
    speed_mps: float
    time_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AfterFigures:
    """What a drive, or a piece of it, came to, against what was promised."""

    plan_id: str
    promised_m: float | None
    is_kept: bool
    has_arrived: bool
    least_m: float | None
    least_at: Place | None
    predicted_s: float | None
    took_s: float
    driven_m: float
    length_m: float
    deviation_max_m: float
    outside_max_m: float
    breaches: int


@dataclass(frozen=True, slots=True, kw_only=True)
class AfterPiece(AfterFigures):
    """What was driven of one plan, against what it promised.

    Parameters
    ----------
    is_kept : bool
        Whether no breach was counted and no position was nearer to the fence than was promised.
    has_arrived : bool
        Whether it went to its end; else it was stopped.
    predicted_s, length_m : float or None
        Of the whole plan, also where it was stopped.
    """

    profile: tuple[AfterSample, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class AfterView(AfterFigures):
    """What was driven against what was promised, of the newest drive: from its first start to its end, or so far.

    Parameters
    ----------
    plan_id : str
        The plan that was driven last.
    promised_m : float or None
        The least that its plans promised; None where one of them promised nothing.
    is_kept, has_arrived : bool
        Whether each piece kept what its own plan promised; whether the last one went to its end.
    predicted_s, length_m : float or None
        Of the first plan; ``took_s`` counts from its start, and with it what the vehicle stood in between.
    pieces : tuple of AfterPiece
        One for each plan that was driven: after each HOLD with "Go on" there is one more.
    """

    pieces: tuple[AfterPiece, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class HoldView:
    """The newest HOLD that a page asked for, and what the vehicle did; its acknowledgement alone is no answer.

    Parameters
    ----------
    state : str
        ``none``, ``sent``, ``answered`` (a heartbeat shows HOLD since), ``stopped`` (and it stands), or ``no_answer``.
    text : str
        In words.
    by : str
        The page.
    """

    state: Literal["none", "sent", "answered", "stopped", "no_answer"] = "none"
    text: str = ""
    by: str = ""
    asked_s: float | None = None
    answered_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TransferView:
    """The newest transfer to the vehicle."""

    what: str
    state: Literal["running", "verified", "failed"]
    done: int = 0
    count: int = 0
    text: str = ""
    advice: str = ""
    backup: str = ""
    time_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class EventView:
    """What was decided or happened: a decision of the director, the vehicle's own text (name ``statustext``), or a page's deed (``console``)."""

    id: int
    time_s: float
    name: str
    severity: str
    text: str
    position: Place | None = None
    data: dict[str, Any] = field(default_factory=dict)


TrackRow = tuple[float, float, float, float, int | None]
"""``[time_s, longitude, latitude, speed_mps, mode]``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayView:
    """A log: its begin and end, and the moment that is shown; decisions are the events."""

    begin_s: float
    end_s: float
    now_s: float
    is_read: bool = True
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sections:
    """All sections: what is sent whole once; after that each again whenever it changes."""

    server: ServerView
    control: ControlView = field(default_factory=ControlView)
    link: LinkView = field(default_factory=LinkView)
    vehicle: VehicleView = field(default_factory=VehicleView)
    fence: FenceView = field(default_factory=FenceView)
    rally: tuple[Place, ...] = ()
    home: Place | None = None
    request: AskedView = field(default_factory=AskedView)
    plan: PlanView | None = None
    mission: MissionView | None = None
    drive: DriveView = field(default_factory=DriveView)
    hold: HoldView = field(default_factory=HoldView)
    upload: TransferView | None = None
    replay: ReplayView | None = None
