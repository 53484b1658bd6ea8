"""Ways home for the command line: the JSON document, the lines in pictures, the warnings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from missions.picture.scene import TrackLine
from missions.routing.way_home import PlaceKind, places_of, ways_home
from missions.routing.ways_along import along, way_remarks
from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.geo import LatLon
    from missions.picture.scene import PictureScene
    from missions.planned import Plan
    from missions.routing.way_home import WayHome, WaysHome
    from missions.routing.ways_along import AlongRoute
    from missions.situation import Situation


@dataclass(frozen=True, eq=False)
class RouteWays:
    """The ways home of a plan or a checked mission.

    Parameters
    ----------
    ways : WaysHome
        Those of the field.
    route : AlongRoute
        What of the route has none.
    path, seqs
        The route's points, and the mission item of each.
    """

    ways: WaysHome
    route: AlongRoute
    path: tuple[LatLon, ...]
    seqs: tuple[int, ...]

    @classmethod
    def of(cls, plan: Plan, situation: Situation, given: Mapping[str, LatLon]) -> RouteWays | None:
        """Look for them; None where there is no place to go home to.

        Raises
        ------
        MissionError
            The fence cannot be used.
        """
        places = places_of(situation, given)
        if not places:
            return None
        ways = ways_home(situation, plan.vehicle, plan.asked_m, places, plan.path)
        return cls(ways, along(ways, plan.path), plan.path, plan.seqs)

    @cached_property
    def found(self) -> tuple[WayHome | None, ...]:
        """The way from each point of the route; None where there is none."""
        return tuple(map(self.ways.nearest, self.path))

    @property
    def warnings(self) -> list[str]:
        """What a person should know."""
        return way_remarks(self.ways, self.route, self.seqs)

    @property
    def sentence(self) -> str:
        """The way home from where the route ends."""
        last = self.found[-1]
        if last is None:
            return (
                f"Way home from the target: none that keeps {metres(self.ways.clearance_m)} from every fence"
            )
        return (
            f"Way home from the target: {last.length_m:.1f} m to {last.place.name}, about {last.time_s:.0f} s"
        )

    def drawn(self, scene: PictureScene) -> PictureScene:
        """Return a scene with the ways from each point of the route; where home is the only place they would but cover the route."""
        if all(place.kind is PlaceKind.HOME for place in self.ways.places):
            return scene
        local = scene.ground.frame.to_local_array
        lines = {way.path: way for way in self.found if way is not None and way.length_m > 0}
        tracks = tuple(TrackLine("way home", local(path)) for path in lines)
        return replace(scene, tracks=(*scene.tracks, *tracks))

    def document(self) -> dict[str, object]:
        """Return them for the JSON document."""
        ways, route = self.ways, self.route
        return {
            "clearance_m": round(ways.clearance_m, 4),
            "places": [
                {
                    "name": place.name,
                    "kind": str(place.kind),
                    "position": list(place.position),
                    "blocked": ways.blocked.get(place.name),
                }
                for place in ways.places
            ],
            "from": [
                {
                    "item": seq,
                    "to": way.place.name if way else None,
                    "length_m": round(way.length_m, 3) if way else None,
                    "time_s": round(way.time_s, 1) if way else None,
                    "path": [list(position) for position in way.path] if way else None,
                }
                for seq, way in zip(self.seqs, self.found, strict=True)
            ],
            "without_m": round(route.without_m, 1),
            "first_without": list(route.first_without) if route.first_without else None,
        }
