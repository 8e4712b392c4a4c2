"""Descriptions of robots as XML: what URDF and SRDF have in common."""

import logging
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

from solfer.errors import ModelError
from solfer.files import read_bytes

logger = logging.getLogger(__name__)


class PlacedElement(Element):
    """An element that knows where it begins: its line and column, which count from one."""

    line = column = 1


def read_text(path: str | Path, kind: str) -> str:
    """Read the file of a description of `kind`, URDF or SRDF.

    Raises:
        ModelError: The file cannot be read, or is not UTF-8.
    """
    try:
        return read_bytes(path).decode()
    except OSError as error:
        raise ModelError(
            f"the {kind} cannot be read: {error.strerror}", where=str(path), expected="a file that this user may read"
        ) from error
    except UnicodeDecodeError as error:
        raise ModelError(f"the {kind} is not UTF-8 text", where=str(path), expected="a file in UTF-8") from error


def parse_robot(text: str, where: str, kind: str) -> tuple[str, Element]:
    """Parse a description of `kind`; `where` names it in errors.

    Blank lines before the XML declaration, which XML does not allow and other parsers of URDFs do, go with a warning.

    Returns:
        The text that was parsed, and its element `<robot>`.

    Raises:
        ModelError: It is not XML, or not a robot.
    """
    blank = len(text) - len(text.lstrip())
    skipped = text.count("\n", 0, blank) if text.startswith("<?xml", blank) else 0
    if blank and text.startswith("<?xml", blank):
        logger.warning("%s:1:1: blank before the XML declaration is skipped", where)
        text = text[blank:]
    try:
        element = _parsed(text, skipped)
    except expat.ExpatError as error:
        what = f"not XML: {expat.ErrorString(error.code)}" if text.strip() else f"the {kind} is empty"
        raise ModelError(
            what,
            where=f"{where}:{error.lineno + skipped}:{error.offset + 1}",
            expected="an XML document with the root <robot>",
        ) from error
    if element.tag != "robot":
        article = "an" if kind == "SRDF" else "a"
        raise ModelError(
            f"not {article} {kind}: the outermost element is <{element.tag}>",
            where=where,
            expected='<robot name="...">',
        )
    return text, element


def _parsed(text: str, skipped: int) -> Element:
    """Parse a text, whose first lines were skipped; ElementTree's own parser keeps no places."""
    parser = expat.ParserCreate()

    def made(tag: str, attributes: dict[str, str]) -> PlacedElement:
        element = PlacedElement(tag, attributes)
        element.line = parser.CurrentLineNumber + skipped
        element.column = parser.CurrentColumnNumber + 1
        return element

    builder = ElementTree.TreeBuilder(element_factory=made)
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.Parse(text, True)
    return builder.close()
