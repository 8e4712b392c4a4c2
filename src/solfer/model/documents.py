"""Descriptions of robots as XML: what URDF and SRDF have in common."""

import logging
import re
import shutil
import subprocess
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


XACRO = "xacro:"
"""Prefix of the elements that the program xacro expands."""

_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


def read_text(path: str | Path, kind: str) -> str:
    """Read the file of a description of `kind`, URDF or SRDF, and expand it where it is written for xacro.

    Raises:
        ModelError: The file cannot be read, is no text, or cannot be expanded.
    """
    try:
        content = read_bytes(path)
    except OSError as error:
        raise ModelError(
            f"the {kind} cannot be read: {error.strerror}", where=str(path), expected="a file that this user may read"
        ) from error
    text = _decoded(content, str(path), kind)
    return _expanded(path, kind) if f"<{XACRO}" in _COMMENT.sub("", text) else text


def _decoded(content: bytes, where: str, kind: str) -> str:
    """Decode a text: UTF-8, else the encoding of eight bits that its declaration names, else Latin-1."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        declared = re.match(rb"""\s*<\?xml[^>]*?\bencoding\s*=\s*["']([\w.-]+)["']""", content)
        named = "utf-8" if declared is None else declared[1].decode().lower()
        encoding = "latin-1" if named.startswith("utf") else named
        try:
            if b"\0" in content:
                raise ValueError
            text = content.decode(encoding)
        except (ValueError, LookupError):
            raise ModelError(f"the {kind} is not UTF-8 text", where=where, expected="a file in UTF-8") from error
    if named.startswith("utf"):
        logger.warning("%s: it is not UTF-8 text, and read as Latin-1", where)
    return text


def _expanded(path: str | Path, kind: str) -> str:
    """Expand a file by the program xacro."""
    expected = f"an expanded file: xacro {path} > robot.{kind.lower()}"
    program = shutil.which("xacro")
    if program is None:
        what = f"the {kind} is written for xacro, which is not installed"
        raise ModelError(what, where=str(path), expected=f"{expected}, or the Debian package of xacro")
    try:
        done = subprocess.run([program, str(path)], capture_output=True, timeout=60.0, check=True)
    except (OSError, subprocess.SubprocessError) as error:
        output = (getattr(error, "stderr", None) or b"").decode(errors="replace").strip().splitlines()
        reason = output[-1] if output else str(error)
        raise ModelError(f"xacro cannot expand the {kind}: {reason}", where=str(path), expected=expected) from error
    return _decoded(done.stdout, str(path), kind)


def parse_robot(text: str, where: str, kind: str) -> tuple[str, Element]:
    """Parse a description of `kind`; `where` names it in errors.

    What XML does not allow and other parsers of URDFs do, goes with a warning: blank before the XML declaration,
    comments with `--`, ampersands that begin no entity, and what stands behind the robot.

    Returns:
        The text that was parsed, and its element `<robot>`.

    Raises:
        ModelError: It is not XML, not a robot, or written for xacro.
    """
    blank = len(text) - len(text.lstrip())
    skipped = text.count("\n", 0, blank) if text.startswith("<?xml", blank) else 0
    if blank and text.startswith("<?xml", blank):
        logger.warning("%s:1:1: blank before the XML declaration is skipped", where)
        text = text[blank:]
    try:
        element = parse(text, skipped)
    except expat.ExpatError as error:
        place = f"{where}:{error.lineno + skipped}:{error.offset + 1}"
        reason = expat.ErrorString(error.code)
        text = _mended(text)
        try:
            element = parse(text, skipped)
        except expat.ExpatError:
            raise ModelError(
                f"not XML: {reason}" if text.strip() else f"the {kind} is empty",
                where=place,
                expected="an XML document with the root <robot>",
            ) from error
        logger.warning("%s: not XML (%s), and read as PyBullet and Pinocchio read it", place, reason)
    if element.tag != "robot":
        article = "an" if kind == "SRDF" else "a"
        raise ModelError(
            f"not {article} {kind}: the outermost element is <{element.tag}>",
            where=where,
            expected='<robot name="...">',
        )
    _refuse_xacro(element, where, kind)
    return text, element


def _refuse_xacro(robot: Element, where: str, kind: str) -> None:
    """Raise a ModelError if a description has elements that xacro expands."""
    for element in robot.iter():
        if element.tag.startswith(XACRO):
            assert isinstance(element, PlacedElement)
            raise ModelError(
                f"the {kind} is written for xacro: <{element.tag}>",
                where=f"{where}:{element.line}:{element.column}",
                expected=f"an expanded text: xacro FILE > robot.{kind.lower()}",
            )


def _mended(text: str) -> str:
    """Blank out comments and what stands behind the robot, and write ampersands as XML does; lines stay."""
    text = _COMMENT.sub(lambda comment: re.sub(r"[^\n]", " ", comment[0]), text)
    text = re.sub(r"&(?!(?:amp|lt|gt|quot|apos|#\d+|#x[0-9a-fA-F]+);)", "&amp;", text)
    end = re.search(r"</robot\s*>", text)
    return text if end is None else text[: end.end()]


def parse(text: str, skipped: int = 0) -> Element:
    """Parse a text, whose first lines were skipped; ElementTree's own parser keeps no places.

    Prefixes of names mean nothing, as in other parsers of URDFs.
    """
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
