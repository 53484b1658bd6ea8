"""Free space at one clearance together with its slabs: what a query is answered from."""

from __future__ import annotations

from copy import copy
from functools import cached_property
from math import inf
from typing import TYPE_CHECKING

import numpy as np
import shapely

from .block_search import BlockGraph
from .errors import InvalidGeometryError
from .free_space import build_free_space, ground_box, loose_lines, snapped
from .holes import Holes
from .partition.blocks import Blocks
from .partition.slabs import Slabs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .clearance import Geometries
    from .errors import GoalBlockedError, StartBlockedError
    from .free_space import FreeSpace, Scene
    from .geometry import Point
    from .holes import Change
    from .partition.flat import Engine

# Rounding of the two sums of areas: a share, and a strip along all edges; and of a block's height. Chosen, not measured.
_AREA_SLACK = 1e-9
_AREA_SLACK_M = 1e-8
_HEIGHT_SLACK_M = 1e-7
_UNJOINED_SLACK_M = 1e-8

BOUNDARY_TOLERANCE_M = 1e-7
"""A start or goal this near to free space counts as on its boundary."""


def _fills(slabs: Slabs, free: FreeSpace) -> bool:
    """Return whether slabs are as large as free space, joined along their sides, and none is turned inside out."""
    polygons = np.array(free.polygons, dtype=object)
    area_m2 = float(shapely.area(polygons).sum())
    slack_m2 = _AREA_SLACK * area_m2 + _AREA_SLACK_M * float(shapely.length(polygons).sum())
    return (
        abs(slabs.area_m2 - area_m2) <= slack_m2
        and slabs.least_height_m >= -_HEIGHT_SLACK_M
        and abs(slabs.unjoined_m) <= _UNJOINED_SLACK_M * len(slabs)
    )


