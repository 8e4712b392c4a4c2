"""The check of the measurement with which a plugin would start."""

import numpy as np
import pytest
from pydantic import ValidationError
from support.unit.joint_pipes import received
from support.unit.watch import Stage

from solfer.errors import OutOfLimits
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState, run
from solfer.transport import JointMessage

MEASURED = {"function": "state", "interface": {"position": True, "velocity": True, "effort": True}}


def stage(**tolerance):
    """Make a plugin whose pipe `joints` is checked at the start."""
    return Stage(**MEASURED, initialize=False, limits={"tolerance": tolerance})


def publish(stage, position=0.0, velocity=0.0, effort=0.0):
    """Publish one measurement, in which the shoulder alone may be anywhere."""
    numbers = {"position": position, "velocity": velocity, "effort": effort}
    one = np.array([name == "shoulder" for name in stage.names], dtype=float)
    message = JointMessage(stage.names, **{name: number * one for name, number in numbers.items()})
    MemoryMiddleware(stage.bus, "speaker").writer("joints", "solfer/JointCommand").write(message)


@pytest.mark.slow
@pytest.mark.parametrize(
    "values, message, allowed",
    [
        (
            {"position": 2.3},
            r"first position of joint 'shoulder' is 2\.300 rad, beyond its upper limit 2\.000",
            "0.087",
        ),
        ({"position": -2.3}, r"'shoulder' is -2\.300 rad, beyond its lower limit -2\.000 rad", "0.087"),
        (
            {"velocity": 3.1},
            r"first velocity of joint 'shoulder' is 3\.100 rad/s, beyond its upper limit 3\.000",
            "0.0",
        ),
        (
            {"effort": -48.0},
            r"first effort of joint 'shoulder' is -48\.000 Nm, beyond its lower limit -40\.000 Nm",
            "7.0",
        ),
    ],
)
def test_start_outside_of_limits_is_refused(values, message, allowed):
    made = stage(position=5, torque=7.0)
    publish(made, **values)
    with pytest.raises(OutOfLimits, match=message) as caught:
        run(made.plugin, made.middleware)
    assert f"at most {allowed}" in caught.value.expected
    assert made.component.inits == 0 and not made.sent.drain()


@pytest.mark.slow
@pytest.mark.parametrize("values", [{"position": 2.08}, {"position": -2.08}, {"velocity": 3.0}, {"effort": 46.9}])
def test_tolerances_widen_the_limits(values):
    made = stage(position=5, torque=7.0)
    publish(made, **values)
    made.cycles(1)
    assert made.plugin.life is PluginState.RUNNING


def test_later_measurements_are_not_checked():
    made = stage()
    publish(made)
    made.cycles(1)
    publish(made, position=2.3)
    made.cycles(1)
    assert made.plugin.life is PluginState.RUNNING


def test_each_start_is_checked():
    made = stage()
    publish(made)
    made.cycles(1)
    made.plugin.stop()
    made.plugin.restart()
    publish(made, position=2.3)
    with pytest.raises(OutOfLimits):
        made.cycles(1)


def test_plugins_wait_for_what_is_checked():
    made = stage()
    made.cycles(3)
    assert made.plugin.life is PluginState.STARTING


@pytest.mark.parametrize("changes", [{"function": "reference"}, {"space": "OPERATIONAL", "function": "state"}])
def test_only_measured_joints_have_limits(changes):
    with pytest.raises(ValidationError, match="'limits' are for measured joints"):
        received(limits={}, **changes)
