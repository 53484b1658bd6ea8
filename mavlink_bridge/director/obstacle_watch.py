"""The part of the director that knows which obstacles were reported: temporary exclusions, which are planned round and forgotten. It protects no person.

    OBSTACLE_DISTANCE + pose + ATTITUDE ──discs_seen──► discs ──track──► obstacles ─┐
    "blocked", "clear" from the keyboard ───────────────────────────────────────────┴► Situation.obstacles ─► RouteDesk

- A scan counts where MAVLink and ArduPilot read it alike: in MAV_FRAME_BODY_FRD, element 0 at ``angle_offset`` from the front; 0, 65535 and what lies outside ``min_distance``
  to ``max_distance`` is nothing seen. ArduPilot takes any frame for that one, MAVLink counts 0 from north: other frames are refused, and it is said once.
- A disc belongs to the obstacle that is near enough; so a thing that is seen ten times a second is one obstacle. Its size is a small one of those of the last seconds (a sector that is grazed
  makes it wider), its growth as fast as it was seen to move; until it was watched for so long, as fast as the orders say.
- Obstacles stand in the situation as they may be when a vehicle that is told to stop now stands. Whether one comes across the route is `obstacle_across`'s
  to say, what follows the desk's. What is not seen any more grows, and is forgotten when its time is over.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mavlink_bridge.director import clash
from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.grounds import Grounds
from mavlink_bridge.director.orders import ObstacleSource
from mavlink_bridge.director.states import Notice, Signal, State
from mavlink_bridge.mavlink import messages as m
from missions.checking.obstacle_ahead import stands_after_s
from missions.errors import MissionError
from missions.fence import Obstacle, Obstacles
from missions.geo import LatLon, LocalPoint, destination
from missions.ground.from_situation import ground_for
from missions.ground.scan import Disc, RangeScan, discs_seen
from missions.promise import known_vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.mavlink.messages import Frame
    from missions.ground.ground import Ground

FRONT_M = 2.0
"""So far before the vehicle's position the edge of what is typed as "blocked" lies: beyond its own front; chosen."""

TYPED_RADIUS_M = 1.0
"""Of what is typed without one; chosen."""

TYPED_S = 600.0
"""So long what was typed is kept, unless it is cleared; chosen."""

_BODY_FRD = 12  # MAV_FRAME_BODY_FRD
_UNKNOWN = 65535  # UINT16_MAX
_EVERY_S = 0.09  # scans that come quicker than ten a second are left out; chosen
_POSE_S = 1.0  # how old a position may be for a scan: it comes four times a second; chosen
_YAW_S = 0.5  # how old an ATTITUDE may be; without one the position's heading stands in for it; chosen
_EXTRA1, _ATTITUDE_HZ = 10, 10  # MAV_DATA_STREAM_EXTRA1, which holds ATTITUDE; as often as scans
_ASK_EVERY_S = 5.0  # a request may be lost; chosen
_MOST = 64  # obstacles that are kept; chosen, bounds memory and planning
_GATE_M = 1.0  # between the edges of a disc and of the obstacle that it belongs to, beside how far that may have moved; chosen
_WATCHED_S = 1.5  # so long a movement is measured over; chosen: a sector of 5° is 1.3 m wide at 15 m
_MEANT_S = 0.5  # positions at both ends of that are meant over so long
_KEPT_S = 3.0  # so long sizes are compared
_SMALL = 0.25  # so large a share of the sizes is no larger; chosen
_LEAST_GROWTH_MPS = 0.2  # of what was seen to stand: it may begin to move; chosen


class _Sighting(NamedTuple):
    time_s: float
    disc: Disc

    def centre(self, radius_m: float) -> tuple[float, float]:
        """Return the middle of a disc of a radius whose near side was seen."""
        near, way = self.disc.near, self.disc.way
        return near.east_m + way[0] * radius_m, near.north_m + way[1] * radius_m


