"""Texts from outside made fit to be shown, numbers in texts short whatever they are, and sentences that several rooms say alike."""

from __future__ import annotations

import unicodedata

_LONG_M = 1e7
"""Beyond the Earth's own size digits mean nothing."""


def metres(value_m: float) -> str:
    """Return a length in metres for people: to the centimetre, and short where it is no length on Earth."""
    return f"{value_m:.2f} m" if abs(value_m) < _LONG_M else f"{value_m:.3g} m"


def counted(count: int, name: str) -> str:
    """Return a number of things for people, such as "1 waypoint" and "2 waypoints"."""
    return f"{count} {name}" if count == 1 else f"{count} {name}s"


def mission_items(count: int, *, has_home: bool = True) -> str:
    """Return how many items a mission has as the autopilot counts them: home included, but on PX4, which has no home item."""
    return f"{counted(count, 'mission item')}{' with home' if has_home else ''}"


HEADING_UNKNOWN = "heading unknown; assuming the rover faces waypoint 1"


def less_text(asked: str, promised_m: float) -> str:
    """Return a sentence on a plan that promises less than was asked, because that was allowed."""
    return (
        f"no route keeps {asked} while driving: the widest, with {promised_m:g} m, was taken (--accept-less)"
    )


def start_near_text(distance_m: float, asked_m: float, kept_m: float) -> str:
    """Return a sentence on a start that is nearer to a fence than what is asked for, and what is kept as the vehicle leaves it."""
    return (
        f"the start is {metres(distance_m)} from a fence, too near to keep {asked_m:g} m: "
        f"while leaving it, the rover keeps at least {metres(max(kept_m, 0.0))}"
    )


def left_out_text(count: int, most: int) -> str:
    """Return a sentence on the items of a route that were left out, because the vehicle holds no more than ``most``."""
    return f"{counted(count, 'route item')} left out to fit the vehicle's limit of {most}"


def moved_text(name: str, away_m: float, place: object) -> str:
    """Return a sentence on a target or an item that stood where a fence leaves no room, and was moved."""
    return f"{name} is blocked by a fence: moved {away_m:.2f} m to {place}"


def harmless(text: str) -> str:
    r"""Return a text as one line in which every character can be seen.

    Control characters (a terminal obeys them), line breaks (what follows would pass for a line of ours), characters that turn the direction
    of writing or take no room, and lone surrogates become escapes as Python writes them: ``\x1b``, ``\n``, ``\u202e``. Letters,
    digits, signs and spaces of every script stay, and so do backslashes, which paths on Windows are full of.

    Parameters
    ----------
    text : str
        Any text.

    Returns
    -------
    str
        The text itself where it is harmless already.
    """
    if text.isprintable():
        return text
    return "".join(one if _is_seen(one) else one.encode("unicode_escape").decode() for one in text)


def _is_seen(character: str) -> bool:
    return character.isprintable() or unicodedata.category(character) == "Zs"
