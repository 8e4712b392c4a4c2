"""The result of a run."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Result:
    """What became of a run.

    Attributes:
        failure: Why it failed; empty: it has not.
        measures: Numbers by the name of their measure; a run that failed may have all, some or none.
        time: Time of the robot's motion [s].
    """

    failure: str
    measures: Mapping[str, float] = field(default_factory=dict)
    time: float = 0.0

    @property
    def done(self) -> bool:
        """Whether the run came to its end."""
        return not self.failure

    def as_json(self) -> dict[str, Any]:
        """Return it for JSON, which has no NaN."""
        numbers = {name: value if math.isfinite(value) else str(value) for name, value in self.measures.items()}
        return {"failure": self.failure, "measures": numbers, "time": self.time}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "Result":
        """Read what `as_json` returned."""
        return cls(data["failure"], {name: float(value) for name, value in data["measures"].items()}, data["time"])
