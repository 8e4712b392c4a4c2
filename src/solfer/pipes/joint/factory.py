"""Makes pipes in joint space."""

import numpy as np

from solfer.config.records.pipes import ControllerRecord, FeedbackRecord, PipeRecord
from solfer.errors import PipeError
from solfer.model import BidirectionalMap
from solfer.pipes.context import PipeContext, fields_of, message_of
from solfer.pipes.dofs import joint_map, select
from solfer.pipes.joint.calibration import Calibration
from solfer.pipes.joint.pipes import JointCommandPipe, JointFeedbackPipe, external_names
from solfer.pipes.joint.start_limits import StartLimits
from solfer.robot.names import LOWER_LEVEL, XBOT, controller_map
from solfer.transport.messages import JOINT_MESSAGES


def feedback(record: FeedbackRecord, context: PipeContext) -> JointFeedbackPipe:
    """Make a pipe from a topic to DoFs of a State; see `factory.feedback`."""
    if record.function is None:
        raise PipeError(
            f"feedback '{record.name}' has no function", where=record.where(), expected="function: state | reference"
        )
    fields, message = _carried(record)
    mapping = joint_map(record.dofs, record.dofs.mapping, context.robot, record.name)
    return JointFeedbackPipe(
        record.name,
        context.middleware.reader(record.source, message),
        mapping,
        context.state(record.function),
        fields,
        record.initialize,
        _calibration(record, context, mapping),
        context.low_pass(record),
        _known(record, context),
        record.function != "reference",
        _start_limits(record, context, mapping, fields),
    )


def controller(record: ControllerRecord, context: PipeContext) -> JointCommandPipe:
    """Make a pipe from DoFs of a State to a topic; for a lower-level controller its name plus the sink."""
    fields, message = _carried(record)
    topic, name, writer = record.sink, record.dofs.mapping, context.writer
    if record.lower_level:
        writer = context.commander
        topic = record.name + (record.sink or "/command")
        if name == LOWER_LEVEL or name == XBOT:
            name = controller_map(record.name)  # a controller accepts its own joints only
    mapping = joint_map(record.dofs, name, context.robot, record.name)
    return JointCommandPipe(
        record.name,
        writer(topic, message),
        mapping,
        context.state(record.function),
        fields,
        _calibration(record, context, mapping),
        context.low_pass(record),
    )


def _carried(record: PipeRecord) -> tuple[tuple[str, ...], str]:
    """Return the fields of a pipe, and a message that can carry them."""
    fields = fields_of(record.interface, record.name)
    message = message_of(record, JOINT_MESSAGES, "joints")
    for field in fields:
        if field not in JOINT_MESSAGES[message]:
            raise PipeError(
                f"{message} carries no '{field}'",
                where=record.where("message"),
                expected=f"one of {', '.join(JOINT_MESSAGES[message])}",
            )
    return fields, message


def _start_limits(
    record: FeedbackRecord, context: PipeContext, mapping: BidirectionalMap, fields: tuple[str, ...]
) -> StartLimits | None:
    if record.limits is None:
        return None
    return StartLimits(record.name, record.limits, context.robot, mapping.robot_indices, fields)


def _known(record: FeedbackRecord, context: PipeContext) -> set[str] | None:
    """Return the names that a message may contain: those of the Robot and of all its maps, also for other parts of it.

    None for hardware, which may publish joints without a calibration.
    """
    if record.calibration is not None:
        return None
    maps = context.robot.maps
    return {*context.robot.dofs, *(name for each in maps for name in maps[each].external)}


def _calibration(record: PipeRecord, context: PipeContext, mapping: BidirectionalMap) -> Calibration | None:
    """Make a pipe's calibration; it has to have every joint of the robot that the pipe could carry."""
    if record.calibration is None:
        return None
    robot, calibration = context.robot, context.calibrations[record.calibration]
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
