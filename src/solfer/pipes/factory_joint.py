"""Makes pipes in joint space."""

import numpy as np

from solfer.config.pipes import ControllerRecord, FeedbackRecord, PipeRecord
from solfer.errors import PipeError
from solfer.model import BidirectionalMap
from solfer.pipes.calibration import Calibration
from solfer.pipes.dofs import joint_map, select
from solfer.pipes.joint import JointController, JointFeedback, external_names
from solfer.pipes.messages import JOINT_MESSAGES
from solfer.pipes.surroundings import Surroundings, fields_of, message_of
from solfer.robot.builder import LOWER_LEVEL, controller_map

MEASUREMENT, COMMAND = "sensor_msgs/JointState", "solfer/JointCommand"
"""Messages of feedbacks and of controllers that name none."""


def feedback(record: FeedbackRecord, surroundings: Surroundings) -> JointFeedback:
    """DoFs of a State from a topic; see `factory.feedback`."""
    if record.function is None:
        raise PipeError(
            f"feedback '{record.name}' has no function", where=record.where(), expected="function: state | reference"
        )
    fields, message = _carried(record, MEASUREMENT)
    mapping = joint_map(record.dofs, record.dofs.mapping, surroundings.robot, record.name)
    return JointFeedback(
        record.name,
        surroundings.middleware.reader(record.source, message),
        mapping,
        surroundings.state(record.function),
        fields,
        record.initialize,
        _calibration(record, surroundings, mapping),
        surroundings.low_pass(record),
        _known(record, surroundings),
    )


def controller(record: ControllerRecord, surroundings: Surroundings) -> JointController:
    """DoFs of a State to a topic; that of a lower-level controller is its name with the sink behind it."""
    fields, message = _carried(record, COMMAND)
    topic, name, writer = record.sink, record.dofs.mapping, surroundings.writer
    if record.lower_level:
        writer = surroundings.commander
        topic = record.name + (record.sink or "/command")
        if name == LOWER_LEVEL:
            name = controller_map(record.name)  # a controller takes its own joints, not those of its neighbours
    mapping = joint_map(record.dofs, name, surroundings.robot, record.name)
    return JointController(
        record.name,
        writer(topic, message),
        mapping,
        surroundings.state(record.function),
        fields,
        _calibration(record, surroundings, mapping),
        surroundings.low_pass(record),
    )


def _carried(record: PipeRecord, default: str) -> tuple[tuple[str, ...], str]:
    """The fields of a pipe, and a message that can carry them."""
    fields = fields_of(record.interface, record.name)
    message = message_of(record, default, JOINT_MESSAGES, "joints")
    for field in fields:
        if field not in JOINT_MESSAGES[message]:
            raise PipeError(f"{message} carries no '{field}'", where=record.where("message"),
                            expected=f"one of {', '.join(JOINT_MESSAGES[message])}")
    return fields, message


def _known(record: FeedbackRecord, surroundings: Surroundings) -> set[str] | None:
    """Names that senders may use: those of the Robot and of all its maps, for what is told about other parts of it.

    None for hardware, which may tell joints that nobody calibrated.
    """
    if record.calibration is not None:
        return None
    maps = surroundings.robot.maps
    return {*surroundings.robot.dofs, *(name for each in maps for name in maps[each].external)}


def _calibration(record: PipeRecord, surroundings: Surroundings, mapping: BidirectionalMap) -> Calibration | None:
    """The calibration that a pipe asks for; it has to know every joint of the robot that the pipe could carry."""
    if record.calibration is None:
        return None
    robot, calibration = surroundings.robot, surroundings.calibrations[record.calibration]
    wanted = np.intersect1d(select(record.dofs, robot), robot.actuated)
    missing = [robot.dofs[dof] for dof in wanted if robot.dofs[dof] not in calibration.joints]
    if missing:
        raise PipeError(
            f"calibration '{calibration.name}' lacks joints of the pipe '{record.name}': {', '.join(missing)}",
            where=calibration.where(),
            expected="the hardware's name, the sign and the offset of each of them",
        )
    joints = [calibration.joints[name] for name in external_names(mapping)]
    names = [calibration.hardware(name) for name in external_names(mapping)]
    return Calibration(names, [joint.sign for joint in joints], [joint.offset for joint in joints])
