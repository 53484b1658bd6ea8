"""What a feature of a GeoJSON or KML file is."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING

from missions.formats.choices import NO_CHOICES
from missions.formats.features import Role, Shape

if TYPE_CHECKING:
    from collections.abc import Iterable

    from missions.errors import MissionFormatError
    from missions.formats.choices import Choices
    from missions.formats.features import Feature

_KEEP_OUT = (
    "exclude, excluded, keep out, keepout, keep off, keep away, stay out, stay off, stay away, no go, nogo, no fly, nofly, no fly zone, nfz, "
    "no drive, no entry, no access, no mow, nomow, do not enter, off limits, avoid, forbidden, restricted, prohibited, obstacle, "
    "sperrzone, sperrgebiet, sperrfläche, verboten, verbotszone, flugverbotszone, ausschluss, ausschlusszone, "
    "interdit, interdite, prohibido, prohibida, vietato, vietata, verboden"
)
_ROLES = {role.value: role for role in Role} | {
    **dict.fromkeys(("include", "keep in", "keepin", "stay in"), Role.INCLUSION),
    **dict.fromkeys(_KEEP_OUT.split(", "), Role.EXCLUSION),
    **dict.fromkeys(("mission", "path"), Role.ROUTE),
    "mission item": Role.WAYPOINT,
    "rally": Role.RALLY_POINT,
    "breach return": Role.RETURN_POINT,
    "ignore": Role.DRAWING,
}
_PROPERTY_ROLES = _ROLES | {"inclusive": Role.INCLUSION, "exclusive": Role.EXCLUSION}  # iNav's words
_SURE_KEYS = ("role", "fence")
_LIKELY_KEYS = ("fence_type", "zone", "kind", "type")
_TRUE, _FALSE = ("true", "1", "yes"), ("false", "0", "no")
_FOREIGN_KEY = "fence"
"""Also a key of OpenStreetMap, where yes and no say whether there is one."""
_WHOLE_NAMES = frozenset({Role.HOME, Role.RETURN_POINT, Role.DRAWING})
"""A field called "Home meadow" is not a home; and a feature is left out only by that one word as its role."""

_LONE_WORDS = {
    name: role for word, role in _ROLES.items() if role in _WHOLE_NAMES for name in (word, f"{word}s")
}
_WORDS = {
    role: re.compile(
        rf"(?<![^\W\d_])({'|'.join(word for word in _ROLES if _ROLES[word] is role)})s?(?![^\W\d_])"
    )
    for role in Role
    if role not in _WHOLE_NAMES
}

_ZONES = frozenset({Role.INCLUSION, Role.EXCLUSION})
_POSSIBLE = {
    Shape.POLYGON: _ZONES | {Role.DRAWING},
    Shape.LINE: frozenset({Role.ROUTE, Role.DRAWING}),
    Shape.TRACK: frozenset({Role.ROUTE, Role.DRAWING}),
    Shape.POINT: frozenset({Role.WAYPOINT, Role.HOME, Role.RALLY_POINT, Role.RETURN_POINT, Role.DRAWING}),
    Shape.NOWHERE: frozenset({Role.WAYPOINT, Role.DRAWING}),
}

_FIELD = re.compile(
    r"(field|boundary|boundaries|perimeter|border|paddock|meadow|pasture|lawn|garden|yard|orchard|vineyard|plot|parcel|farm|geofence|mill"
    r"|allowed|mow|mowing|survey|acker|feld|wiese|weide|rasen|garten|hof|mühle|grenze|parzelle|schlag|fläche|champ|pré|prairie|parcelle"
    r"|campo|prado|parcela|vigna|prato|veld|akker|perceel|weiland)s?"
)
_NEUTRAL = re.compile(
    r"(untitled|unnamed|unbenannt(es|er)?|new|neue?[rs]?|drawn|sketch|shape|feature|polygone?|polígono|poligono|circle|kreis|multi\w*|test|layer"
    r"|area|zone|space|fence|region|placemark|element|object|the|der|die|das)s?"
)
"""Names that programs give, and words that say nothing of what to do there."""

_ESCAPED = re.compile(r"\\x([0-9a-fA-F]{2})")
"""A letter beyond ASCII as programs write it that cannot hold it: M\\xfchle."""

_THING = re.compile(
    r"(?<![^\W\d_])((no|kein|keine) [^\W\d_]{3,}|not|never|don['’ ]?t|without|nicht|ohne|jamais|sans|senza|niet|danger|dangerous|hazard|warning|trees?|bush(es)?|hedges?|woods?|forests?|ponds?|lakes?|rivers?"
    r"|streams?|water|ditch(es)?|buildings?|house|barn|sheds?|walls?|rocks?|stones?|holes?|poles?|pylons?|roads?|pool|bed|protected|private"
    r"|baum|bäume|wald|teich|see|fluss|graben|gebäude|haus|gefahr|hindernis|arbres?|étang|árbol|árboles|albero|boom|bomen)(?![^\W\d_])"
)


def role_of(feature: Feature, choices: Choices = NO_CHOICES) -> Role | None:
    """Return what a feature is: by what is said of it, its properties, else its name, else its folders, innermost first; None without a role.

    Raises
    ------
    MissionFormatError
        Two roles are named, a word is not known, or the shape does not fit the role.
    """
    possible = _POSSIBLE[feature.shape]
    if feature.shape is Shape.POINT and feature.radius_m() is not None:
        possible = _ZONES | {Role.DRAWING}
    role = choices.role_for(feature)
    if role is None:
        if feature.is_hidden:
            return Role.DRAWING
        said = _said_roles(feature)
        if len(said) > 1:
            raise feature.error(
                f"marked as {' and '.join(sorted(said))} at once", advice=_either(feature, said)
            )
        role = next(iter(said), None) or _named_role(feature.names, feature, possible | _ZONES)
    if (
        choices.ignores_points
        and feature.shape is Shape.POINT
        and role not in possible
        and not possible & _ZONES
    ):
        return Role.DRAWING
    if role is not None and role not in possible:
        raise _misfit(feature, role, possible)
    return role


def _misfit(feature: Feature, role: Role, possible: Iterable[Role]) -> MissionFormatError:
    expected = ", ".join(sorted(possible))
    reason, advice = "", f"leave it out with {feature.role_option('ignore')}"
    if role in _ZONES and feature.shape is Shape.POINT:
        reason, advice = (
            "; a circle is a point with a radius (metres)",
            f"{advice}, or all points with --ignore-points",
        )
    elif role in _ZONES and feature.shape in (Shape.LINE, Shape.TRACK):
        reason, advice = "; a line has no inside", f"draw a polygon around it, or {advice}"
    return feature.error(f"a {feature.shape} cannot be {role!s}{reason}; expected {expected}", advice=advice)


def _either(feature: Feature, roles: Iterable[Role]) -> str:
    return "choose one: " + " or ".join(feature.role_option(role) for role in sorted(roles, reverse=True))


def _said_roles(feature: Feature) -> set[Role]:
    roles = set()
    for key, value in feature.properties.items():
        word, lower = _plain(str(value)), key.lower()
        if value is None or not word or _is_foreign(lower, word):
            continue
        if lower in _SURE_KEYS or (lower in _LIKELY_KEYS and word in _PROPERTY_ROLES):
            found = _PROPERTY_ROLES.get(word) or _named_role((str(value),), feature, _ZONES)
            if found is None:
                raise feature.error(
                    f"{key} {value!r}; expected one of {', '.join(Role)}",
                    advice=_either(feature, (*_ZONES, Role.DRAWING)),
                )
            roles.add(found)
        elif lower in ("inclusion", "exclusion"):
            if word not in _TRUE + _FALSE:
                raise feature.error(
                    f"{key} {value!r}; expected true or false", advice=_either(feature, _ZONES)
                )
            roles.add(Role.INCLUSION if (lower == "inclusion") == (word in _TRUE) else Role.EXCLUSION)
    return roles


def foreign_property(feature: Feature) -> str | None:
    """Return a property that bears the name of one of ours and says no role, such as OpenStreetMap's fence=yes; None without one."""
    said = ((key, value) for key, value in feature.properties.items() if value is not None)
    return next(
        (f"{key} {value!r}" for key, value in said if _is_foreign(key.lower(), _plain(str(value)))), None
    )


