"""From polygons and circles with their roles, or without, to zones of a fence."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.fence import CircleZone, PolygonZone, Zone, ZoneKind
from missions.formats.feature_roles import foreign_property, may_be_inclusion
from missions.formats.features import Role

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.errors import MissionFormatError
    from missions.formats.choices import Choices
    from missions.formats.features import Feature


def roles_of_zones(
    zones: Sequence[tuple[Feature, Role | None]], choices: Choices, points: Sequence[Feature]
) -> tuple[list[tuple[Feature, Role]], tuple[str, ...]]:
    """Return each zone's role, and remarks on those that were taken for something.

    A lone zone of which nothing is said is an inclusion; of several each must be said, or ``--outermost inclusion`` sorts them.

    Raises
    ------
    MissionFormatError
        What zones or points are is not certain; the message names them, the advice the options that settle it.
    """
    unknown = [feature for feature, role in zones if role is None]
    fields = [feature for feature, role in zones if role is not Role.EXCLUSION]
    if unknown and choices.outermost_is_inclusion:
        if points:
            raise _uncertain((), points, fields)
        outer = _outermost(fields)
        return [
            (feature, role or (Role.INCLUSION if feature is outer else Role.EXCLUSION))
            for feature, role in zones
        ], ()
    remarks: tuple[str, ...] = ()
    if len(zones) == 1 and unknown and may_be_inclusion(unknown[0]):
        lone = unknown.pop()
        taken = f"{lone} is the only zone and has no role: used as an inclusion (area to stay in)"
        remarks = (f"{lone.where}: {taken} (otherwise: {lone.role_option('exclusion')})",)
    if unknown or points:
        raise _uncertain(unknown, points, fields)
    return [(feature, role or Role.INCLUSION) for feature, role in zones], remarks


def _uncertain(
    zones: Sequence[Feature], points: Sequence[Feature], fields: Sequence[Feature]
) -> MissionFormatError:
    problems = []
    if zones:
        foreign = next(filter(None, map(foreign_property, zones)), None)
        problems.append(
            f"unclear whether {_listed(zones)} {'are inclusions or exclusions' if len(zones) > 1 else 'is an inclusion or an exclusion'}"
            f"{f' ({foreign} is not a role)' if foreign else ''}"
        )
    if points:
        problems.append(f"unclear what {_listed(points)} {'are' if len(points) > 1 else 'is'}")
    first = (*zones, *points)[0]
    options, notes = [], []
    if len(zones) > 1 and _find_outermost(fields) is not None:
        options.append("--outermost inclusion")
        notes.append("then all others are exclusions")
    elif zones:
        options += [zone.role_option("exclusion") for zone in zones[:5]]
        notes.append("or =inclusion, =ignore")
    if points:
        options.append("--ignore-points")
        notes += [] if zones else [f"or set a role, such as {first.role_option('waypoint')}"]
    advice = f"add to the command: {' '.join(options)} ({'; '.join(notes)})"
    return first.error("; ".join(problems), advice=advice.removesuffix(" ()"))


def _listed(features: Sequence[Feature]) -> str:
    names = [str(feature) for feature in features[:10]]
    more = f" and {len(features) - 10} more" if len(features) > 10 else ""
    return ", ".join(names) + more


def _outermost(zones: Sequence[Feature]) -> Feature:
    found = _find_outermost(zones)
    if found is None:
        raise zones[0].error(
            f"--outermost: none of these zones contains all others: {_listed(zones)}",
            advice=f"set the role of each: {zones[0].role_option('inclusion')} …",
        )
    return found


def _find_outermost(zones: Sequence[Feature]) -> Feature | None:
    from missions.formats.zone_shapes import find_outermost  # noqa: PLC0415 - shapely is slow to come, only for these

    return find_outermost(zones)


def zones_of(feature: Feature, role: Role) -> list[Zone]:
    """Return the zones that a polygon or a circle stands for: the holes of an inclusion are exclusions, an exclusion is cut along its holes.

    Raises
    ------
    MissionFormatError
        The rings of an exclusion with holes cross.
    """
    kind = ZoneKind.EXCLUSION if role is Role.EXCLUSION else ZoneKind.INCLUSION
    radius_m = feature.radius_m()
    if radius_m is not None:
        return [CircleZone(kind, feature.position, radius_m)]
    outer, *holes = feature.lines
    if kind is ZoneKind.EXCLUSION and holes:
        from missions.formats.zone_shapes import cut_along_holes  # noqa: PLC0415 - as above

        return [PolygonZone(kind, ring) for ring in cut_along_holes(feature)]
    return [PolygonZone(kind, outer), *(PolygonZone(ZoneKind.EXCLUSION, hole) for hole in holes)]
