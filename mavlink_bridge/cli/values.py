"""Numbers and positions in options, each with its range: anything else is wrong usage, refused before anything is done."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import typer

from mavlink_bridge.errors import UsageError
from missions.errors import InvalidPositionError
from missions.geo import parse_lat_lon
from missions.stops import Stop

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from missions.geo import LatLon

MOST_M = 1_000_000.0
"""No clearance, allowance or reserve is wider: ten times the widest field that can be planned."""

MOST_VEHICLE_M = 100.0
"""No vehicle is longer or wider, and no antenna further from its middle."""

MOST_MPS = 100.0
"""No rover is faster."""

LEAST_MPS = 0.05
"""The least speed between waypoints that ArduPilot goes down to."""

MOST_S = 86_400.0
"""No patience and no link's latency is longer than a day."""

_POSITION_ADVICE = "write the latitude first: LAT,LON in decimal degrees, such as 40.0713,-105.2299"

MOST_FLOAT32 = 3.402_823e38
"""What a parameter's 32-bit float on the wire can hold."""


def within(
    least: float, most: float, unit: str = "", *, above: bool = False
) -> Callable[[str | float], float]:
    """Return a parser of numbers in a range (typer's ``parser=``).

    Parameters
    ----------
    least, most : float
        The ends of the range, both allowed.
    unit : str
        What the numbers are, for the message.
    above : bool
        Whether ``least`` itself is not allowed.
    """

    def number(value: str | float) -> float:
        try:
            return checked_number(value, least, most, unit, above=above)
        except UsageError as error:
            raise typer.BadParameter(str(error)) from None

    return number


def checked_number(
    value: str | float, least: float, most: float, unit: str = "", *, above: bool = False, word: str = ""
) -> float:
    """Return the number that a text is.

    Parameters
    ----------
    value : str or float
        As typed, or a default.
    least, most : float
        The ends of the range, both allowed.
    unit : str
        What the number is, for the message.
    above : bool
        Whether ``least`` itself is not allowed.
    word : str
        A word that the option takes instead of a number, for the message.

    Raises
    ------
    UsageError
        It is no number, not finite, or outside the range.
    """
    try:
        number = float(value.replace("_", "?") if isinstance(value, str) else value)  # 4_0 is 40 to Python
    except ValueError:
        number = math.nan
    if not least <= number <= most or (above and number == least):
        interval = f"above {least:.10g}, to {most:.10g}" if above else f"{least:.10g} to {most:.10g}"
        raise UsageError(
            f"{str(value)!r}: expected {unit or 'a number'} ({interval}){f' or {word}' if word else ''}"
        )
    return number


def metres_or(option: str, text: str | None, word: str) -> float | None:
    """Return the metres of an option that is a number or one word.

    Raises
    ------
    UsageError
        It is neither.
    """
    if text is None or text == word:
        return None
    try:
        return checked_number(text, 0.0, MOST_M, "metres", word=word)
    except UsageError as error:
        raise UsageError(f"{option} {error}") from None


AUTOPILOTS = ("ardupilot", "px4")
"""Whose rovers are simulated."""


def autopilot_from(text: str) -> str:
    """Return the autopilot that an option names, one of `AUTOPILOTS`.

    Raises
    ------
    typer.BadParameter
        It is none that is simulated.
    """
    name = text.strip().lower()
    if name not in AUTOPILOTS:
        raise typer.BadParameter(f"{text!r} is not an autopilot; expected one of {', '.join(AUTOPILOTS)}")
    return name


def stop_from(text: str | Stop) -> Stop:
    """Return the stop that an option is (typer's ``parser=``): ``M@MPS``, metres rolled from metres a second."""
    if isinstance(text, Stop):
        return text
    distance, _, speed = text.partition("@")
    try:
        return Stop(
            checked_number(speed, LEAST_MPS, MOST_MPS, "metres a second"),
            checked_number(distance, 0.0, MOST_M, "metres"),
        )
    except UsageError as error:
        raise typer.BadParameter(f"{text!r}: expected M@MPS, such as 6@3 (6 m from 3 m/s); {error}") from None


def position_from(option: str, text: str) -> LatLon:
    """Return the position that an option is.

    Raises
    ------
    UsageError
        Not such a value.
    """
    try:
        return parse_lat_lon(text)
    except InvalidPositionError as error:
        raise UsageError(f"{option}: {error}", **{"advice": _POSITION_ADVICE, **error.details}) from None


def given_places(texts: Sequence[str]) -> dict[str, LatLon]:
    """Return the places that ``--place`` names.

    Raises
    ------
    UsageError
        One is not NAME=LAT,LON, or its name is taken.
    """
    places: dict[str, LatLon] = {}
    for text in texts:
        name, sign, position = text.partition("=")
        name = name.strip()
        if not sign or not name:
            raise UsageError(f"--place {text!r}: expected NAME=LAT,LON")
        if name in places or name.lower().startswith(("home", "rally point")):
            raise UsageError(
                f"--place {text!r}: the name {name!r} is taken; give each place a name of its own"
            )
        places[name] = position_from("--place", position)
    return places
