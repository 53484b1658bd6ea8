"""What a route rests on: the fence, what its parameters make of it, and home where a circle about it counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from missions.errors import VehicleError
from missions.geo import distance_m
from missions.vehicle import bits

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.fence import Fence
    from missions.geo import LatLon
    from missions.situation import Known, Situation

_PARAMETERS = (
    "FENCE_ENABLE",
    "FENCE_TYPE",
    "FENCE_RADIUS",
    "FENCE_OPTIONS",
    "FENCE_MARGIN",
    "FENCE_MARGIN_XY",
    "GF_ACTION",
    "GF_MAX_HOR_DIST",
)
_CIRCLE_ABOUT_HOME = 2
_HOME_MOVED_M = 0.5  # HOME_POSITION repeated may differ by the fix; chosen, not measured


@dataclass(frozen=True, slots=True)
class Grounds:
    """What a route rests on."""

    fence: Known[Fence] | None
    parameters: Mapping[str, float]
    home: LatLon | None

    @classmethod
    def of(cls, situation: Situation) -> Self:
        """Take them from what is known."""
        home = (
            situation.home.value if _has_circle(situation.parameters) and situation.home is not None else None
        )
        return cls(situation.fence, situation.parameters, home)

    def changes_since(self, before: Grounds) -> list[str]:
        """Return what is another one than before, by name; a parameter that was not known before has not changed."""
        changes = []
        known = before.fence.value if before.fence is not None else None
        if self.fence is not None and self.fence is not before.fence and self.fence.value != known:
            changes.append(f"{len(self.fence.value.zones)} zones")
        if self.parameters is not before.parameters:
            changes += [
                f"{name} {self.parameters[name]:g}"
                for name in _PARAMETERS
                if name in before.parameters and self.parameters.get(name) != before.parameters[name]
            ]
        if self.home is not None and before.home is not None:
            changes += ["home moved"] if distance_m(self.home, before.home) > _HOME_MOVED_M else []
        return changes


def _has_circle(parameters: Mapping[str, float]) -> bool:
    """Return whether home matters; of a FENCE_TYPE that is none it may (a plan refuses it by name)."""
    if parameters.get("GF_MAX_HOR_DIST", 0) > 0:
        return True
    try:
        return bool(bits(parameters, "FENCE_TYPE", 0) & _CIRCLE_ABOUT_HOME)
    except VehicleError:
        return True
