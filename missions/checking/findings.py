"""What a check found, one thing at a time and each at its item: for reports that other programs read (`sarif`, `junit`)."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from missions.checking.check import CheckedLeg, MissionCheck

_ITEM = re.compile(r"\bitem (\d+)")
_LINE = re.compile(r"\bline (\d+)")


class Rule(StrEnum):
    """What kind of thing was found."""

    CROSSES = "leg-crosses-fence"
    CLEARANCE = "leg-clearance"
    DANGER = "danger"
    NOT_UNDERSTOOD = "not-understood"
    WAY_HOME = "way-home"
    NOT_CONFIRMED = "not-confirmed"
    UNUSABLE = "unusable"
    REMARK = "remark"


RULES: dict[Rule, str] = {
    Rule.CROSSES: "A straight leg crosses a fence, or the vehicle stops at a seam of its zones.",
    Rule.CLEARANCE: "The predicted track of a leg comes nearer to a fence than the clearance that is required.",
    Rule.DANGER: "The drive is known to end in a fence, whatever its legs keep.",
    Rule.NOT_UNDERSTOOD: "An item was not understood: where the vehicle goes then is not known.",
    Rule.WAY_HOME: "A way home inside the mission is not safe.",
    Rule.NOT_CONFIRMED: "The drive is extrapolated beyond what was measured: its clearance is predicted, not promised.",
    Rule.UNUSABLE: "The mission, its fence or its vehicle cannot be used, so nothing was checked.",
    Rule.REMARK: "Something to know before the drive; the check does not fail because of it.",
}
"""Each rule in a sentence, for reports that list them."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was found.

    Parameters
    ----------
    rule : Rule
        Of which kind.
    message : str
        What, with its numbers.
    item : int or None
        At which item; None where it is of the whole mission.
    case : str
        The leg or the way home, by name; empty where it is of the whole mission.
    line : int
        The line of the mission's file where that stands, from 1.
    """

    rule: Rule
    message: str
    item: int | None = None
    case: str = ""
    line: int = 1

    @property
    def fails(self) -> bool:
        """Whether the check fails by it."""
        return self.rule != Rule.REMARK


@dataclass(frozen=True, slots=True)
class Report:
    """A mission's file, the cases that were checked (its legs and ways home), and what was found."""

    file: str
    cases: tuple[str, ...]
    findings: tuple[Finding, ...]

    @property
    def failures(self) -> tuple[Finding, ...]:
        """The findings by which the check fails."""
        return tuple(finding for finding in self.findings if finding.fails)


def report_of(file: str, checked: MissionCheck, warnings: Iterable[str], lines: Sequence[int]) -> Report:
    """Return what a check found.

    Parameters
    ----------
    file : str
        The mission's file.
    checked : MissionCheck
        The check.
    warnings : iterable of str
        What else a person should know.
    lines : sequence of int
        On which line each item stands, home's first; nothing where that is not known.
    """
    found = [
        *(Finding(Rule.NOT_UNDERSTOOD, text, _item_in(text)) for text in checked.troubles),
        *(Finding(Rule.DANGER, text, _item_in(text)) for text in checked.dangers),
        *map(_of_leg, checked.broken),
        *(
            Finding(Rule.WAY_HOME, f"{way}: {way.trouble}", way.part.item, str(way))
            for way in checked.home_ways
            if way.trouble
        ),
        *_not_confirmed(checked),
        *(Finding(Rule.REMARK, text, _item_in(text)) for text in dict.fromkeys(warnings)),
    ]
    names = [f"leg {leg.name}" for leg in checked.legs] + [str(way) for way in checked.home_ways]
    cases = tuple(dict.fromkeys(names))
    return Report(file, cases, tuple(_at_line(finding, lines) for finding in found))


def report_of_error(file: str, text: str, error: Exception) -> Report:
    """Return the report of a mission that could not be checked; at the line that the error names, if that is one of this file."""
    named = getattr(error, "details", {}).get("line")
    if named is None and (match := _LINE.search(text)) is not None:
        named = match.group(1)
    line = int(named) if named is not None and file in text else 1
    return Report(file, (), (Finding(Rule.UNUSABLE, text, line=line),))


def leg_sentence(leg: CheckedLeg) -> str:
    """Return what is wrong with a leg that breaks the promise."""
    if leg.stops_at_seam:
        return f"leg {leg.name} crosses {', '.join(leg.crosses)}: the vehicle stops at {leg.at}"
    if leg.crosses:
        return f"leg {leg.name} crosses {', '.join(leg.crosses)}, first at {leg.at}"
    return (
        f"leg {leg.name} comes within {leg.driven_clearance_m:.2f} m of {leg.fence} while driving "
        f"({metres(leg.drawn_clearance_m)} along the straight leg, at {leg.at}); {metres(leg.asked_m)} is required"
    )


def not_confirmed_text(checked: MissionCheck) -> str:
    """Return why a mission that holds is not promised."""
    return (
        f"every leg is predicted to keep {checked.clearance_m:g} m while driving, but the drive is extrapolated beyond what was measured "
        "(--trust-model takes the prediction)"
    )


def _of_leg(leg: CheckedLeg) -> Finding:
    course = leg.leg
    rule = Rule.CROSSES if leg.crosses else Rule.CLEARANCE
    return Finding(rule, leg_sentence(leg), course.last_item, f"leg {leg.name}")


def _not_confirmed(checked: MissionCheck) -> list[Finding]:
    if checked.is_promised or not checked.holds:
        return []
    text = "; ".join([not_confirmed_text(checked), *checked.extrapolated])
    return [Finding(Rule.NOT_CONFIRMED, text)]


def _item_in(text: str) -> int | None:
    """Return the item that a text names; None where it names none, or several."""
    named = set(_ITEM.findall(text))
    return int(named.pop()) if len(named) == 1 else None


def _at_line(finding: Finding, lines: Sequence[int]) -> Finding:
    known = finding.item is not None and finding.item < len(lines)
    return replace(finding, line=lines[finding.item or 0]) if known else finding
