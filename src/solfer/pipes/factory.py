"""Makes the pipes of a configuration: a record, a Robot and a Middleware in, a pipe out."""

from collections.abc import Mapping

import numpy as np

from solfer.config import CalibrationRecord
from solfer.config.pipes import ControllerRecord, DofsRecord, FeedbackRecord, InterfaceRecord
from solfer.errors import PipeError, SolferError
from solfer.model import BidirectionalMap
from solfer.pipes.calibration import Calibration
from solfer.pipes.joint import INTERFACES, JointController, JointFeedback, external_names
from solfer.pipes.messages import JOINT_MESSAGES, canonical
from solfer.pipes.middleware import Middleware
from solfer.robot import Robot
from solfer.robot.builder import LOWER_LEVEL, controller_map

STATES = {"state": "state", "reference": "command"}
"""Value of the tag `function`, and the Robot's State that it means."""

COMMAND = "solfer/JointCommand"
"""Message of controllers that name none."""


def feedback(
    record: FeedbackRecord, robot: Robot, middleware: Middleware, calibrations: Mapping[str, CalibrationRecord]
) -> JointFeedback:
    """A pipe in.

    Raises:
        SolferError: The record asks for something that the pipe, the Robot or the middleware cannot give.
    """
    _joint_space(record)
    if record.source is None:
        raise PipeError(f"feedback '{record.name}' has no source", where=record.where(), expected="source: a topic")
    if record.function is None:
        raise PipeError(
            f"feedback '{record.name}' has no function", where=record.where(), expected="function: state | reference"
        )
    fields = _fields(record.interface, record.name)
    message = _message(record, "sensor_msgs/JointState", fields)
    mapping = _mapping(record.dofs, record.dofs.mapping, robot, record.name)
    reader = middleware.reader(record.source, message)
    state = getattr(robot, STATES[record.function])
    calibration = _calibration(record, robot, mapping, calibrations)
    return JointFeedback(record.name, reader, mapping, state, fields, record.initialize, calibration)


def controller(
    record: ControllerRecord, robot: Robot, middleware: Middleware, calibrations: Mapping[str, CalibrationRecord]
) -> JointController:
    """A pipe out. The topic of a lower-level controller is its name with the sink behind it.

    Raises:
        SolferError: The record asks for something that the pipe, the Robot or the middleware cannot give.
    """
    _joint_space(record)
    fields = _fields(record.interface, record.name)
    message = _message(record, COMMAND, fields)
    if record.lower_level:
        topic = record.name + (record.sink or "/command")
    elif record.sink is not None:
        topic = record.sink
    else:
        raise PipeError(f"controller '{record.name}' has no sink", where=record.where(), expected="sink: a topic")
    mapping_name = record.dofs.mapping
    if record.lower_level and mapping_name == LOWER_LEVEL:
        mapping_name = controller_map(record.name)  # a controller takes its own joints, not those of its neighbours
    mapping = _mapping(record.dofs, mapping_name, robot, record.name)
    calibration = _calibration(record, robot, mapping, calibrations)
    return JointController(record.name, middleware.writer(topic, message), mapping, robot.command, fields, calibration)


def select(dofs: DofsRecord, robot: Robot) -> np.ndarray:
    """The Robot's DoFs of a chain that are of a type: `all`, `actuated`, `unactuated`, or members of a named map.

    Raises:
        SolferError: An unknown chain, type or map.
    """
    try:
        chain = robot.selectors[dofs.chain].indices
    except SolferError as error:
        raise error.at(dofs.where("chain")) from None
    if dofs.type == "all":
        return chain
    if dofs.type in ("actuated", "unactuated"):
        return np.intersect1d(chain, robot.actuated) if dofs.type == "actuated" else np.setdiff1d(chain, robot.actuated)
    if dofs.type == "body":
        raise PipeError("type 'body' in joint space", where=dofs.where("type"), expected="space: OPERATIONAL")
    try:
        return np.intersect1d(chain, robot.maps[dofs.type].robot_indices)
    except SolferError as error:
        raise PipeError(
            f"unknown type '{dofs.type}' of DoFs",
            where=dofs.where("type"),
            expected="all, actuated, unactuated, body, or the name of a map",
            names=error.names,
        ) from None


def _mapping(dofs: DofsRecord, name: str, robot: Robot, pipe: str) -> BidirectionalMap:
    selected = select(dofs, robot)
    try:
        mapping = robot.maps[name].select(selected)
    except SolferError as error:
        raise error.at(dofs.where("mapping")) from None
    if not len(mapping.robot_indices):
        raise PipeError(
            f"pipe '{pipe}' carries no DoF: none of chain '{dofs.chain}', type '{dofs.type}' is in map '{name}'",
            where=dofs.where("chain"),
        )
    return mapping


def _calibration(
    record: FeedbackRecord | ControllerRecord,
    robot: Robot,
    mapping: BidirectionalMap,
    calibrations: Mapping[str, CalibrationRecord],
) -> Calibration | None:
    """The calibration that a pipe asks for; it has to know every joint of the robot that the pipe could carry."""
    if record.calibration is None:
        return None
    calibration = calibrations[record.calibration]
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


def _joint_space(record: FeedbackRecord | ControllerRecord) -> None:
    if record.space != "JOINT":
        raise PipeError(
            f"pipe '{record.name}' is in {record.space} space", where=record.where("space"), expected="space: JOINT"
        )


def _fields(interface: InterfaceRecord, pipe: str) -> tuple[str, ...]:
    fields = tuple(field for field in INTERFACES if getattr(interface, field))
    if not fields:
        raise PipeError(f"pipe '{pipe}' carries no interface", where=interface.where(), expected="at least one true")
    return fields


def _message(record: FeedbackRecord | ControllerRecord, default: str, fields: tuple[str, ...]) -> str:
    where = record.where("message")
    message = canonical(record.message or default, where)
    carried = JOINT_MESSAGES.get(message)
    if carried is None:
        raise PipeError(f"{message} carries no joints", where=where, expected=" or ".join(JOINT_MESSAGES))
    for field in fields:
        if field not in carried:
            raise PipeError(f"{message} carries no '{field}'", where=where, expected=f"one of {', '.join(carried)}")
    return message
