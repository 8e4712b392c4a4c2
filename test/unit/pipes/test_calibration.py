"""Calibrations: numbers and names of the hardware at the pipes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.unit.endpoints import KeptWriter, StandInReader

from solfer.errors import SizeMismatch
from solfer.model import BidirectionalMap, State
from solfer.pipes import JointCommandPipe, JointFeedbackPipe
from solfer.pipes.joint.calibration import Calibration
from solfer.pipes.joint.pipes import JointReceiver, JointSender
from solfer.pipes.state_feedback_pipe import Reception
from solfer.pipes.state_field import interface_of
from solfer.transport import JointMessage, MessageStatus

DOFS = ("base", "yaw", "knee", "wheel")
HARDWARE = ("J76", "J01", "J99", "J42")
"""Order and names of the hardware: wheel, yaw, a joint that the model does not have, knee."""


@pytest.fixture
def mapping():
    return BidirectionalMap("FEEDBACK", DOFS, ("wheel", "yaw", "knee"))


@pytest.fixture
def calibration():
    """Return a calibration in the order of the map."""
    return Calibration(("J76", "J01", "J42"), (1, -1, -1), (0.0, 0.3, -0.5))


def test_measurements_are_converted_to_the_model(mapping, calibration):
    """Signs and offsets apply to position, signs alone to velocity and effort; the received message is unchanged."""
    reader = StandInReader(
        JointMessage(
            HARDWARE, np.array([7.0, 0.5, 9.0, -1.5]), np.array([1.0, 2.0, 9.0, 3.0]), np.array([-4.0, 5.0, 9.0, -6.0])
        )
    )
    state = State(DOFS)
    pipe = JointFeedbackPipe(
        "joints",
        reader,
        mapping,
        state,
        ("position", "velocity", "effort"),
        reception=Reception(),
        sender=JointSender(calibration),
    )
    state.position[0] = 0.125
    assert pipe.run() is MessageStatus.NEW
    # yaw: -(0.5 - 0.3), knee: -(-1.5 + 0.5), wheel: 7 - 0
    assert_allclose(state.position, [0.125, -0.2, 1.0, 7.0], atol=1e-15)
    assert_allclose(state.velocity, [0.0, -2.0, -3.0, 1.0])
    assert_allclose(state.torque, [0.0, -5.0, 6.0, -4.0])
    assert_allclose(reader.message.position, [7.0, 0.5, 9.0, -1.5])  # others may receive the same message


def test_names_of_the_model_are_refused(mapping, calibration):
    reader = StandInReader(JointMessage(("wheel", "yaw", "knee"), np.zeros(3)))
    pipe = JointFeedbackPipe(
        "joints", reader, mapping, State(DOFS), ("position",), reception=Reception(), sender=JointSender(calibration)
    )
    assert pipe.run() is MessageStatus.OLD and pipe.refused == 1


def test_commands_are_converted_to_the_hardware(mapping, calibration):
    """Hardware receives its own names, signs and offsets, while the gate checks the model's values."""
    state, writer = State(DOFS), KeptWriter()
    state.position[:], state.torque[:] = (9.0, -0.2, 1.0, 7.0), (9.0, -5.0, 6.0, -4.0)
    pipe = JointCommandPipe(
        "joints", writer, mapping, state, ("position", "effort"), receiver=JointReceiver(calibration)
    )
    for _ in range(2):  # sending twice does not calibrate twice
        pipe.collect()
        pipe.send(0.25)
        pipe.send(0.5)
    assert len(writer.messages) == 4
    for sent in writer.messages:
        assert sent.names == ("J76", "J01", "J42")
        assert_allclose(sent.position, [7.0, 0.5, -1.5], atol=1e-15)
        assert_allclose(sent.effort, [-4.0, 5.0, -6.0])
    # a gate checks the model's names and values
    assert pipe.message.names == ("wheel", "yaw", "knee")
    assert_allclose(pipe.message.position, [7.0, -0.2, 1.0])


def test_changes_of_a_gate_are_sent(mapping, calibration):
    writer = KeptWriter()
    pipe = JointCommandPipe(
        "joints", writer, mapping, State(DOFS), ("position", "effort"), receiver=JointReceiver(calibration)
    )
    pipe.collect()
    pipe.message.position[1] = 0.1
    pipe.send(0.0)
    assert_allclose(writer.messages[0].position, [0.0, 0.2, -0.5], atol=1e-15)


def test_gains_have_neither_sign_nor_zero(mapping, calibration):
    state, writer = State(DOFS), KeptWriter()
    for name, numbers in (("stiffness", (9.0, 300.0, 400.0, 500.0)), ("acceleration", (9.0, 1.0, 2.0, 3.0))):
        if name not in state:
            state.add(name)
        state[name] = np.array(numbers)
    pipe = JointCommandPipe(
        "joints", writer, mapping, state, ("stiffness", "acceleration"), receiver=JointReceiver(calibration)
    )
    pipe.collect()
    pipe.send(0.0)
    assert_allclose(writer.messages[0].stiffness, [500.0, 300.0, 400.0])
    assert_allclose(writer.messages[0].numbers("acceleration"), [3.0, -1.0, -2.0])


@pytest.mark.parametrize("field", ["position", "velocity", "effort", "stiffness", "acceleration"])
def test_one_way_undoes_the_other(mapping, calibration, field):
    """What a pipe out sends to the hardware is what a pipe in makes of it."""
    there, back = State(DOFS), State(DOFS)
    if field == "stiffness":
        there.add(field)
        back.add(field)
    values = np.array([9.0, 0.3, -1.25, 2.0])
    there[interface_of(field)] = values
    writer = KeptWriter()
    command = JointCommandPipe("out", writer, mapping, there, (field,), receiver=JointReceiver(calibration))
    command.collect()
    command.send(0.0)
    reader = StandInReader(writer.messages[0])
    JointFeedbackPipe(
        "in", reader, mapping, back, (field,), reception=Reception(), sender=JointSender(calibration)
    ).run()
    assert_allclose(back[interface_of(field)][1:], values[1:], atol=1e-15)


def test_every_joint_has_a_sign_and_an_offset():
    with pytest.raises(SizeMismatch, match="1 signs for 2 joints"):
        Calibration(("a", "b"), (1,), (0.0, 0.0))
    with pytest.raises(SizeMismatch, match="3 offsets for 2 joints"):
        Calibration(("a", "b"), (1, -1), (0.0, 0.0, 0.0))
