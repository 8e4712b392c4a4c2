"""Tags of low-pass filters that components run on what they measure."""

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Literal

import numpy as np
from pydantic import Field

from solfer.config import LIVE, Record
from solfer.interfaces.declaration import LiveParameter
from solfer.numerics.filters import LowPass


class FilterTags(Record):
    """A second-order low-pass filter, at the rate of the plugin."""

    cut_off_frequency: float = Field(ge=1e-3, le=2000.0, **LIVE, description="cut-off frequency, in `unit`")
    damping: float = Field(default=1.0, ge=1e-3, le=1000.0, **LIVE, description="damping ratio")
    unit: Literal["rad/s", "Hz"] = Field(default="rad/s", description="unit of the cut-off frequency")

    @property
    def hertz(self) -> float:
        """Cut-off frequency [Hz]."""
        return self.cut_off_frequency / (1.0 if self.unit == "Hz" else 2.0 * math.pi)

    def low_pass(self, size: int, rate: float) -> LowPass:
        """Make the filter of `size` numbers that arrive at `rate` [Hz].

        Raises:
            ConfigError: The cut-off is not below half of the rate.
        """
        return LowPass(size, self.hertz, self.damping, rate=rate, where=self.where("cut_off_frequency"))


def live_filter(
    path: tuple[str, ...], low_pass: LowPass | None, make: Callable[[Any], LowPass]
) -> Iterator[LiveParameter]:
    """Yield the parameters of a filter, which go over smoothly.

    Args:
        path: Where its `FilterTags` are.
        low_pass: The filter; None: there is none, and then nothing is yielded.
        make: Makes the filter of the component's tags.
    """
    if low_pass is not None:
        write = partial(np.copyto, low_pass.factors)
        for key in ("cut_off_frequency", "damping"):
            yield LiveParameter((*path, key), write, lambda tags: make(tags).factors)
