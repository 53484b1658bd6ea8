"""What is asked of a plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from missions.vehicle import Footprint

if TYPE_CHECKING:
    from missions.geo import LatLon
    from missions.situation import Mission


POINT = Footprint()
"""A vehicle of no size: its clearance counts from where its position is known."""


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked of a plan; None leaves it to the situation and the vehicle.

    Parameters
    ----------
    start : LatLon, optional
        Default: the vehicle's position, else home.
    targets : tuple of LatLon
        Visited in this order. Default: the newest target, else the last navigation item of the mission.
    clearance_m : float, optional
        Promised for the rover as it drives. Default: from FENCE_MARGIN.
    widest : bool
        Take the widest route there is; `clearance_m` is then not used.
    corner_allowance_m : float, optional
        Room for cut corners and tracking error everywhere on top of the clearance; 0 plans the drawn lines only. Default: the route is
        fitted to the drive model, with no more room than each corner needs.
    snap_m : float
        A blocked target is moved to free ground within this distance.
    method : str
        ``optimal``, ``pbpp-taut`` or ``pbpp``.
    position_error_m : float, optional
        How far the vehicle may be from where it believes to be. Default: from the kind of its fix.
    reserve_m : float
        The owner's own, for wind and slip.
    speed_mps : float, optional
        Driven with this speed (DO_CHANGE_SPEED). Default: the vehicle's own.
    footprint : Footprint
        The rectangle the vehicle covers.
    escape : bool
        Whether a vehicle on forbidden ground may drive out.
    order : str
        ``given``: the targets in their order; ``best``: in the shortest one (`missions.tour.tour`).
    comes_back : bool
        Whether the route leads home after the last target (`missions.tour.tour`).
    end : str
        At the end ``hold``, ``loiter`` or ``rtl`` (`missions.tour.tour`).
    via : Mission, optional
        A mission to repair, in the place of targets (`missions.editing.repair`).
    via_own : bool
        Repair the mission that the situation holds.
    """

    start: LatLon | None = None
    targets: tuple[LatLon, ...] = ()
    clearance_m: float | None = None
    widest: bool = False
    corner_allowance_m: float | None = None
    snap_m: float = 0.0
    method: str = "optimal"
    position_error_m: float | None = None
    reserve_m: float = 0.0
    speed_mps: float | None = None
    footprint: Footprint = POINT
    escape: bool = False
    order: str = "given"
    comes_back: bool = False
    end: str = "hold"
    via: Mission | None = None
    via_own: bool = False

    @property
    def repairs(self) -> bool:
        """Whether a mission is to be repaired."""
        return self.via is not None or self.via_own
