"""A component with live parameters of all kinds."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from support.recording.sine import Sine

from solfer.components import LiveParameter
from solfer.config import LIVE, Record
from solfer.errors import SizeMismatch

Weight = Annotated[float, Field(ge=0.0, le=10.0)]


class PartRecord(Record):
    """What has a name of its own."""

    weight: Weight | tuple[Weight, ...] = Field(
        default=1.0, **LIVE, description="weight of both joints [Nm], or of each"
    )


class Tuned(Sine):
    """The sine with a gain and more, which can be changed."""

    class Tags(Record):
        """Tags of the component."""

        gain: float = Field(default=0.3, gt=0.0, le=2.0, **LIVE, description="gain of what joints miss [1/s]")
        least: float = Field(default=0.0, **LIVE, description="least number")
        most: float = Field(default=5.0, **LIVE, description="largest number")
        law: Literal["sine", "line"] = Field(default="sine", **LIVE, description="how it moves")
        size: int = Field(default=3, ge=1, description="a number that is not live")
        limit: Annotated[float, Field(gt=0.0)] | None = Field(
            default=None, **LIVE, description="a limit; left out: none"
        )
        parts: dict[str, PartRecord] = Field(default_factory=dict, description="parts by name")

        @model_validator(mode="after")
        def _ordered(self) -> "Tuned.Tags":
            if self.least > self.most:
                raise ValueError("'least' is above 'most'")
            return self

    def __init__(self, robot, tags, name=""):
        super().__init__(robot, tags, name)
        self.gain, self.limit, self.taken = tags.gain, np.inf, []
        self.weights = {part: np.ones(2) for part in tags.parts}

    def live_parameters(self):
        yield LiveParameter(("gain",), self._take_gain, lambda tags: tags.gain)
        yield LiveParameter(("limit",), self._take_limit, lambda tags: tags.limit or np.inf)
        for key in ("least", "most", "law"):
            yield LiveParameter((key,), self.taken.append)
        for part, weights in self.weights.items():
            yield LiveParameter(
                ("parts", part, "weight"), self._writing(weights), lambda tags, part=part: of(tags, part)
            )

    def _take_gain(self, gain):
        self.gain = float(gain)

    def _take_limit(self, limit):
        self.limit = float(limit)

    @staticmethod
    def _writing(weights):
        return lambda numbers: np.copyto(weights, numbers)


def of(tags, part):
    """Return the weights of a part, shape (2,)."""
    weight = np.array(tags.parts[part].weight)
    if weight.shape not in ((), (2,)):
        raise SizeMismatch(f"{weight.size} weights", expected="one, or two")
    return np.full(2, weight)
