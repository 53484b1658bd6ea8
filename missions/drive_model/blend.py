"""How the motions of two legs overlap at a corner."""

from __future__ import annotations

from typing import NamedTuple


class Blend(NamedTuple):
    """How the motions of two legs overlap at a corner; a tuple, as `Ramp` is.

    Parameters
    ----------
    duration_s : float
        How long both run at once; 0 where the rover stops at the waypoint.
    reach_m : float
        How far before (and after) the waypoint its middle lies along each leg.
    """

    duration_s: float
    reach_m: float
