"""The component `gravity_compensation` on CENTAURO, without any transport: torques, what others command, contacts."""

import numpy as np
import pytest
from support import robots
from support.allocations import check_that_it_keeps_no_memory

from solfer.components.gravity_compensation import GainsOfGroup, GravityCompensation, GravityTags
from solfer.errors import ComponentError, UnknownName
from solfer.interfaces.support import LiftContacts
from solfer.model import State

RATE = 200.0  # [Hz]


def centauro(**files):
    return robots.centauro("mammal_wide_straight", actuators=True, **files)


def started(**tags):
    component = GravityCompensation(centauro(), GravityTags(**{"track": "wheels", **tags}))
    component.set_rate(RATE)
    component.init()
    cycle(component)
    return component


def cycle(component, count=1):
    for _ in range(count):
        component.model.update()
        component.update()
        component.send()
    return component.model.command


def lifted(component, *contacts):
    return component.lift(LiftContacts(contacts)).success


def test_the_torques_carry_the_weight_on_wheels():
    component = started()
    robot = component.model
    robot.contacts.update()
    rows = np.vstack([contact.jacobian for contact in robot.contacts.group("wheels")])
    load = robot.dynamics.bias - robot.command.torque
    forces, residual = np.linalg.lstsq(rows.T, load, rcond=None)[:2]
    assert np.abs(rows.T @ forces - load).max() < 1e-9
    assert forces[2::3].sum() == pytest.approx(931.65, abs=0.01) and (forces[2::3] > 0.0).all()


def test_free_wheels_get_no_torque():
    component = started(free="wheels")
    wheels = component.model.selectors["wheels"].indices
    assert not component.model.command.torque[wheels].any()
    assert np.abs(started().model.command.torque[wheels]).min() > 1.0


def test_joints_that_nobody_moves_stay():
    component = started()
    robot = component.model
    assert np.array_equal(robot.command.position, robot.state.position)
    robot.state.position[10] += 0.1
    assert cycle(component).position[10] == pytest.approx(robot.state.position[10] - 0.1)
    component.init()  # a new start is where the robot is by then
    assert cycle(component).position[10] == robot.state.position[10]


def test_what_others_want_is_merged():
    """Different plugins write legs and arms; all other joints keep their measured position, also after a restart."""
    component = GravityCompensation(centauro(), GravityTags(track="wheels"))
    component.set_rate(RATE)
    robot = component.model
    legs, arms = (np.setdiff1d(robot.selectors[part].indices, range(6)) for part in ("legs", "arms"))
    robot.command.write("position", np.full(len(legs), 0.3), legs)
    robot.command.write("velocity", np.full(len(legs), 0.2), legs)
    component.init()
    robot.command.write("position", np.full(len(arms), 0.4), arms)
    command = cycle(component, 3)
    assert (command.position[legs] == 0.3).all() and (command.position[arms] == 0.4).all()
    assert (command.velocity[legs] == 0.2).all()
    rest = np.setdiff1d(np.arange(robot.size), [*legs, *arms])
    assert np.array_equal(command.position[rest], robot.state.position[rest])
    component.init()  # nobody has withdrawn anything
    assert (cycle(component).position[arms] == 0.4).all()


def test_torques_follow_the_state_alone():
    component = started()
    before = component.model.command.torque.copy()
    component.model.command.position[20] += 0.5
    assert np.array_equal(cycle(component).torque, before)
    component.model.state.position[20] += 0.5
    assert np.abs(cycle(component).torque - before).max() > 0.1


def test_gains_are_sent_where_they_are_configured():
    legs = GainsOfGroup(chain="legs", stiffness=300.0)
    one = GainsOfGroup(chain="front_left_leg", stiffness=100.0, damping=7.0)
    component = started(gains=(legs, one))
    robot, command = component.model, component.model.command
    first = robot.selectors["front_left_leg"].indices
    others = np.setdiff1d(robot.selectors["legs"].indices, first)
    assert (command["stiffness"][first] == 100.0).all() and (command["stiffness"][others] == 300.0).all()
    assert (command["damping"][first] == 7.0).all() and not command["damping"][others].any()
    assert "stiffness" not in started().model.command


def test_a_lifted_contact_changes_torques_smoothly():
    component = started(fade=0.5)
    before = component.model.command.torque.copy()
    assert lifted(component, "front_left_leg")
    path = np.array([cycle(component).torque.copy() for _ in range(round(0.5 * RATE) + 1)])
    after = started()
    lifted(after, "front_left_leg")
    goal = cycle(after, round(0.5 * RATE) + 1).torque
    assert np.abs(np.diff(path, axis=0)).max() < 2.1 * np.abs(goal - before).max() / (0.5 * RATE)
    assert np.abs(goal - before).max() > 1.0 and np.array_equal(path[-1], goal)
    component.lift(LiftContacts(("front_left_leg",), lifted=False))
    assert np.abs(cycle(component, round(0.5 * RATE) + 1).torque - before).max() < 1e-9


def test_all_contacts_are_lifted_at_once():
    component = started(fade=0.0)
    assert lifted(component)
    robot = component.model
    torque = cycle(component).torque
    assert np.abs((torque - robot.dynamics.bias)[robot.actuated]).max() < 1e-12
    assert robot.contacts["left_arm"].active  # it is not tracked


def test_a_contact_that_is_not_tracked_is_refused():
    component = started()
    with pytest.raises(UnknownName, match="front_left_leg"):
        component.lift(LiftContacts(("front_left_log",)))
    with pytest.raises(UnknownName, match="left_arm"):
        component.lift(LiftContacts(("rear_left_leg", "left_arm")))
    assert component.model.contacts["rear_left_leg"].active


def test_a_group_without_contacts_is_refused():
    for robot, group in ((centauro(contacts=False), "wheels"), (centauro(), "torso")):
        with pytest.raises(ComponentError, match=rf"no contact of '{group}' [^$]*contacts: {{read: true}}"):
            GravityCompensation(robot, GravityTags(track=group))


def test_nothing_carries_a_robot_without_contacts(caplog):
    component = GravityCompensation(centauro(contacts=False))
    component.init()
    torque, robot = cycle(component).torque, component.model
    assert "nothing carries its base" in caplog.text
    assert np.array_equal(torque[robot.actuated], robot.dynamics.bias[robot.actuated])


def test_offline_the_desired_state_is_carried():
    """The same numbers in the State, wherever they are from, give the same torques."""
    component, other = started(), started()
    desired = State(component.model.dofs)
    desired.position[:] = component.model.state.position
    desired.position[7] += 0.2
    for robot in (component.model, other.model):
        robot.state.write("position", desired.position)
    assert np.array_equal(cycle(component).torque, cycle(other).torque)


@pytest.mark.slow
def test_a_cycle_keeps_no_memory():
    component = started(free="wheels", gains=(GainsOfGroup(chain="legs", stiffness=300.0),))

    def once():
        component.update()
        component.send()

    check_that_it_keeps_no_memory(once)
