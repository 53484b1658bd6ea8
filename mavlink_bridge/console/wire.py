"""What goes over the network between page and server: bodies of requests, their answers, and the messages of the WebSocket.

`schema` makes the JSON schema of all of it; docs/console-api.md says what each route does.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import msgspec

from mavlink_bridge.console.view.sections import (
    AfterView,
    EventView,
    FenceView,
    Place,
    PlanView,
    Polygon,
    Sections,
    TrackRow,
    Zones,
)

MOST_BYTES = 4 * 1024 * 1024
"""Of a request's body: a fence of 100,000 vertices is smaller. Chosen, not measured."""

MOST_MESSAGE_BYTES = 4096
"""Of a page's message on the WebSocket."""

_MOST_PLACES = (
    500  # targets or waypoints of one request; chosen: more than any vehicle's mission that a person draws
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnFacts:
    """What a drawn zone is; a circle needs its centre and radius."""

    kind: Literal["inclusion", "exclusion"]
    shape: Literal["polygon", "circle"] = "polygon"
    radius_m: float | None = None
    centre: Place | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnZone:
    """GeoJSON: a zone drawn on the page; of a polygon the outer ring counts, of a circle the properties."""

    properties: DrawnFacts
    geometry: Polygon | None = None
    type: Literal["Feature"] = "Feature"


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnFence:
    """GeoJSON: a whole fence, as section `fence.held` has it."""

    features: tuple[DrawnZone, ...]
    return_point: Place | None = None
    type: Literal["FeatureCollection"] = "FeatureCollection"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """What is asked of a plan.

    Parameters
    ----------
    targets : tuple of Place
        In their order, or in the best with ``order`` ``best``.
    clearance_m : float, optional
        Default: from FENCE_MARGIN, as on the command line.
    widest : bool
        The widest route there is, in place of a clearance.
    start : Place, optional
        Default: where the vehicle is, else home.
    fence : DrawnFence, optional
        One that is drawn on the page, in place of the vehicle's. A plan around it cannot be uploaded before the fence is.
    """

    targets: tuple[Place, ...]
    clearance_m: float | None = None
    widest: bool = False
    order: Literal["given", "best"] = "given"
    end: Literal["hold", "loiter", "rtl"] = "hold"
    comes_back: bool = False
    start: Place | None = None
    speed_mps: float | None = None
    reserve_m: float | None = None
    snap_m: float = 0.0
    fence: DrawnFence | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Item:
    """A mission item as MISSION_ITEM_INT carries it, without the home item; NaN params are null."""

    command: int
    frame: int = 6
    params: tuple[float | None, float | None, float | None, float | None] = (0.0, 0.0, 0.0, 0.0)
    lat_e7: int = 0
    lon_e7: int = 0
    alt_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckRequest:
    """A mission to check or to repair: its items, or the places of its waypoints; neither means the one that the vehicle holds."""

    items: tuple[Item, ...] = ()
    points: tuple[Place, ...] = ()
    clearance_m: float | None = None
    start: Place | None = None
    home: Place | None = None
    speed_mps: float | None = None
    reserve_m: float | None = None
    fence: DrawnFence | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceRequest:
    """A drawn fence to look at."""

    fence: DrawnFence
    clearance_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class UploadRequest:
    """What to write to the vehicle: a plan by its id, or a fence; verified, the old list kept in a backup first.

    A plan of the page is made again by the bridge, from where the vehicle is. It is written where it is the same route; else it stands as the
    section ``plan`` and is written only when it is asked for by its own id.
    """

    plan_id: str = ""
    fence: DrawnFence | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StartRequest:
    """Start the drive on the plan with this id, which is verified on the vehicle."""

    plan_id: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockedRequest:
    """An obstacle: where, or right before the vehicle without a place."""

    position: Place | None = None
    radius_m: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RestoreRequest:
    """A backup to put back, by its name in the list."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportRequest:
    """What to write into a file of a format: the fence (the drawn one if given), a plan by its id, items, or all that is known."""

    format: str
    what: Literal["plan", "mission", "fence", "rally", "parameters", "all"] = "all"
    plan_id: str = ""
    items: tuple[Item, ...] = ()
    fence: DrawnFence | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionRequest:
    """The token of the printed link; the answer sets the cookie."""

    token: str


# Answers


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Why a request was not done.

    Parameters
    ----------
    kind : str
        ``forbidden``, ``not_permitted``, ``no_control``, ``superseded``, ``not_now``, ``invalid``, ``too_large``, ``not_here``, ``not_found``, ``internal``, or the name of an
        error of planning, files or the link.
    message, advice : str
        For people.
    """

    kind: str
    message: str
    advice: str = ""
    details: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Failure:
    """The body of every answer that is no 2xx."""

    error: Problem


@dataclass(frozen=True, slots=True, kw_only=True)
class TakenUp:
    """A request was accepted; the sections show what comes of it."""

    ok: Literal[True] = True
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Widest:
    """The widest route over the targets: the slider's maximum. None without a fence near, or where it is not known: ``trouble`` says why; 0 where there is no route at all."""

    clearance_m: float | None
    at: Place | None = None
    between: tuple[str, ...] = ()
    trouble: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """What a file holds.

    Parameters
    ----------
    parts : tuple of str
        ``mission``, ``fence``, ``rally``, ``parameters``.
    fence : Fence or None
        As held and as meant.
    items, points : tuple
        The mission, and the places of it.
    remarks : tuple of str
        What was skipped or assumed.
    """

    name: str
    parts: tuple[str, ...]
    fence: FenceView | None = None
    items: tuple[Item, ...] = ()
    points: tuple[Place, ...] = ()
    rally: tuple[Place, ...] = ()
    home: Place | None = None
    parameters: int = 0
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class BackupView:
    """A backup that can be put back."""

    name: str
    what: str
    items: int
    time_s: float
    vehicle: str
    is_this_vehicle: bool


# The WebSocket


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """The first message: everything.

    Parameters
    ----------
    seq : int
        Counts this connection's messages, from 0: a gap means that the page should connect again.
    you : str
        This page's public name.
    time_s : float
        The server's clock.
    """

    seq: int
    you: str
    time_s: float
    state: Sections
    events: tuple[EventView, ...] = ()
    track: tuple[TrackRow, ...] = ()
    type: Literal["snapshot"] = "snapshot"


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeMessage:
    """What has changed since: sections whole, and what events and track have grown by.

    Parameters
    ----------
    state : mapping
        Section names to whole sections (null for one that is gone).
    track_anew : bool
        Whether ``track`` is the whole track anew in place of what came before (thinned, or another log's).
    """

    seq: int
    time_s: float
    state: dict[str, Any] = field(default_factory=dict)
    events: tuple[EventView, ...] = ()
    track: tuple[TrackRow, ...] = ()
    track_anew: bool = False
    events_anew: bool = False
    type: Literal["change"] = "change"


@dataclass(frozen=True, slots=True, kw_only=True)
class Alive:
    """Nothing has changed: sent so that something comes every second."""

    seq: int
    time_s: float
    type: Literal["alive"] = "alive"


@dataclass(frozen=True, slots=True, kw_only=True)
class Seek:
    """From the page, in a replay: show that moment."""

    time_s: float
    type: Literal["seek"] = "seek"


BODIES: dict[str, Any] = {
    one.__name__: one
    for one in (
        PlanRequest, CheckRequest, FenceRequest, UploadRequest, StartRequest, BlockedRequest, RestoreRequest,
        ExportRequest, SessionRequest, PlanView, FenceView, Zones, Widest, Imported, BackupView, AfterView, TakenUp, Failure,
        Snapshot, ChangeMessage, Alive, Seek,
    )
}  # fmt: skip
"""Everything that goes over the network, by name."""


def schema() -> dict[str, Any]:
    """Return the JSON schema of everything that goes over the network."""
    refs, components = msgspec.json.schema_components(BODIES.values(), ref_template="#/$defs/{name}")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "PBPP Rover console",
        "oneOf": list(refs),
        "$defs": dict(sorted(components.items())),
    }


def encode(value: object) -> bytes:
    """Return a body as JSON; numbers that are not finite become null."""
    return _ENCODER.encode(value)


_ENCODER = msgspec.json.Encoder()
