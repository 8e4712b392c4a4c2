"""The process of a real-time layer, and its simulator, stand still for a while: nothing moves without a command.

Each stop happens in a motion, joints at 0.5 rad/s and wheels at 1 rad/s. `breaking.bounds` has the limits.
"""

import pytest
from breaking.figures import rt_alone
from breaking.trial import Fault, Plan, Trial

pytestmark = pytest.mark.soak


@pytest.fixture(scope="module")
def layer(request, tmp_path_factory):
    """Run a plugin in the layer, `alone` or `watched` by a watchdog."""
    made = rt_alone(tmp_path_factory.mktemp("layer"), watchdog=request.param == "watched")
    try:
        made.start()
        yield made
    finally:
        made.close()


@pytest.mark.parametrize("layer", ["alone", "watched"], indirect=True)
@pytest.mark.parametrize("duration", [0.08, 0.35, 1.0, 3.0])
def test_the_layer_stands_still(layer, duration):
    assert not Trial(layer, Plan((Fault("stop", "xbot", duration),))).run().findings


@pytest.mark.parametrize("layer", ["alone"], indirect=True)
@pytest.mark.parametrize("duration", [0.2, 1.0, 3.0])
def test_the_simulator_stands_still(layer, duration):
    assert not Trial(layer, Plan((Fault("stop", "simulator", duration),))).run().findings
