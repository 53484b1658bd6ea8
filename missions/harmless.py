"""Texts from vehicles, files and other people, made fit to be shown."""

from __future__ import annotations

import unicodedata


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
