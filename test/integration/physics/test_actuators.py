"""What the file of the actuators changes in the simulator: friction, limits, joints without a drive."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pybullet_data
import pytest
from numpy.testing import assert_allclose
from scipy.constants import g

from solfer.errors import CommandRefused, ModelError
from solfer.simulation import Simulation
from solfer.simulation.physics import STEP
from solfer.transport.messages import JointMessage

LINK = """<link name="{name}"><inertial><mass value="2"/>
  <inertia ixx="0.5" iyy="0.5" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>
  <axis xyz="{axis}"/><limit velocity="1000" effort="40"/></joint>"""
TURNTABLE = (
    '<robot name="table"><link name="world"/>'
    + LINK.format(name="disc")
    + LINK.format(name="wheel")
    + JOINT.format(name="turn", parent="world", child="disc", axis="0 0 1")
    + JOINT.format(name="roll", parent="world", child="wheel", axis="0 1 0")
    + "</robot>"
)
"""A disc about a vertical axle on a spring, and a wheel on a motor: 0.5 kg m^2 each, and no weight to carry."""

SPRING = "type: SEA, Ks: 1000, D: 20, phi: 0.1"
INERTIA = 0.5  # [kg m^2]
ROLL, TURN = 0, 1
"""DoFs of the joints."""
BOTH = INERTIA + 0.1  # of link and rotor [kg m^2]

CONTROLLERS = "spring: {type: impedance, except: wheels}, motor: {type: velocity, group: wheels, timeout: 60.0}"


def simulate(folder, actuators, urdf=TURNTABLE, controllers=CONTROLLERS):
    """Make the turntable with these actuators; its spring has no gains of its own."""
    (folder / "table.urdf").write_text(urdf)
    (folder / "table.srdf").write_text('<robot name="table"><group name="wheels"><joint name="roll"/></group></robot>')
    (folder / "gains.yaml").write_text("table: {gains: {turn: {stiffness: 0.0, damping: 0.0}}}")
    (folder / "actuators.yaml").write_text(f"table: {{actuators: {{{actuators}}}}}")
    (folder / "robot.yaml").write_text(
        "{name: table, urdf: table.urdf, srdf: table.srdf, gains: gains.yaml, actuators: actuators.yaml,\n"
        f"lower_level: {{overspeed: 0}}, controllers: {{{controllers}}}}}"
    )
    return closing(Simulation.from_file(folder / "robot.yaml"))


def run(simulation, steps, turn=None, roll=None):
    """Command a torque and a speed, and step; return the last speeds of disc and wheel."""
    for _ in range(steps):
        if turn is not None:
            simulation.lower_level.accept("spring", JointMessage(("turn",), effort=np.array([turn])))
        if roll is not None:
            simulation.lower_level.accept("motor", JointMessage(("roll",), velocity=np.array([roll])))
        simulation.step()
    return simulation.v.copy()


def both(damping, limit=30.0):
    """Give both joints an actuator."""
    values = f"{{{SPRING}, B: {damping}, Torque_limit: {limit}}}"
    return f"turn: {values}, roll: {values}"


@pytest.mark.parametrize("damping", [0.0, 2.0])
def test_motor_damping_slows_a_joint(tmp_path, damping):
    with simulate(tmp_path, both(damping)) as simulation:
        run(simulation, 100, turn=3.0)  # springs and feed-forward torques come up smoothly
        before, steps = simulation.v[TURN], 400
        after = run(simulation, steps, turn=3.0)[TURN]
    kept = (1.0 + STEP * damping / BOTH) ** -steps
    gained = 3.0 * (steps * STEP / BOTH if damping == 0.0 else (1.0 - kept) / damping)
    assert after == pytest.approx(kept * before + gained, rel=5e-3)


def test_a_motor_holds_its_speed_against_friction(tmp_path):
    with simulate(tmp_path, both(2.0, limit=10.0)) as simulation:
        assert run(simulation, 1500, roll=4.0)[ROLL] == pytest.approx(4.0, rel=1e-3)
        assert simulation.torque[ROLL] == pytest.approx(0.0, abs=0.05)  # friction leaves nothing for the wheel
        # 10 Nm overcome 2 Nms/rad up to 5 rad/s
        assert run(simulation, 3000, roll=20.0)[ROLL] == pytest.approx(5.0, rel=1e-2)


def test_the_torque_limit_bounds_the_drive(tmp_path):
    with simulate(tmp_path, both(0.0, limit=2.0)) as simulation:
        with pytest.raises(CommandRefused, match="effort 3 of joint 'turn' is beyond its limit"):
            run(simulation, 1, turn=3.0)
        run(simulation, 200, turn=2.0)
        assert simulation.lower_level.drives.two_mass.drive[TURN] == pytest.approx(2.0, rel=1e-6)
        before, after = simulation.v[ROLL], run(simulation, 100, roll=100.0)[ROLL]
        assert simulation.lower_level.drives.two_mass.drive[ROLL] == 2.0
        assert after - before == pytest.approx(0.1 * 2.0 / BOTH, rel=0.1)


def test_a_step_follows_any_friction(tmp_path):
    with simulate(tmp_path, both(1e4)) as simulation:
        speeds = [run(simulation, 1, turn=30.0)[TURN] for _ in range(300)]
    assert 0.0 < np.mean(speeds[200:]) < 0.01 and np.abs(speeds).max() < 0.2


@pytest.mark.parametrize("actuators", ["roll: {type: UNACTUATED}, ", ""], ids=["named", "left out"])
def test_a_joint_without_a_drive_swings_freely(tmp_path, actuators):
    actuators += f"turn: {{{SPRING}, B: 0, Torque_limit: 30}}"
    beside = TURNTABLE.replace('"wheel"><inertial>', '"wheel"><inertial><origin xyz="0.5 0 0"/>')
    with simulate(tmp_path, actuators, beside, "spring: {type: impedance}") as simulation:
        for _ in range(20):
            simulation.step()
        falls = 0.02 * 2.0 * g * 0.5 / (INERTIA + 2.0 * 0.5**2)
        assert simulation.v[ROLL] == pytest.approx(falls, rel=1e-2)
        assert_allclose(simulation.torque, 0.0, atol=1e-9)
        command = JointMessage(("turn", "roll"), effort=np.zeros(2), sender="walk")
        with pytest.raises(CommandRefused, match="joint 'roll' has no drive") as error:
            simulation.lower_level.accept("spring", command)
        assert "command of 'walk'" in str(error.value)


def test_controllers_need_joints_with_a_drive(tmp_path):
    spring = f"turn: {{{SPRING}, B: 0, Torque_limit: 30}}"
    with pytest.raises(ModelError, match=r"robot.yaml:\d+.*controller 'motor' has no joint that moves"):
        simulate(tmp_path, spring)
    with pytest.raises(ModelError, match="no joint has a drive"):
        simulate(tmp_path, "roll: {type: UNACTUATED}")


@pytest.mark.parametrize("stiffness", [6000, 20000, 80000])
def test_a_joint_swings_as_two_masses(tmp_path, stiffness):
    """The spring is let go; frequency and damping are those of theory, and the same again after a reset."""
    mobility = 1.0 / INERTIA + 1.0 / 1.3
    natural = np.sqrt(stiffness * mobility)
    damping = 2.0 * 0.02 * natural / mobility
    values = f"{{type: SEA, Ks: {stiffness}, D: {damping}, phi: 1.3, B: 0, Torque_limit: 30}}"
    with simulate(tmp_path, f"turn: {values}, roll: {values}") as simulation:
        runs = [_swing(simulation) for _ in range(2)]
    np.testing.assert_array_equal(*runs)
    one, two, three = runs[0][:-2], runs[0][1:-1], runs[0][2:]
    factors = np.linalg.lstsq(np.column_stack((two, one)), three, rcond=None)[0]
    pole = np.log(np.roots([1.0, -factors[0], -factors[1]])[0] + 0j) / STEP
    assert abs(pole) == pytest.approx(natural, rel=0.01)
    assert -pole.real / abs(pole) == pytest.approx(0.02, rel=0.05)


def _swing(simulation):
    """Stretch the spring of the disc, and return how it is stretched at each step."""
    simulation.reset()
    motors = simulation.lower_level.drives.two_mass
    motors.motor_position[TURN] += 0.001
    stretched = []
    for _ in range(100):
        simulation.step()
        stretched.append(motors.motor_position[TURN] - simulation.q[TURN])
    return np.array(stretched)


KUKA = Path(pybullet_data.getDataPath()) / "kuka_iiwa/model.urdf"
SOFT, STIFF = 3000.0, 1e5  # [Nm/rad]
BENT = {"lbr_iiwa_joint_2": 0.8, "lbr_iiwa_joint_4": -1.2}  # [rad]


def bent_arm(folder, actuators=""):
    """Make another robot, bent so that it has a weight to carry."""
    state = "".join(f'<joint name="{name}" value="{value}"/>' for name, value in BENT.items())
    group = "".join(f'<joint name="{name}"/>' for name in BENT)
    (folder / "arm.srdf").write_text(
        f'<robot name="arm"><group name="bent">{group}</group>'
        f'<group_state name="bent" group="bent">{state}</group_state></robot>'
    )
    (folder / "robot.yaml").write_text(f"{{name: arm, urdf: '{KUKA}', srdf: arm.srdf{actuators}}}")
    return closing(Simulation.from_file(folder / "robot.yaml"))


def test_springs_of_another_robot_give_way(tmp_path):
    """Not CENTAURO's alone: each soft joint of an iiwa sags by torque / stiffness, compared to a rigid arm."""
    springs = {f"lbr_iiwa_joint_{joint}": STIFF if joint == 4 else SOFT for joint in range(1, 8)}
    lines = ", ".join(
        f"{name}: {{type: SEA, Ks: {ks}, D: 2, phi: 0.1, B: 1, Torque_limit: 300}}" for name, ks in springs.items()
    )
    (tmp_path / "actuators.yaml").write_text(f"arm: {{actuators: {{{lines}}}}}")
    with bent_arm(tmp_path, ", actuators: actuators.yaml") as arm, bent_arm(tmp_path) as rigid:
        two_mass = arm.lower_level.drives.two_mass.springs.two_mass
        assert two_mass[[1, 3]].tolist() == [True, False]
        for _ in range(2500):
            arm.step()
            rigid.step()
        motors, joints = arm.sensors["motors"].measure(), arm.sensors["joints"].measure()
        torque, stiffness = arm.torque, np.array([springs[name] for name in arm.body.joints])
        assert np.abs(torque[[1, 3]]).min() > 5.0
        assert_allclose(stiffness * (motors.position - joints.position), torque, rtol=0.02, atol=0.02)
        soft = stiffness == SOFT
        assert_allclose((stiffness * (rigid.q - arm.q))[soft], torque[soft], rtol=0.05, atol=0.1)
