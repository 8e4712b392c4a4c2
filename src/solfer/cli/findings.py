"""Findings of a check, for readers and for programs."""

import re
from dataclasses import asdict, dataclass
from typing import Any

from solfer.config import CheckReport


@dataclass(frozen=True)
class Finding:
    """A mistake, a warning, or an information.

    Attributes:
        severity: 'error', 'warning' or 'info'.
        text: The whole finding, for a reader.
        file: The file, or another place such as a parameter; empty if there is none.
        line: Line, counted from one; None if there is none.
        column: Column, counted from one; None if there is none.
        path: Keys that lead to the value, such as `modules.joint_states.chain`; empty at the top of a file.
        message: What is wrong.
        expected: What would have been right; empty if the message contains it.
        names: The nearest valid names.
    """

    severity: str
    text: str
    file: str
    line: int | None
    column: int | None
    path: str
    message: str
    expected: str = ""
    names: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        return {key: value for key, value in asdict(self).items() if key != "text"}


def findings_of(report: CheckReport) -> list[Finding]:
    """Return all errors, then all warnings, then all else of a report, each ordered by file and line."""
    errors = (
        Finding("error", str(each), *_place(each.where), each.what, each.expected, each.names) for each in report.errors
    )
    notices = (
        Finding(each.severity, str(each), *_place(str(each.mark)), each.what)
        for each in (*report.warnings, *report.information)
    )
    return [*errors, *notices]


def summary(file: str, report: CheckReport) -> str:
    """Summarise a report in one line."""
    counts = [
        _counted(len(report.modules), "configuration"),
        _counted(len(report.errors), "error"),
        _counted(len(report.warnings), "warning"),
    ]
    return f"{file}: {', '.join(counts)}"


def _place(where: str) -> tuple[str, int | None, int | None, str]:
    match = re.fullmatch(r"(?P<file>.*?):(?P<line>\d+):(?P<column>\d+)(?:: (?P<path>.*))?", where, re.DOTALL)
    if match is None:
        return where, None, None, ""
    return match["file"], int(match["line"]), int(match["column"]), match["path"] or ""


def _counted(count: int, noun: str) -> str:
    return f"{count or 'no'} {noun}{'' if count == 1 else 's'}"
