"""The prefix of a robot's frames on tf."""

from types import SimpleNamespace

import pytest
from tf2_msgs.msg import TFMessage

from solfer.errors import MiddlewareError, UnknownName
from solfer.middleware.ros.tf import pack, tf_prefix
from solfer.transport import BodyMessage


def parameters(**values):
    """Make a middleware with some parameters."""

    def parameter(name):
        if name not in values:
            raise UnknownName("parameter", name, values)
        return values[name]

    return SimpleNamespace(parameter=parameter)


def test_a_prefix_is_read_of_a_parameter():
    assert tf_prefix(parameters()) == "" and tf_prefix(parameters(tf_prefix="/red/")) == "red"
    with pytest.raises(MiddlewareError, match="'tf_prefix' is 3"):
        tf_prefix(parameters(tf_prefix=3))


@pytest.mark.parametrize("prefix, child", [("", "pelvis"), ("red", "red/pelvis")])
def test_the_frame_of_the_body_has_the_prefix(prefix, child):
    (placed,) = TFMessage().deserialize(pack(BodyMessage("world", "pelvis"), (1, 2), prefix)).transforms
    assert (placed.header.frame_id, placed.child_frame_id) == ("world", child)
