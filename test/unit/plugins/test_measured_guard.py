"""Tests of what others see of a Robot after one of its components has failed."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from support.unit.contract import Contacts

from solfer.components import Component
from solfer.errors import NotFinite
from solfer.model.state import DEFAULTS
from solfer.plugins.measured_guard import MeasuredGuard


class Writing(Component):
    """Calls a function in its cycle."""

    def __init__(self, robot, write):
        super().__init__(robot)
        self.update = write


@pytest.fixture
def robot():
    return Contacts().standing()


@pytest.mark.parametrize("name", DEFAULTS)
def test_what_was_measured_comes_back(robot, name):
    guard, values = MeasuredGuard("owner", robot), robot.state[name]
    values[:] = np.arange(robot.size)
    with pytest.raises(NotFinite, match=f"'owner' writes a '{name}' of '{robot.dofs[1]}'"):
        guard.run(Writing(robot, partial(values.__setitem__, 1, np.nan)))
    assert_array_equal(values, np.arange(robot.size))
    guard.run(Writing(robot, partial(values.__setitem__, 1, 5.0)))
    assert values[1] == 5.0


def test_wrenches_of_contacts_come_back(robot):
    robot.contact_records = (1,)
    guard = MeasuredGuard("owner", robot)
    robot.contacts.wrenches[:] = 2.0
    with pytest.raises(NotFinite, match="'owner' writes a wrench of contact 'rear'"):
        guard.run(Writing(robot, partial(robot.contacts["rear"].wrench.__setitem__, 3, np.inf)))
    assert_array_equal(robot.contacts.wrenches, np.full((3, 6), 2.0))
