"""Messages of the parser of YAML, in words that name the cure."""

import re
import unicodedata

import yaml

from solfer.errors import ConfigError

_LINE_END = re.compile(r"\r\n|\r|\n")
"""What ends a line for YAML 1.2; `str.splitlines` knows more."""


def odd_blank(text: str, file: str, first: int, last: int) -> ConfigError | None:
    """Make the error of a character that looks like a blank and is none, where YAML needs one; None: there is none.

    Args:
        text: The text.
        file: Its file.
        first: The first line to search, from zero on.
        last: The last line.
    """
    odd = r"(?:(?![ \t\r\n])\s|[\u200b\u2060\ufeff])"  # looks like a blank, or like nothing, and is none for YAML
    misplaced = re.compile(rf"^[ \t]*({odd})|:({odd})|({odd})\s*$")
    comment = re.compile(r"(?:^|[ \t])#")
    for number, line in enumerate(_LINE_END.split(text)[first : last + 1], start=first + 1):
        found = misplaced.search(comment.split(line, maxsplit=1)[0])
        if found is not None:
            column = found.start(found.lastindex or 0)
            character = line[column]
            name = unicodedata.name(character, "a control character")
            what = f"not YAML: {name} (U+{ord(character):04X}) instead of a blank"
            return ConfigError(what, where=f"{file}:{number}:{column + 1}", expected="blanks (U+0020)")
    return None


def not_yaml(error: yaml.MarkedYAMLError, text: str, file: str) -> ConfigError:
    """Make the error of a text that is not YAML, with its place."""
    mark = error.problem_mark or error.context_mark
    line, column = (mark.line, mark.column) if mark else (0, 0)
    lines = _LINE_END.split(text)
    written = lines[line] if line < len(lines) else ""
    where = f"{file}:{line + 1}:{column + 1}"
    if "\t" in written[: len(written) - len(written.lstrip())]:
        return ConfigError("not YAML: a tab in the indentation", where=where, expected="spaces")
    begin = (error.context_mark.line if error.context_mark else line) + 1
    odd = odd_blank(text, file, min(begin - 1, line), last=line)
    if odd is not None:
        return odd
    joined = _joined(lines, error.context_mark.line if error.context_mark else max(line - 1, 0), line)
    if joined is not None and ("expected ':'" in (error.problem or "") or "mapping values" in (error.problem or "")):
        number, found = joined
        return ConfigError(
            f"not YAML: the key '{found[1]}' is not apart from its value, '{found[2]}'",
            where=f"{file}:{number + 1}:{found.start(1) + 1}",
            expected=f"a colon and a blank: `{found[1]}: {found[2]}`",
        )
    character = written[column : column + 1]
    # parts of a problem and of its context, what that means, and what would have been right
    faults = (
        ("',' or '}'", "", "the map that begins with '{{' in line {begin} goes on",
         "',' between its entries, '}' at its end"),
        ("',' or ']'", "", "the list that begins with '[' in line {begin} goes on",
         "',' between its entries, ']' at its end"),
        ("mapping values are not allowed", "", "a colon where no key can be",
         "`key: value` in a line of its own below a line that ends with ':', or quotes around a text with a colon"),
        ("end of stream", "quoted scalar", "the quote in line {begin} is not closed", "the same quote at its end"),
        ("expected key", "", "this does not belong to the map that begins in line {begin}",
         "a key in the column of the others, and nothing behind a value"),
        ("expected '-'", "", "this does not belong to the list that begins in line {begin}",
         "'-' in the column of the others"),
        ("alphabetic or numeric", "alias", "no name behind '*'", "the name of an anchor, or quotes around a text"),
        ("alphabetic or numeric", "anchor", "no name behind '&'", "letters and digits, or quotes around a text"),
        ("directive", "", "a line begins with '%'", "quotes around a text that begins with it"),
        ("cannot start any token", "", "a value begins with {character!r}", "quotes around it"),
        ("escape", "", "no such escape behind a backslash", "\\\\ for a backslash, or single quotes around the text"),
        ("<document start>", "", "there is text behind the end of the document", "one document in a file"),
        ("comment or line break", "", "there is text behind '|' or '>'", "the text in the lines below"),
        ("node content", "", "there is no value here", "a value between two commas"),
    )  # fmt: skip
    for problem, context, what, expected in faults:
        if problem in (error.problem or "") and context in (error.context or ""):
            return ConfigError(
                f"not YAML: {what.format(begin=begin, character=character)}", where=where, expected=expected
            )
    return ConfigError("not YAML: this cannot be read", where=where, expected="keys and values of YAML 1.2")


def _joined(lines: list[str], first: int, last: int) -> tuple[int, re.Match[str]] | None:
    """Find the first line with a key and a value that no colon and blank keeps apart, such as `speed 0.5`.

    Args:
        lines: The text.
        first: The first line to search, from zero on.
        last: The line behind the last one to search.

    Returns:
        Its number, from zero on, with the key and the value as groups; None: there is none.
    """
    for number in range(first, last):
        found = re.fullmatch(r" *(?:- +)?(\w+)(?::|:? +)([^\s:#]\S*(?: +[^\s:#]+)*) *(?:#.*)?", lines[number])
        if found is not None and not re.match(r" *(?:- +)?\w+: ", lines[number]):
            return number, found
    return None