class Field:
    """Free space at one clearance with its slabs.

    Parameters
    ----------
    scene : Scene
        The fence.
    clearance_m : float
        Clearance in metres.
    rounded : bool, default False
        Whether corners are offset round.
    reach : sequence of (east, north)
        Points that the bounded part of the open plane must hold, metres from the scene's origin.
    grown : (n,) array of shapely geometry, optional
        The exclusions grown by the clearance, if they are known already.
    engine : Engine, optional
        The compiled sweep and search.
    """

    def __init__(
        self,
        scene: Scene,
        clearance_m: float,
        *,
        rounded: bool = False,
        reach: Sequence[Point] = (),
        grown: Geometries | None = None,
        engine: Engine | None = None,
    ) -> None:
        self.scene = scene
        self.engine = engine
        self.free = build_free_space(scene, clearance_m, rounded=rounded, reach=reach, grown=grown)
        self._graphs: dict[str, BlockGraph] = {}
        self._is_changed = self._is_on_grid = False

    @cached_property
    def holes(self) -> Holes | None:
        """The holes of free space, to be changed one by one; None where more than exclusions makes them."""
        _ = self.searched  # which may put free space on a grid
        is_other = self._is_on_grid or len(loose_lines(self.scene.inclusions)) > 0
        return None if is_other else Holes.of(self.free)

    def changed(self, scene: Scene, change: Change | None) -> Field | None:
        """Return the field of a changed fence, swept anew only where that is; None if it must be made anew."""
        if change is None or ground_box(self.scene) != ground_box(scene):
            return None
        try:
            slabs = self.searched.changed(change.gone, change.rings, change.owner)
        except (IndexError, ValueError):
            return None
        if slabs is None or not _fills(slabs, change.holes.free):
            return None
        field = copy(self)
        for name in ("slabs", "blocks", "_anew"):
            field.__dict__.pop(name, None)
        field.scene, field.free = scene, change.holes.free
        field._graphs, field._is_changed = {}, True  # noqa: SLF001 - a copy
        field.searched, field.holes = slabs, change.holes
        return field

    @cached_property
    def _anew(self) -> Field:
        """The same, made anew: what shows blocks or searches over them wants them in the order of one sweep."""
        return Field(self.scene, self.free.clearance_m, grown=self.free.grown, engine=self.engine)

    @cached_property
    def searched(self) -> Slabs:
        """The slabs that the exact search reads: `slabs`, or those of a field that was changed."""
        return self.slabs

    @cached_property
    def slabs(self) -> Slabs:
        """The slab partition, checked: as large as free space, and no block turned inside out.

        Raises
        ------
        InvalidGeometryError
            If it is not.
        """
        if self._is_changed:
            return self._anew.slabs
        try:
            return self._checked_slabs()
        except InvalidGeometryError:
            # Slivers that cross each other within rounding: on a grid they fit together or are gone.
            self.free, self._is_on_grid = snapped(self.free), True
            return self._checked_slabs()

    def _checked_slabs(self) -> Slabs:
        try:
            slabs = Slabs(self.free.polygons, self.engine)
        except (IndexError, ValueError) as error:
            raise InvalidGeometryError("the rings of free space do not fit together") from error
        if not _fills(slabs, self.free):
            raise InvalidGeometryError(
                f"the blocks do not fill free space: they cover {slabs.area_m2!r} m² of {self.free.geometry.area!r} m², "
                f"the least of their heights is {slabs.least_height_m!r} m, {slabs.unjoined_m!r} m of their sides are not joined"
            )
        return slabs

    @cached_property
    def blocks(self) -> Blocks:
        """The paper's block partition.

        Raises
        ------
        InvalidGeometryError
            If the rings of free space do not fit together.
        TooManyBlocksError
            If there would be too many.
        """
        if self._is_changed:
            return self._anew.blocks
        try:
            return Blocks(self.free.polygons, self.slabs)
        except (IndexError, ValueError):
            # Swept from south to north slivers may cross where they did not from west to east. Only the horizontal lines come from there.
            level = snapped(self.free)
        try:
            return Blocks(level.polygons, self.slabs)
        except (IndexError, ValueError) as error:
            raise InvalidGeometryError("the rings of free space do not fit together") from error

    def graph(self, partition: str) -> BlockGraph:
        """Return the blocks of a partition with their neighbours, made once."""
        if partition not in self._graphs:
            self._graphs[partition] = BlockGraph(self.slabs if partition == "slabs" else self.blocks)
        return self._graphs[partition]

    def holds(self, point: Point) -> bool:
        """Return whether a point lies in the bounds of free space."""
        west, south, east, north = self.free.geometry.bounds
        return west <= point[0] <= east and south <= point[1] <= north

    def nearest(self, point: Point) -> tuple[Point, float]:
        """Return the nearest point of free space and how far it is in metres."""
        line = shapely.shortest_line(self.free.geometry, shapely.Point(point))
        east, north = shapely.get_coordinates(line)[0].tolist()
        return (east, north), float(shapely.length(line))

    def require(self, point: Point, error: type[StartBlockedError | GoalBlockedError]) -> frozenset[int]:
        """Return the components that a point of the map lies in; raise the error with the nearest free point if in none."""
        local = self.scene.to_local(point)
        blocks = self.searched.locate(local)
        if blocks:
            return self.searched.components(blocks)
        components = self.free.components_at(local, BOUNDARY_TOLERANCE_M)
        if components:
            return components
        if not self.free.polygons:
            raise error(point, self.free.clearance_m, inf, None)
        nearest, distance_m = self.nearest(local)
        raise error(point, self.free.clearance_m, distance_m, self.scene.from_local(nearest))

    def onto(self, point: Point, components: frozenset[int]) -> Point:
        """Return a point that `require` has let pass as the search needs it: moved into free space by as little as puts it there for certain.

        Parameters
        ----------
        point : (east, north)
            Metres from the scene's origin.
        components : frozenset of int
            The components that it may lie in.

        Returns
        -------
        (east, north)
            Metres from the scene's origin.
        """
        return self.searched.places.settle(point, 2.0 * BOUNDARY_TOLERANCE_M, components)
