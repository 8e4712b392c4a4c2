"""Descriptions of robots as XML: what URDF and SRDF have in common."""

import logging
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from solfer.errors import ModelError

logger = logging.getLogger(__name__)


def read_text(path: str | Path, kind: str) -> str:
    """Read the file of a description of `kind`, URDF or SRDF.

    Raises:
        ModelError: The file cannot be read, or is not UTF-8.
    """
    try:
        return Path(path).read_text(encoding="utf-8")
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
        element = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        line, column = error.position
        what = f"not XML: {str(error).split(':')[0]}" if text.strip() else f"the {kind} is empty"
        raise ModelError(
            what, where=f"{where}:{line + skipped}:{column + 1}", expected="an XML document with the root <robot>"
        ) from error
    if element.tag != "robot":
        article = "an" if kind == "SRDF" else "a"
        raise ModelError(
            f"not {article} {kind}: the outermost element is <{element.tag}>",
            where=where,
            expected='<robot name="...">',
        )
    return text, element
