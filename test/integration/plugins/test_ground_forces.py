"""Ground forces of the shipped configurations, beside PyBullet's; longer: benchmark/forces.py."""

from contextlib import closing

import numpy as np
import pytest
from support.estimation import part
from support.integration.world import World

from solfer.middleware.memory import MemoryMiddleware
from solfer.transport.messages import JointMessage

forces = part("estimation_cases.forces")
WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")


@pytest.mark.soak
def test_lifts_and_a_push_are_seen():
    """PyBullet's contacts check the estimate: contact changes, forces within 2 % of the weight, a push.

    The lifted leg's torque offsets are learnt on the way.
    """
    with closing(forces.ForcesWorld(seed=11)) as made:
        begin = len(made.rows)
        legs = forces.Legs(made)
        tilt = np.array((0.0, 0.07, 0.0))
        tilted = sum((legs.reach(each, tilt) for each in forces.LEGS), ())
        made.run(made.move(joints=sum(legs.joints, ()), positions=tilted, speed=0.5) + 0.3)
        for height in (0.05, 0.0):
            goal = legs.reach(3, tilt + (0.0, 0.0, height))
            made.run(made.move(joints=legs.joints[2], positions=goal, speed=0.4) + 0.5)
        pushes = forces.push(made, 1, np.random.default_rng(11))
        figures = forces.figures(made, begin, pushes)
        assert figures["changes"] >= 2 and figures["contact_right"] > 99.5
        assert figures["wheel_rms"] < 2.0 and figures["sum_rms"] < 2.0
        assert figures["push_error_worst"] < 20.0 and figures["push_20ms_least"] > 20.0
        component, true = made.forces.component, made.simulation.sensors["joints"]._offset
        names, offsets = made.simulation.state.joints, component.law.offsets.value
        lifted = [names.index(f"{joint}_3") for joint in ("hip_yaw", "hip_pitch", "knee_pitch", "ankle_pitch")]
        dofs = [component.model.dof(names[index]) for index in lifted]
        np.testing.assert_allclose(offsets[dofs], true[lifted], atol=0.6)


def test_commanded_efforts_make_gravity_forces():
    """Forces from the commanded efforts match PyBullet's at full share, and change when the command is halved."""
    with closing(World()) as world:
        world.run(1.0)
        odometry = world.plugin("odometry", target="solfer.components.odometry:Odometry")
        world.run(0.5)
        now = world.simulation.state.now
        writer = MemoryMiddleware(world.bus, "carrier").writer("desired_state", "solfer/JointCommand")
        dofs = odometry.robot.dofs[:6] + world.simulation.state.joints
        writer.write(JointMessage(dofs, effort=np.zeros(len(dofs))))  # the plugin learns the order of it
        plugin = world.plugin("gravity_forces", target="solfer.components.ground_forces:GroundForces")

        def send(share):
            efforts = np.r_[np.zeros(6), share * world.simulation.state.of_joints(now.torque)]
            for _ in range(20):
                writer.write(JointMessage(dofs, effort=efforts.copy()))
                world.run(0.005)
            return np.array([contact.force[2] for contact in plugin.component.contacts])

        weight = 9.81 * plugin.robot.kinematics.mass
        true = np.array([world.simulation.contacts()[wheel][2] for wheel in WHEELS])
        carried = send(1.0)
        np.testing.assert_allclose(carried, true, atol=0.02 * weight)
        assert abs(carried.sum() - weight) < 0.01 * weight
        assert abs(send(0.5) - carried).max() > 0.02 * weight  # it listens to what is commanded


@pytest.mark.soak
def test_a_gap_and_a_reset_leave_nothing_behind():
    """The sum of forces is the robot's weight again after silence, after a reset, and after a message full of NaN."""
    with closing(World()) as world:
        world.run(1.0)
        world.plugin("odometry", target="solfer.components.odometry:Odometry")
        world.run(0.5)
        plugin = world.plugin("ground_forces", target="solfer.components.ground_forces:GroundForces")
        weight = 9.81 * plugin.robot.kinematics.mass

        def stands():
            world.run(1.5)
            forces = np.array([contact.force[2] for contact in plugin.component.contacts])
            return plugin.running and abs(forces.sum() - weight) < 0.02 * weight and (forces > 100.0).all()

        assert stands()
        world.received = False
        world.run(0.8)
        assert not plugin.running and not any(contact.wrench.any() for contact in plugin.component.contacts)
        world.received = True
        assert stands()
        world.simulation.reset()
        assert stands()
        rogue = MemoryMiddleware(world.bus, "rogue").writer("joint_states", "sensor_msgs/JointState")
        joints = world.simulation.state.joints
        wrong = np.full(len(joints), np.nan)
        rogue.write(JointMessage(joints, position=wrong, velocity=wrong.copy(), effort=wrong.copy()))
        assert stands() and np.isfinite(plugin.component.law.offsets.value).all()
