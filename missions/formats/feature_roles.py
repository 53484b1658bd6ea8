"""What a feature of a GeoJSON or KML file is."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from missions.formats.features import Role, Shape

if TYPE_CHECKING:
    from collections.abc import Iterable

    from missions.formats.features import Feature

_ROLES = {role.value: role for role in Role} | {
    **dict.fromkeys(("include", "keep in", "keepin", "stay in"), Role.INCLUSION),
    **dict.fromkeys(
        ("exclude", "excluded", "keep out", "keepout", "stay out", "no go", "nogo", "forbidden", "obstacle"),
        Role.EXCLUSION,
    ),
    **dict.fromkeys(("mission", "path"), Role.ROUTE),
    "mission item": Role.WAYPOINT,
    "rally": Role.RALLY_POINT,
    "breach return": Role.RETURN_POINT,
}
_SURE_KEYS = ("role", "fence")
_LIKELY_KEYS = ("fence_type", "zone", "kind", "type")
_TRUE, _FALSE = ("true", "1", "yes"), ("false", "0", "no")
_WHOLE_NAMES = frozenset({Role.HOME, Role.RETURN_POINT, Role.DRAWING})
"""A field called "Home meadow" is not a home; and a feature is left out only by that one word as its role."""

_ZONES = frozenset({Role.INCLUSION, Role.EXCLUSION})
_POSSIBLE = {
    Shape.POLYGON: _ZONES | {Role.DRAWING},
    Shape.LINE: frozenset({Role.ROUTE, Role.DRAWING}),
    Shape.POINT: frozenset({Role.WAYPOINT, Role.HOME, Role.RALLY_POINT, Role.RETURN_POINT, Role.DRAWING}),
    Shape.NOWHERE: frozenset({Role.WAYPOINT, Role.DRAWING}),
}


def role_of(feature: Feature) -> Role | None:
    """Return what a feature is, by its properties, else its name, else its folders, innermost first; None where none of them names a role.

    Raises
    ------
    MissionFormatError
        Two roles are named, a word is not known, or the shape does not fit the role.
    """
    possible = _POSSIBLE[feature.shape]
    if feature.shape is Shape.POINT and feature.radius_m() is not None:
        possible = _ZONES | {Role.DRAWING}
    said = _said_roles(feature)
    if len(said) > 1:
        raise feature.error(f"said to be {' and '.join(sorted(said))} at once")
    role = next(iter(said), None) or _named_role(feature, possible | _ZONES)
    if role is not None and role not in possible:
        reason = "; a circle is a point with a radius (metres)" if feature.shape is Shape.POINT else ""
        expected = ", ".join(sorted(possible))
        raise feature.error(f"a {feature.shape} cannot be {role!s}{reason}; expected {expected}")
    return role


def _said_roles(feature: Feature) -> set[Role]:
    roles = set()
    for key, value in feature.properties.items():
        word, lower = _plain(str(value)), key.lower()
        if value is None or not word:
            continue
        if lower in _SURE_KEYS or (lower in _LIKELY_KEYS and word in _ROLES):
            if word not in _ROLES:
                raise feature.error(f"{key} {value!r}; expected one of {', '.join(Role)}")
            roles.add(_ROLES[word])
        elif lower in ("inclusion", "exclusion"):
            if word not in _TRUE + _FALSE:
                raise feature.error(f"{key} {value!r}; expected true or false")
            roles.add(Role.INCLUSION if (lower == "inclusion") == (word in _TRUE) else Role.EXCLUSION)
    return roles


def _named_role(feature: Feature, possible: Iterable[Role]) -> Role | None:
    """Return the roles that words in the names stand for; the innermost name with such a word counts."""
    for name in map(_plain, feature.names):
        roles = {
            role
            for word, role in _ROLES.items()
            if role in possible
            if (
                name in (word, f"{word}s")
                if role in _WHOLE_NAMES
                else re.search(rf"(?<![a-z]){word}s?(?![a-z])", name)
            )
        }
        if len(roles) > 1:
            raise feature.error(
                f"the name {name!r} tells of {' and '.join(sorted(roles))}; expected one of them"
            )
        if roles:
            return roles.pop()
    return None


def _plain(word: str) -> str:
    return re.sub(r"[\s_-]+", " ", word.strip().lower())
