"""Controllers together make the lower level of a robot."""

import numpy as np
import pytest
from support.unit.cart import GAINS, GROUPS, URDF

from solfer.errors import ModelError, UnknownName
from solfer.lower_level import JointControllerRecord, build_lower_level
from solfer.lower_level.server.services import controller_services
from solfer.model import Description, Kinematics
from solfer.transport.messages import JointMessage
from solfer.transport.middleware import NoFields


@pytest.fixture(scope="module")
def kinematics():
    """Make the kinematics of a floating cart with an arm and a wheel."""
    return Kinematics(Description.from_text(URDF))


@pytest.fixture
def records():
    """Return records of the arm on springs and the wheel on a motor."""
    return {
        "arm": JointControllerRecord(type="impedance", **{"except": "wheels"}),
        "wheel": JointControllerRecord(type="velocity", group="wheels"),
    }


@pytest.fixture
def lower_level(kinematics, records):
    """Make a lower level with both controllers at rest."""
    return build_lower_level(kinematics, records, GROUPS, GAINS)


def test_commands_reach_their_controller(kinematics, lower_level):
    q, v = np.zeros(8), np.zeros(8)
    lower_level.start(q)
    lower_level.accept("arm", JointMessage(("shoulder",), effort=np.array([7.0])))
    lower_level.accept("wheel", JointMessage(("roll",), velocity=np.array([-4.0])))
    torque, speed = lower_level.update(q, v, 0.001)
    expected = np.zeros(8)
    expected[kinematics.dofs.index("shoulder")] = 7.0
    np.testing.assert_allclose(torque, expected, atol=0.1)  # the damper answers to the motion that 7 Nm will cause
    assert torque[kinematics.dofs.index("roll")] == 0.0
    np.testing.assert_array_equal(speed, [-4.0])
    assert [kinematics.dofs[dof] for dof in lower_level.drives.speed_dofs] == ["roll"]


def test_start_forgets_commands(lower_level):
    lower_level.accept("arm", JointMessage(("shoulder",), effort=np.array([7.0]), stiffness=np.array([1.0])))
    lower_level.accept("wheel", JointMessage(("roll",), velocity=np.array([-4.0])))
    q = np.linspace(0.0, 0.7, 8)
    lower_level.start(q)
    _, speed = lower_level.update(q, np.zeros(8), 0.001)
    arm = lower_level.controller("arm")
    assert (arm.target[0], arm.effort[0], arm.stiffness[0], speed[0]) == (q[arm.dofs[0]], 0.0, 200.0, 0.0)


def test_an_unknown_controller_suggests_the_nearest(lower_level):
    with pytest.raises(UnknownName, match="unknown controller 'wheels'") as error:
        lower_level.accept("wheels", JointMessage(("roll",), velocity=np.zeros(1)))
    assert error.value.names == ("wheel",)


def test_every_joint_belongs_to_exactly_one_controller(kinematics, records):
    with pytest.raises(ModelError, match="joint 'roll' is in the controllers arm and wheel"):
        everything = records | {"arm": JointControllerRecord(type="impedance")}
        build_lower_level(kinematics, everything, GROUPS)
    with pytest.raises(ModelError, match="joints without a controller: shoulder"):
        build_lower_level(kinematics, {"wheel": records["wheel"]}, GROUPS)


def test_records_that_do_not_fit_the_robot(kinematics, records):
    with pytest.raises(UnknownName, match="unknown group 'wheel'"):
        build_lower_level(kinematics, {"wheel": JointControllerRecord(type="velocity", group="wheel")}, GROUPS)
    with pytest.raises(ModelError, match="controller 'wheel' has no joint that moves"):
        build_lower_level(kinematics, {"wheel": JointControllerRecord(type="velocity", group="nothing")}, GROUPS)
    with pytest.raises(ModelError, match="no gains for the joints shoulder of controller 'arm'"):
        build_lower_level(kinematics, records, GROUPS, {})


def test_a_robot_without_records_is_held_by_springs(kinematics):
    lower_level = build_lower_level(kinematics, {}, {})
    controller = lower_level.controller("joints")
    assert controller.joints == ("shoulder", "roll") or controller.joints == ("roll", "shoulder")
    assert (controller.stiffness > 0.0).all() and (controller.damping > 0.0).all()


def test_a_service_names_the_joints_of_a_controller(lower_level):
    service, *_ = controller_services(lower_level.controller("arm"), lower_level.folders)
    assert (service.name, service.interface) == ("get_joint_names", "solfer/GetJointNames")
    assert service.handler(NoFields()) == service.reply(success=True, message="", names=("shoulder",))