def _is_foreign(key: str, word: str) -> bool:
    return key == _FOREIGN_KEY and word in ("yes", "no")


def _named_role(names: Iterable[str], feature: Feature, possible: Iterable[Role]) -> Role | None:
    """Return the role that words in the names stand for; the innermost name with such a word counts."""
    for name in map(_plain, names):
        roles = _roles_in(name) & frozenset(possible)
        if len(roles) > 1:
            raise feature.error(
                f"the name {name!r} could mean {' or '.join(sorted(roles))}",
                advice=_either(feature, roles),
            )
        if roles:
            return next(iter(roles))
    return None


@lru_cache(maxsize=1024)
def _roles_in(name: str) -> frozenset[Role]:
    """Return the roles that words in a name stand for."""
    if name in _LONE_WORDS:
        return frozenset({_LONE_WORDS[name]})
    return frozenset(role for role, words in _WORDS.items() if words.search(name))


def may_be_inclusion(feature: Feature) -> bool:
    """Return whether a lone zone without a role may be taken for an inclusion.

    Its name says nothing (it has no word of three letters or more, or only such as programs give), or it is one of a field; and nothing that
    is said of it is a thing that rovers keep away from, or says yes or no to a fence.
    """
    if foreign_property(feature) is not None:
        return False
    own = _ESCAPED.sub(lambda found: chr(int(found[1], 16)), feature.names[0] if feature.names else "")
    texts = [*feature.names, *(f"{key} {value}" for key, value in feature.properties.items())]
    if any(_THING.search(_plain(text)) for text in texts if isinstance(text, str)):
        return False
    if own.strip().lower() == "no":
        return False
    words = [word for word in re.findall(r"[^\W\d_]+", _plain(own)) if len(word) > 2]
    return all(_NEUTRAL.fullmatch(word) for word in words) or any(_FIELD.fullmatch(word) for word in words)


def _plain(word: str) -> str:
    return re.sub(r"[\s_-]+", " ", word.strip().lower())
