"""What a picture of recorded drives shows: the fence, the mission, the targets, and what was driven."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from missions.errors import MissionFormatError
from missions.fence import Fence
from missions.ground.frame import frame_around
from missions.ground.ground import lay_out
from missions.picture.scene import Mark, PictureScene, TrackLine, no_points
from missions.picture.style import MOST_LOOKS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.geo import LatLon
    from missions.ground.frame import LocalFrame

_OTHERS = "other drives"


def drive_scene(
    title: Sequence[str],
    fence: Fence | None,
    parts: Sequence[tuple[str, Sequence[LatLon]]],
    *,
    union: bool = False,
    mission: Sequence[tuple[int, LatLon]] = (),
    targets: Sequence[LatLon] = (),
    breaches: Sequence[tuple[str, LatLon]] = (),
) -> PictureScene:
    """Return the scene of recorded drives.

    Parameters
    ----------
    title : sequence of str
        The lines above the picture.
    fence : Fence or None
        The zones.
    parts : sequence of (str, sequence of LatLon)
        The track in stretches, each with its name: those of one name look alike.
    union : bool
        Whether one inclusion is enough.
    mission : sequence of (int, LatLon)
        The mission's places with the numbers of their items.
    targets : sequence of LatLon
        Where somebody sent the vehicle to.
    breaches : sequence of (str, LatLon)
        Where it left the fence, each with its name.

    Raises
    ------
    MissionFormatError
        There is nothing to draw.
    """
    fence = fence or Fence(())
    driven = [place for _, positions in parts for place in positions]
    places = [*fence.places, *driven, *(at for _, at in mission), *targets]
    if not places:
        raise MissionFormatError("nothing to draw: no fence, no track, no mission and no target")
    frame = frame_around(places)
    ground = lay_out(fence, frame, union=union, around=places)
    items = [f"item {number}\n{at}" for number, at in mission]
    route = frame.to_local_array([at for _, at in mission])
    return PictureScene(
        title=tuple(title),
        ground=ground,
        zone_count=len(fence.zones),
        route_name="mission",
        route=route,
        numbers=tuple(number for number, _ in mission),
        point_texts=tuple(items),
        marks_name="left the fence",
        marks=tuple(Mark(frame.to_local_array([at])[0], name) for name, at in breaches),
        start=frame.to_local_array(driven[:1])[0] if driven else None,
        targets=frame.to_local_array(targets),
        asked=np.full((len(targets), 2), np.nan) if targets else no_points(),
        tracks=_tracks(parts, frame),
    )


def _tracks(parts: Sequence[tuple[str, Sequence[LatLon]]], frame: LocalFrame) -> tuple[TrackLine, ...]:
    """Return the driven lines; those beyond what can be told apart under one name."""
    names = list(dict.fromkeys(name for name, _ in parts))
    own = names if len(names) <= MOST_LOOKS else names[: MOST_LOOKS - 1]
    return tuple(TrackLine(name if name in own else _OTHERS, frame.to_local_array(at)) for name, at in parts)
