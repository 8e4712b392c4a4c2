"""What ends a demonstration: an error that lasts, and a layer that has stopped the robot."""

from types import SimpleNamespace

import pytest

from solfer.errors import MiddlewareError
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport
from solfer.transport.plugin_state import SAFE_STOP
from solfer_tools.demo.driving import ErrorWatch, RealTimeLost


def watch_of(summary, times):
    """Watch a node that is in error with a summary, looked at at some times [s]."""
    clock = iter(times)
    reports = {"hands": HealthReport(Health.ERROR, summary, {})}
    return ErrorWatch(SimpleNamespace(now=lambda: next(clock), reports=lambda: reports))


@pytest.mark.parametrize(
    ("summary", "is_lost"), [(f"ABORTED: {SAFE_STOP}: 20 long cycles", True), ("ABORTED: no joints", False)]
)
def test_an_error_that_lasts_ends_it(summary, is_lost):
    watch = watch_of(summary, (0.0, 5.0, 5.1))
    watch.check()
    watch.check()
    with pytest.raises(MiddlewareError, match=summary) as caught:
        watch.check()
    assert isinstance(caught.value, RealTimeLost) == is_lost
