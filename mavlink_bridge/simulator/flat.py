"""The flat frame in which ArduPilot drives: points of it are complex numbers, north + east·j, in metres.

Multiplying by a unit number turns clockwise seen from above, which is how headings are counted: the direction of heading ψ is
``cmath.rect(1, ψ)``, and ``z * direction.conjugate()`` is forward + right·j for a vehicle that looks there.
"""

from __future__ import annotations

import math

from missions.geo import LatLon, wrap_lon_deg

METRES_PER_DEGREE = 1.113195e5
"""ArduPilot's metres in a degree of latitude (LOCATION_SCALING_FACTOR)."""


class FlatFrame:
    """ArduPilot's metres north and east of an origin.

    Parameters
    ----------
    origin : LatLon
        The point 0.
    """

    def __init__(self, origin: LatLon) -> None:
        self.origin = origin

    def to_flat(self, position: LatLon) -> complex:
        """Return a position in metres, north + east·j."""
        north_m = (position.lat_deg - self.origin.lat_deg) * METRES_PER_DEGREE
        lon_deg = wrap_lon_deg(position.lon_deg - self.origin.lon_deg)
        return complex(north_m, lon_deg * METRES_PER_DEGREE * self._shrink(position.lat_deg))

    def to_lat_lon(self, point_m: complex) -> LatLon:
        """Return the position of a point."""
        lat_deg = self.origin.lat_deg + point_m.real / METRES_PER_DEGREE
        lon_deg = point_m.imag / (METRES_PER_DEGREE * self._shrink(lat_deg))
        return LatLon(lat_deg, wrap_lon_deg(self.origin.lon_deg + lon_deg))

    def _shrink(self, lat_deg: float) -> float:
        return math.cos(math.radians((lat_deg + self.origin.lat_deg) / 2.0))


class TrueFrame:
    """True metres north and east of an origin (WGS 84), exact near it and good to 0.1 % within 5 km.

    Parameters
    ----------
    origin : LatLon
        The point 0.
    """

    def __init__(self, origin: LatLon) -> None:
        self.origin = origin
        flattening = 1 / 298.257223563
        e2 = flattening * (2 - flattening)
        lat_rad = math.radians(origin.lat_deg)
        w = math.sqrt(1 - e2 * math.sin(lat_rad) ** 2)
        self._north_m = math.radians(6_378_137.0 * (1 - e2) / w**3)
        self._east_m = math.radians(6_378_137.0 / w * math.cos(lat_rad))

    def to_flat(self, position: LatLon) -> complex:
        """Return a position in metres, north + east·j."""
        lon_deg = wrap_lon_deg(position.lon_deg - self.origin.lon_deg)
        return complex((position.lat_deg - self.origin.lat_deg) * self._north_m, lon_deg * self._east_m)
