"""XML read with care: no document types and so no entities, no fetching, no endless depth; every element knows its line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from missions.errors import MissionFormatError
from missions.formats.bounds import MOST_XML_ELEMENTS, check_bound, check_depth


@dataclass(slots=True)
class Element:
    """An element: its name without prefix, its attributes, its children and the text between them.

    Parameters
    ----------
    name : str
        Without its prefix.
    where : str
        File and line, for errors.
    """

    name: str
    where: str
    attributes: dict[str, str] = field(default_factory=dict)
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def error(self, problem: str) -> MissionFormatError:
        """Return an error that names file and line."""
        return MissionFormatError(f"{self.where}: {problem}", where=self.where)

    def all(self, *names: str) -> Iterator[Element]:
        """Return the children of a name."""
        return (child for child in self.children if child.name in names)

    def first(self, name: str) -> Element | None:
        """Return the first child of a name."""
        return next(self.all(name), None)

    def text_of(self, name: str) -> str:
        """Return the text of the first child of a name, empty without one."""
        child = self.first(name)
        return child.text.strip() if child else ""


def parse_xml(text: str, source: str) -> Element:
    """Read an XML text.

    Raises
    ------
    MissionFormatError
        The text is not XML, or has what is refused; the message names the line.
    """
    from xml.parsers import expat  # noqa: PLC0415 - quick help; document types are refused below

    parser = expat.ParserCreate()
    root = Element("", source)
    stack = [root]
    elements = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        where = f"{source}: line {parser.CurrentLineNumber}"
        check_depth(len(stack), where)
        nonlocal elements
        elements += 1
        check_bound(elements, MOST_XML_ELEMENTS, "XML elements", source)
        element = Element(name.rpartition(":")[2], where, attributes)
        stack[-1].children.append(element)
        stack.append(element)

    def end(_name: str) -> None:
        element = stack.pop()
        element.text = "".join(texts.pop(id(element), ()))

    def characters(data: str) -> None:
        texts.setdefault(id(stack[-1]), []).append(data)

    def refuse(*_: object) -> None:
        where = f"{source}: line {parser.CurrentLineNumber}"
        raise MissionFormatError(f"{where}: a document type (<!DOCTYPE …>) is not supported", where=where)

    texts: dict[int, list[str]] = {}
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = characters
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        where = f"{source}: line {error.lineno}"
        raise MissionFormatError(f"{where}: not XML: {expat.ErrorString(error.code)}", where=where) from None
    return root.children[0]
