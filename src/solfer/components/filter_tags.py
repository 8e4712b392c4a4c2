"""Tags of low-pass filters that components run on what they measure."""

import math
from typing import Literal

from pydantic import Field

from solfer.config import Record
from solfer.numerics.filters import LowPass


class FilterTags(Record):
    """A second-order low-pass filter, at the rate of the plugin."""

    cut_off_frequency: float = Field(ge=1e-3, le=2000.0, description="cut-off frequency, in `unit`")
    damping: float = Field(default=1.0, ge=1e-3, le=1000.0, description="damping ratio")
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
        return LowPass(size, self.hertz, self.damping, rate, self.where("cut_off_frequency"))
