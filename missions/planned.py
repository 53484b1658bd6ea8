"""The result of planning: a mission and what it promises."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from missions.formats import write_mission
from missions.formats.files import write_file
from missions.geo import bearing_deg, path_length_m
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from missions.drive_model import Envelope
    from missions.drive_model.stopping import HoldCheck
    from missions.fence import Fence
    from missions.formats.files import Writer
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.items import MissionItem
    from missions.vehicle import Vehicle

_TURN_DEG: Final = 1.0  # a smaller change of direction is a long line in pieces; chosen
_NOTHING_ELSE = Situation()


@dataclass(frozen=True, slots=True)
class Clearances:
    """What a plan keeps to the fence, metres.

    Parameters
    ----------
    promised_m : float or None
        For the rover as it drives, once it has left the start: what was asked for, or more. None where only drawn lines were asked
        for, and where the drive is extrapolated.
    asked_m : float
        What the drawn lines have to keep (less where the first ones lead away from a fence nearby); where the route is fitted to the
        drive model, the predicted corridor too: the promise, the position's error and the owner's reserve.
    drawn_m : float
        The least distance of the drawn lines, as rounded and as the autopilot draws them, to any fence (infinite without a fence near).
    driven_m : float
        The least distance of the predicted corridor to any fence.
    start_m : float or None
        Promised on the first legs, while it leaves the place where it stands, where that place leaves less; else None.
    """

    promised_m: float | None
    asked_m: float
    drawn_m: float
    driven_m: float
    start_m: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """A mission and what it promises.

    Parameters
    ----------
    items : tuple of MissionItem
        For the autopilot, without the home item and without the start: waypoints, and changes of speed between them.
    path : tuple of LatLon
        The drawn lines as rounded into the items, start first.
    seqs : tuple of int
        For each point of the path the seq of its waypoint in the mission (home is 0, and stands for the start).
    speeds : tuple of float or None
        The speed asked for on each leg of the path in m/s; None is the vehicle's own.
    keeps : Clearances
        What it keeps to the fence, promised, drawn and driven.
    blocks : int
        Blocks of the partition that was searched.
    fence, ground : Fence, Ground
        What was planned around.
    vehicle : Vehicle
        What was known of the vehicle.
    envelope : Envelope
        The predicted corridor, and its times.
    home : LatLon or None
        For the mission's home item.
    warnings : tuple of str
        What a person should know before it is driven.
    info : tuple of str
        What was done because it was asked for, or added to be safe.
    asked_targets : tuple of LatLon
        The targets as they were asked for, before blocked ones were moved; empty where nobody asked for targets.
    extrapolated : tuple of str
        Why the drive lies outside the measured range; empty where it does not.
    hold : HoldCheck or None
        What HOLD does on the route.
    """

    items: tuple[MissionItem, ...]
    path: tuple[LatLon, ...]
    seqs: tuple[int, ...]
    speeds: tuple[float | None, ...]
    start: LatLon
    targets: tuple[LatLon, ...]
    method: str
    straight_line_m: float
    keeps: Clearances
    blocks: int
    fence: Fence
    ground: Ground
    vehicle: Vehicle
    envelope: Envelope
    home: LatLon | None
    warnings: tuple[str, ...]
    info: tuple[str, ...] = ()
    asked_targets: tuple[LatLon, ...] = ()
    extrapolated: tuple[str, ...] = ()
    hold: HoldCheck | None = None

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """The path in the plane, east and north in metres."""
        return self.ground.frame.to_local_array(self.path)

    @property
    def length_m(self) -> float:
        """The drawn length."""
        return path_length_m(self.path)

    @property
    def duration_s(self) -> float:
        """The predicted time."""
        return self.envelope.duration_s

    @property
    def clearance_m(self) -> float | None:
        """`Clearances.promised_m`."""
        return self.keeps.promised_m

    @property
    def start_clearance_m(self) -> float | None:
        """`Clearances.start_m`."""
        return self.keeps.start_m

    @property
    def asked_m(self) -> float:
        """`Clearances.asked_m`."""
        return self.keeps.asked_m

    @property
    def drawn_clearance_m(self) -> float:
        """`Clearances.drawn_m`."""
        return self.keeps.drawn_m

    @property
    def driven_clearance_m(self) -> float:
        """`Clearances.driven_m`."""
        return self.keeps.driven_m

    @property
    def turn_count(self) -> int:
        """How often the drawn lines change their direction, at targets too."""
        places = [
            place for place, before in zip(self.path, (None, *self.path), strict=False) if place != before
        ]
        courses_deg = [bearing_deg(a, b) for a, b in pairwise(places)]
        return sum(abs((b - a + 180) % 360 - 180) > _TURN_DEG for a, b in pairwise(courses_deg))

    def __repr__(self) -> str:
        promised = "drawn lines only" if self.clearance_m is None else f"{self.clearance_m:g} m promised"
        return f"<Plan: {len(self.items)} items, {self.length_m:.1f} m, {self.duration_s:.0f} s, {promised}>"

    def write(
        self, path: Path | str, situation: Situation = _NOTHING_ELSE, *, write: Writer = write_file
    ) -> None:
        """Write the mission; in a format that holds them its fence and home too.

        Parameters
        ----------
        path : Path or str
            The suffix chooses the format.
        situation : Situation
            What else is known, such as rally points, for a format that holds it.
        write : callable
            What puts the bytes into the file.

        Raises
        ------
        MissionFormatError
            The suffix is unknown or its format holds no missions, or the file cannot be written.
        """
        mission = Mission(self.items, self.home or self.start)
        fence = Known(self.fence, None, "planned")
        to_write = replace(situation, mission=Known(mission, None, "planned"), fence=fence)
        write_mission(to_write, path, write=write)

    def plot(self, path: Path | str, *, title: str | None = None, blocks: bool = False) -> None:
        """Draw the plan to an image, as the suffix says; `missions.picture.draw_plan` can do more.

        Parameters
        ----------
        path : Path or str
            ``.png``, ``.svg`` or ``.pdf``. Pages are made by `mavlink_bridge.console.stills.plan_page`.
        title : str, optional
            Default: length, time and clearance.
        blocks : bool
            Whether to draw the blocks of the free space's partition too.

        Raises
        ------
        MissionFormatError
            The suffix is unknown, a library is not installed, or the file cannot be written.
        """
        # Asked for by name when it is called: pictures stand above plans, and no module may know what stands above it.
        import_module("missions.picture").draw_plan(self, path, title=title, blocks=blocks)

    def path_index(self, seq: int, after: int = 0) -> int:
        """Return which point of the path a mission item drives to; for a change of speed, the one that it is for.

        Of an item that is driven to several times the first time from point ``after`` on, else the first of all.
        """
        points = (*range(after, len(self.path)), *range(after))
        exact = (point for point in points if self.seqs[point] == seq)
        later = (point for point in points if self.seqs[point] > seq)
        return next(exact, next(later, len(self.path) - 1))