@dataclass(eq=False)
class _Track:
    """An obstacle as it was seen over the last seconds."""

    reported_s: float
    sightings: deque[_Sighting] = field(default_factory=deque)

    def see(self, time_s: float, disc: Disc) -> None:
        """Take what was seen."""
        self.sightings.append(_Sighting(time_s, disc))
        while self.sightings[0].time_s < time_s - _KEPT_S:
            self.sightings.popleft()

    @property
    def seen_s(self) -> float:
        """When it was seen last."""
        return self.sightings[-1].time_s

    @property
    def radius_m(self) -> float:
        """Its size: of those that were seen a small one, for a sector that is only grazed makes it wider; not the least, which is what comes into view first."""
        sizes_m = sorted(one.disc.radius_m for one in self.sightings)
        return sizes_m[int(_SMALL * (len(sizes_m) - 1))]

    @property
    def centre(self) -> tuple[float, float]:
        """Its middle, as seen last."""
        return self.sightings[-1].centre(self.radius_m)

    def growth_mps(self, unknown_mps: float) -> float:
        """Return how fast it may move: as it was seen to, or as is given while it was not watched for long enough."""
        until_s = self.seen_s
        before = [one for one in self.sightings if one.time_s <= until_s - _WATCHED_S + _MEANT_S]
        if not before or self.sightings[0].time_s > until_s - _WATCHED_S:
            return unknown_mps
        last = [one for one in self.sightings if one.time_s > until_s - _MEANT_S]
        before = [one for one in before if one.time_s > until_s - _WATCHED_S - _MEANT_S]
        if not before:
            return unknown_mps
        radius_m = self.radius_m
        ends = [np.mean([one.centre(radius_m) for one in part], axis=0) for part in (before, last)]
        took_s = float(np.mean([one.time_s for one in last]) - np.mean([one.time_s for one in before]))
        return max(_LEAST_GROWTH_MPS, math.dist(*ends) / took_s)


