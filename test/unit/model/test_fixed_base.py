"""Robots whose base nobody has decided about."""

import pytest

from solfer.model.urdf.description import Description
from solfer.model.urdf.fixed_base import warn_of_fixed_base

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def legged(root="base", kind="fixed"):
    """Make a robot with a trunk behind a link without mass."""
    return Description.from_text(
        f'<robot name="r"><link name="{root}"/><link name="trunk">{INERTIAL}</link><link name="leg"/>'
        f'<joint name="j" type="{kind}"><parent link="{root}"/><child link="trunk"/></joint>'
        '<joint name="hip" type="continuous"><parent link="trunk"/><child link="leg"/></joint></robot>',
        "r.urdf",
    )


def test_a_base_that_is_held_is_reported(caplog):
    warn_of_fixed_base(legged(), None)
    (message,) = caplog.messages
    assert "r.urdf: the base, link 'base', is fixed" in message and "`floating_base: true` lets it float" in message


@pytest.mark.parametrize(
    "description, floating_base",
    [
        (legged(), True),
        (legged(), False),
        (legged("world"), None),
        (legged(kind="floating"), None),
        (legged(kind="continuous"), None),
    ],
)
def test_nothing_is_reported_where_the_user_decided(description, floating_base, caplog):
    warn_of_fixed_base(description, floating_base)
    assert not caplog.messages
