"""What its user says of a file: roles by name, and what to do with features of which the file does not say what they are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError
from missions.formats.features import name_key

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from missions.formats.features import Feature, Role


@dataclass(frozen=True, slots=True)
class Choices:
    """What the user says of a map file's features, where the file does not.

    Parameters
    ----------
    roles : mapping of str to Role
        By a feature's name, that of a folder it lies in, or its number (``polygon 2``); capitals make no difference.
    outermost_is_inclusion : bool
        Of zones without a role, the one that contains all others is an inclusion, and the others are exclusions.
    ignores_points : bool
        Points without a role are left out.
    """

    roles: Mapping[str, Role] = field(default_factory=dict)
    outermost_is_inclusion: bool = False
    ignores_points: bool = False

    def role_for(self, feature: Feature) -> Role | None:
        """Return the role that is said of a feature, the innermost name first."""
        said = {name_key(name): role for name, role in self.roles.items()}
        keys = map(name_key, (feature.label, *feature.names))
        return next((said[key] for key in keys if key in said), None)

    def check_names(self, features: Iterable[Feature], source: str) -> None:
        """Check that each name is that of a feature.

        Raises
        ------
        MissionFormatError
            One is not; the message lists the names that there are.
        """
        shown = {
            name_key(name): name for feature in features for name in (*feature.names, feature.label) if name
        }
        for name in self.roles:
            if name_key(name) not in shown:
                there = ", ".join(map(repr, list(shown.values())[:20])) or "none"
                raise MissionFormatError(
                    f"{source}: --role {name!r}: no feature has that name; names in the file: {there}",
                    file=source,
                )


NO_CHOICES = Choices()
