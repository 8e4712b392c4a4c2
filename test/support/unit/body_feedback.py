"""What several tests of body feedback share."""

import numpy as np
from scipy.spatial.transform import Rotation
from support.unit.cart import URDF
from support.unit.endpoints import StandInReader

from solfer.config.records.conventions import ConventionRecord
from solfer.model import Description, Kinematics, State
from solfer.pipes.body.feedback import BodyFeedbackPipe, BodySensor
from solfer.pipes.body.reading import READINGS
from solfer.pipes.body.sensor_mount import SensorMount
from solfer.pipes.state_feedback_pipe import Reception

SENSOR = (
    '<link name="sensor"/><joint name="glue" type="fixed"><parent link="arm"/><child link="sensor"/>'
    '<origin xyz="0.1 0.2 -0.3" rpy="0.4 -0.5 0.6"/></joint></robot>'
)
FREE, ORIGIN = '<joint name="free" type="floating">', '<origin xyz="0.1 0 0.5" rpy="0 0 0.3"/>'
DESCRIPTION = Description.from_text(URDF.replace("</robot>", SENSOR).replace(FREE, FREE + ORIGIN))
Q = np.array((0.3, -0.2, 0.8, 0.5, -0.7, 2.0, 0.9, 0.0))
V = np.array((0.4, 0.1, -0.3, 0.2, 0.6, -0.5, 1.1, -0.8))


def truth(link, offset=None, turn=None):
    """Position, rotation, velocity and angular velocity of a sensor in the world, by kinematics alone."""
    kinematics = Kinematics(DESCRIPTION)
    kinematics.update(Q, V)
    velocity, rotation = kinematics.velocity(link), Rotation.from_matrix(kinematics.rotation(link))
    lever = rotation.apply(np.zeros(3) if offset is None else offset)
    linear = velocity[:3] + np.cross(velocity[3:], lever)
    return kinematics.position(link) + lever, rotation if turn is None else rotation * turn, linear, velocity[3:]


def make(  # noqa: PLR0913, PLR0917 a test names what it changes
    message,
    link,
    fields=("position", "velocity"),
    reader=None,
    offset=None,
    turn=None,
    axes=(0, 1, 2),
    low_pass=None,
    calibrated=False,
    **tags,
):
    """Make a pipe into a State with known joints."""
    state, convention = State(DESCRIPTION_DOFS), ConventionRecord.model_validate(tags)
    state.position[6:], state.velocity[6:] = Q[6:], V[6:]
    mount = SensorMount(DESCRIPTION, link, state, offset, None if turn is None else turn.as_matrix())
    reading = READINGS[message](link, convention, axes)
    sensor = BodySensor(mount, reading, convention.position.type == "FULL", calibrated)
    reader = reader or StandInReader()
    chart = Kinematics(DESCRIPTION).base
    pipe = BodyFeedbackPipe("base", reader, state, chart, sensor, fields=fields, reception=Reception(low_pass=low_pass))
    return pipe, reader, state


DESCRIPTION_DOFS = Kinematics(DESCRIPTION).dofs
