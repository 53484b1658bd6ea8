"""What is asked of a plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from missions.geo import LatLon


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
        Take the widest route there is; `clearance_m` then says nothing.
    corner_allowance_m : float, optional
        Room for cut corners and tracking error on top of the clearance. Default: from the vehicle; 0 plans the drawn lines only.
    snap_m : float
        A blocked target is moved to free ground within this distance.
    method : str
        ``optimal``, ``pbpp-taut`` or ``pbpp``.
    """

    start: LatLon | None = None
    targets: tuple[LatLon, ...] = ()
    clearance_m: float | None = None
    widest: bool = False
    corner_allowance_m: float | None = None
    snap_m: float = 0.0
    method: str = "optimal"