class ObstacleWatch(Part):
    """Knows which obstacles were reported, and keeps them in the situation."""

    def __init__(self, core: Core) -> None:
        super().__init__(core)
        self._tracks: list[_Track] = []
        self._typed: list[Obstacle] = []
        self._attitude: tuple[float, m.Attitude] | None = None
        self._scanned_s = -math.inf
        self._laid_out: tuple[Grounds, Ground | None] | None = None
        self._has_refused = False
        self._asked_s = -math.inf

    @property
    def deadline_s(self) -> float | None:
        """When the next one is forgotten."""
        return min((one.ends_s for one in self.core.situation.obstacles.known), default=None)

    def receive(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Take a scan of a sensor on the vehicle."""
        core, message = self.core, frame.message
        if ObstacleSource.OBSTACLE_DISTANCE not in core.orders.obstacle_sources:
            return []
        if isinstance(message, m.Attitude) and core.is_from_vehicle(frame):
            self._attitude = now_s, message
        if not isinstance(message, m.ObstacleDistance) or frame.system != core.situation.system:
            return []
        if core.state in (State.LISTENING, State.LEARNING) or now_s < self._scanned_s + _EVERY_S:
            return []
        self._scanned_s = now_s
        scan, ground = self._scan_of(message, now_s), self._ground()
        if scan is None or ground is None or (pose := self._pose(now_s, ground)) is None:
            return []
        self._track(discs_seen(scan, *pose, ground), now_s)
        return self._publish(now_s)

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Forget what is over."""
        ends_s = self.deadline_s
        return self._publish(now_s) if ends_s is not None and now_s >= ends_s else []

    # The keyboard

    def take_typed(self, position: LatLon | None, radius_m: float, now_s: float) -> Sequence[Signal]:
        """Take an obstacle that was typed; without a position it is right before the vehicle."""
        position = position or self._place_ahead(radius_m)
        if position is None or ObstacleSource.KEYBOARD not in self.core.orders.obstacle_sources:
            return []
        typed = Obstacle(position, radius_m, 0.0, now_s, TYPED_S, str(ObstacleSource.KEYBOARD), now_s)
        self._typed = [*self._typed, typed][-_MOST:]
        return self._publish(now_s)

    def clear(self, now_s: float) -> Sequence[Signal]:
        """Forget all of them; what a sensor still sees is reported anew."""
        self._typed.clear()
        self._tracks.clear()
        return self._publish(now_s)

    def _place_ahead(self, radius_m: float) -> LatLon | None:
        pose = self.core.situation.pose
        if pose is None or pose.value.heading_deg is None:
            return None
        return destination(pose.value.position, FRONT_M + radius_m, pose.value.heading_deg)

    # Scans

    def _scan_of(self, message: m.ObstacleDistance, now_s: float) -> RangeScan | None:
        """Return a scan as ArduPilot reads it; None where it cannot be used."""
        if message.frame != _BODY_FRD:
            self._refuse(
                f"OBSTACLE_DISTANCE in frame {message.frame} is not used: MAVLink and ArduPilot read it differently; send MAV_FRAME_BODY_FRD (12)",
                now_s,
            )
            return None
        step_deg = message.increment_f or float(message.increment)
        if not (0 < abs(step_deg) <= 360 and abs(message.angle_offset) <= 360):  # nor where one is NaN
            text = f"OBSTACLE_DISTANCE with an increment of {step_deg:g}° and an angle_offset of {message.angle_offset:g}° is not used"
            self._refuse(text, now_s)
            return None
        count = min(int(360.0 / abs(step_deg) + 0.5), len(message.distances))
        cm = np.array(message.distances[:count], dtype=float)
        is_seen = (cm > 0) & (cm < _UNKNOWN) & (cm >= message.min_distance) & (cm <= message.max_distance)
        return RangeScan(np.where(is_seen, cm / 100, np.nan), message.angle_offset, step_deg)

    def _refuse(self, text: str, now_s: float) -> None:
        if not self._has_refused:
            self._has_refused = True
            self.core.voice.tell(now_s, EventName.TROUBLE, text, "LinkError", {})

    def _ground(self) -> Ground | None:
        """Return the fence laid out; None where it cannot be, and so nothing can be planned."""
        core, grounds = self.core, Grounds.of(self.core.situation)
        if self._laid_out is None or self._laid_out[0] != grounds:
            fence = replace(core.situation, obstacles=Obstacles())
            try:
                ground = ground_for(fence, known_vehicle(fence, core.orders.request), ())
            except MissionError:
                ground = None
            self._laid_out = grounds, ground
        return self._laid_out[1]

    def _pose(self, now_s: float, ground: Ground) -> tuple[LocalPoint, float] | None:
        """Return where the vehicle is now, and where its front points; None where that is not known well enough."""
        known = self.core.situation.pose
        if known is None or known.time_s is None or now_s > known.time_s + _POSE_S:
            return None
        east, north = ground.frame.to_local(known.value.position)
        east_mps, north_mps = known.value.velocity_mps or (0.0, 0.0)
        age_s = now_s - known.time_s
        here = LocalPoint(east + east_mps * age_s, north + north_mps * age_s)
        if self._attitude is not None and now_s <= self._attitude[0] + _YAW_S:
            heard_s, attitude = self._attitude
            yaw = attitude.yaw + attitude.yawspeed * (now_s - heard_s)
            return (here, math.degrees(yaw)) if math.isfinite(yaw) else None
        self._ask_for_attitude(now_s)
        heading_deg = known.value.heading_deg
        return (here, heading_deg) if heading_deg is not None else None

    def _ask_for_attitude(self, now_s: float) -> None:
        """Ask for ATTITUDE, which not every link gets unasked."""
        core = self.core
        is_silent = core.peer is None or core.orders.passive or core.state in clash.CLASHES
        if is_silent or now_s < self._asked_s + _ASK_EVERY_S:
            return
        self._asked_s = now_s
        assert core.peer is not None
        core.send(m.RequestDataStream(core.peer.system, core.peer.component, _EXTRA1, _ATTITUDE_HZ, 1))

    # Obstacles

    def _track(self, discs: Sequence[Disc], now_s: float) -> None:
        """Give each disc to the nearest obstacle that it may be, or make it a new one."""
        growth_mps = self.core.orders.obstacle_growth_mps
        free = list(self._tracks)
        for disc in discs:
            sighting = _Sighting(now_s, disc)

            def gap_m(track: _Track, sighting: _Sighting = sighting) -> float:
                radius_m = sighting.disc.radius_m
                apart_m = math.dist(track.centre, sighting.centre(radius_m)) - track.radius_m - radius_m
                return apart_m - growth_mps * (now_s - track.seen_s)

            nearest = min(free, key=gap_m, default=None)
            if nearest is not None and gap_m(nearest) <= _GATE_M:
                free.remove(nearest)
                nearest.see(now_s, disc)
            else:
                self._tracks.append(_Track(now_s, deque([sighting])))

    def _publish(self, now_s: float) -> Sequence[Signal]:
        """Put what is known into the situation."""
        core = self.core
        keep_s = core.orders.obstacle_keep_s
        self._tracks = [one for one in self._tracks if now_s < one.seen_s + keep_s][-_MOST:]
        self._typed = [one for one in self._typed if now_s < one.ends_s]
        known = (*self._typed, *self._seen())
        if not known and not core.situation.obstacles.known:
            return []
        at_s = now_s + stands_after_s(core.situation, core.orders.request)
        core.situation = replace(core.situation, obstacles=Obstacles(known, at_s))
        return [Notice.OBSTACLES_CHANGED]

    def _seen(self) -> list[Obstacle]:
        """Return what sensors have seen, as obstacles."""
        orders, ground = self.core.orders, self._ground()
        if ground is None:
            return []
        return [
            Obstacle(
                ground.frame.to_lat_lon(LocalPoint(*map(float, track.centre))),
                track.radius_m,
                track.growth_mps(orders.obstacle_growth_mps),
                track.seen_s,
                orders.obstacle_keep_s,
                str(ObstacleSource.OBSTACLE_DISTANCE),
                track.reported_s,
            )
            for track in self._tracks
        ]
