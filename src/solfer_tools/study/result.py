"""The result of a run."""

import math
import re
from dataclasses import field
from typing import Any

from pydantic.dataclasses import dataclass

FAULTS = ("SIGSEGV", "SIGBUS", "SIGFPE", "SIGILL", "SIGABRT", "SIGTRAP", "SIGSYS")
"""Signals of a fault of a run; others come from outside, and leave no result."""


@dataclass(frozen=True)
class Result:
    """What became of a run.

    Attributes:
        failure: Why it failed; empty: it has not.
        measures: Numbers by the name of their measure; a run that failed may have all, some or none.
        time: Time of the robot's motion [s].
    """

    failure: str
    measures: dict[str, float] = field(default_factory=dict)
    time: float = 0.0

    @property
    def done(self) -> bool:
        """Whether the run came to its end."""
        return not self.failure

    @property
    def is_interrupted(self) -> bool:
        """Whether an earlier version counted as a failure that the run was ended by a signal."""
        # what 0.2.0 wrote of runs that a signal from outside had ended
        text = rf"SystemExit: 143\b|KeyboardInterrupt\b|its process ended by signal (?!{'|'.join(FAULTS)}\b)"
        return re.match(text, self.failure) is not None

    def as_json(self) -> dict[str, Any]:
        """Return it for JSON, which has no NaN."""
        numbers = {name: value if math.isfinite(value) else str(value) for name, value in self.measures.items()}
        return {"failure": self.failure, "measures": numbers, "time": self.time}
