"""Links and joints with which a robot cannot work."""

import pytest

from solfer.errors import ModelError
from solfer.model.urdf.description import Description
from solfer.model.urdf.unfit import check_masses, warn_of_unfit

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def chain(joints, heavy=()):
    """Make a chain of links l0, l1, ... behind joints with these attributes of limits, or of the type `fixed`."""
    links = "".join(f'<link name="l{i}">{INERTIAL if i in heavy else ""}</link>' for i in range(len(joints) + 1))
    made = "".join(
        f'<joint name="j{i}" type="{"fixed" if limit == "fixed" else "revolute"}"><parent link="l{i}"/>'
        f'<child link="l{i + 1}"/><limit {"" if limit == "fixed" else limit}/></joint>'
        for i, limit in enumerate(joints)
    ).replace("<limit />", "")
    return Description.from_text(f'<robot name="r">{links}{made}</robot>', "r.urdf")


def limit(lower=-1, upper=1, effort=5, velocity=2):
    return f'lower="{lower}" upper="{upper}" effort="{effort}" velocity="{velocity}"'


def test_joints_that_cannot_move_are_named_in_one_message(caplog):
    warn_of_unfit(
        chain([limit(effort=0), limit(velocity=0, effort=0), limit(lower=0.5, upper=0.5), limit()], heavy=(1, 2, 3, 4)),
        False,
    )
    (message,) = caplog.messages
    assert "effort limit 0, so that nothing holds them: j0, j1;" in message
    assert "velocity limit 0, so that nothing may move them: j1;" in message
    assert "locked: j2;" in message and "j3" not in message


def test_joints_with_limits_are_not_named(caplog):
    warn_of_unfit(chain([limit(), "fixed"], heavy=(1,)), False)
    assert not caplog.messages


def test_links_without_mass_are_one_warning(caplog):
    warn_of_unfit(chain([limit(velocity=0), limit(), limit()], heavy=(2,)), False)
    assert caplog.messages == [
        "r.urdf: joints with velocity limit 0, so that nothing may move them: j0; correct their <limit>; "
        "links that move without mass: l1, l3; give each an <inertial>"
    ]


@pytest.mark.parametrize(
    "joints, heavy, floating, named",
    [
        ([limit()] * 3, (), False, "l1, l2, l3"),
        ([limit()] * 3, (3,), True, "l0, l1, l2"),
        ([limit(), "fixed", limit()], (2,), False, "l3"),
        ([limit(), "fixed", limit()], (2, 3), True, "l0"),
    ],
)
def test_links_that_move_without_mass_are_named(joints, heavy, floating, named):
    with pytest.raises(ModelError, match="links move and have no mass: " + named) as caught:
        check_masses(chain(joints, heavy), floating)
    assert caught.value.where == "r.urdf"


@pytest.mark.parametrize("joints, heavy, floating", [([limit(), "fixed"], (2,), False), (["fixed"], (1,), True)])
def test_links_that_are_fixed_to_a_mass_need_none(joints, heavy, floating):
    check_masses(chain(joints, heavy), floating)
