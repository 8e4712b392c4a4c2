"""What ends a demonstration: an error that lasts, and a layer that has stopped the robot."""

from types import SimpleNamespace

import pytest

from solfer.demo.driving import FORGIVING, Complaints, RealTimeLost
from solfer.errors import MiddlewareError
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport
from solfer.transport.plugin_state import SAFE_STOP


def complaints_of(summary, times):
    """Make complaints of a node that is in error with a summary, looked at at some times [s]."""
    clock = iter(times)
    reports = {"hands": HealthReport(Health.ERROR, summary, {})}
    return Complaints(SimpleNamespace(now=lambda: next(clock), reports=lambda: reports))


@pytest.mark.parametrize(
    ("summary", "is_lost"), [(f"ABORTED: {SAFE_STOP}: 20 cycles too long", True), ("ABORTED: no joints", False)]
)
def test_an_error_that_lasts_ends_it(summary, is_lost):
    complaints = complaints_of(summary, (0.0, FORGIVING, FORGIVING + 0.1))
    complaints.check()
    complaints.check()
    with pytest.raises(MiddlewareError, match=summary) as caught:
        complaints.check()
    assert isinstance(caught.value, RealTimeLost) == is_lost
