"""Tests of what others see of a Robot after one of its components has failed."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from support.unit.contract import Contacts

from solfer.errors import NotFinite
from solfer.model.state import DEFAULTS
from solfer.plugins.measured_guard import MeasuredGuard


@pytest.fixture
def robot():
    return Contacts().standing()


@pytest.mark.parametrize("name", DEFAULTS)
def test_what_was_measured_comes_back(robot, name):
    guard, values = MeasuredGuard("owner", robot), robot.state[name]
    values[:] = np.arange(robot.size)
    guard.keep()
    values[1] = np.nan
    with pytest.raises(NotFinite, match=f"'owner' writes a '{name}' of '{robot.dofs[1]}'"):
        guard.check()
    guard.restore()
    assert_array_equal(values, np.arange(robot.size))
    guard.check()


def test_wrenches_of_contacts_come_back(robot):
    robot.contact_records = (1,)
    guard = MeasuredGuard("owner", robot)
    robot.contacts.wrenches[:] = 2.0
    guard.keep()
    robot.contacts["rear"].wrench[3] = np.inf
    with pytest.raises(NotFinite, match="'owner' writes a wrench of contact 'rear'"):
        guard.check()
    guard.restore()
    assert_array_equal(robot.contacts.wrenches, np.full((3, 6), 2.0))
