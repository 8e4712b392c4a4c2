"""Makes pipes in operational space: pose and twist of a link."""

from solfer.config.conventions import ConventionRecord
from solfer.config.pipes import ControllerRecord, FeedbackRecord
from solfer.errors import PipeError, SolferError
from solfer.model import Kinematics
from solfer.pipes.body import BodyFeedback
from solfer.pipes.body_controller import SENT, BodyController
from solfer.pipes.body_reading import MOVING, READINGS, BodyReading, turns
from solfer.pipes.dofs import require_base, require_link
from solfer.pipes.mount import Mount
from solfer.pipes.surroundings import Surroundings, fields_of, message_of

ODOMETRY = "nav_msgs/Odometry"
"""Message of pipes that name none."""


def feedback(record: FeedbackRecord, surroundings: Surroundings) -> BodyFeedback:
    """The floating base of a State from a topic; see `factory.feedback`."""
    robot, convention = surroundings.robot, record.convention or ConventionRecord()
    link = require_base(record.dofs, robot, record.name)
    fields = _fields(record)
    message = message_of(record, ODOMETRY, READINGS, "rigid body")
    reading = READINGS[message]
    _check_orientation(record, convention, reading)
    _check_carried(record, convention, reading, fields)
    if record.calibrate and "position" not in fields:
        raise PipeError(f"pipe '{record.name}' is calibrated by the pose that it does not carry",
                        where=record.where("calibrate"), expected="interface: {position: true}")
    state = surroundings.state(record.function or "state")
    return BodyFeedback(
        record.name,
        surroundings.middleware.reader(record.source, message),
        state,
        robot.kinematics.base,
        _mount(record, surroundings, link),
        reading(_body_name(record, link), convention, turns(record.output_angles)),
        fields,
        convention.position.type == "FULL",
        record.initialize,
        surroundings.low_pass(record),
        record.calibrate,
    )


def controller(record: ControllerRecord, surroundings: Surroundings) -> BodyController:
    """Pose and twist of a link of a State to a topic; see `factory.controller`."""
    robot, convention = surroundings.robot, record.convention or ConventionRecord()
    if record.filter is not None and record.filter.run:
        raise PipeError(f"controller '{record.name}' filters the state of a link", where=record.filter.where(),
                        expected="a filter in the pipe that hears it")
    link = require_link(record.dofs, robot)
    message = message_of(record, ODOMETRY, SENT, "rigid body that a plugin can send")
    for field in _fields(record):
        if field not in SENT[message]:
            raise PipeError(f"{message} carries no '{field}'", where=record.interface.where(field),
                            expected=f"{field}: false, or another message")
    if convention.orientation.type == "EULER" or convention.position.type == "NONE":
        raise PipeError(f"{message} is sent with a quaternion and a position", where=record.where("convention"),
                        expected="orientation.type: QUATERNION, position.type: FULL")
    return BodyController(
        record.name,
        surroundings.writer(record.sink, message),
        message,
        Kinematics(robot.description, robot.kinematics.base is not None),
        surroundings.state(record.function),
        link,
        convention,
    )


def _fields(record: FeedbackRecord | ControllerRecord) -> tuple[str, ...]:
    fields = fields_of(record.interface, record.name)
    if "effort" in fields:
        raise PipeError(f"pipe '{record.name}' carries no 'effort': it is about a link",
                        where=record.interface.where("effort"), expected="effort: false")
    return fields


def _check_orientation(record: FeedbackRecord, convention: ConventionRecord, reading: type[BodyReading]) -> None:
    """Angles and quaternions are what the message has."""
    wanted = "EULER" if reading is READINGS["geometry_msgs/Vector3Stamped"] else "QUATERNION"
    given = convention.orientation.type
    if "orientation" in reading.carries and given != wanted:
        raise PipeError(f"the message of '{record.name}' has no orientation of the type {given}",
                        where=convention.orientation.where("type") or record.where("convention"),
                        expected=f"type: {wanted}, or another message")
    if wanted == "QUATERNION" and turns(record.output_angles) != MOVING:
        raise PipeError("the base of the robot turns about x, then y, then z", where=record.output_angles.where(),
                        expected="angle_1: 0, angle_2: 1, angle_3: 2, or orientation.type: EULER")


def _check_carried(
    record: FeedbackRecord, convention: ConventionRecord, reading: type[BodyReading], fields: tuple[str, ...]
) -> None:
    """The message carries what the pipe wants."""
    located = convention.position.type == "FULL"
    needed = {"position": {"orientation", "position"}, "velocity": {"angular", "linear"}}
    for field in fields:
        wanted = needed[field] if located else needed[field] & {"orientation", "angular"}
        missing = sorted(wanted - reading.carries)
        if missing:
            cure = "convention.position.type: NONE" if missing[0] in ("position", "linear") else f"{field}: false"
            raise PipeError(f"the message of '{record.name}' tells no {' and no '.join(missing)}",
                            where=record.interface.where(field), expected=f"{cure}, or another message")


def _mount(record: FeedbackRecord, surroundings: Surroundings, link: str) -> Mount:
    position, rotation = record.offset_position, record.offset_orientation
    try:
        return Mount(
            surroundings.robot.description,
            link,
            surroundings.state(record.function or "state"),
            position and position.vector(),
            rotation and rotation.matrix(),
        )
    except SolferError as error:
        raise error.at(record.dofs.where("name")) from None


def _body_name(record: FeedbackRecord, link: str) -> str:
    """The sender's name of the link; a name such as `robot::link` ends with it."""
    return (record.reference or link).rpartition("::")[2]
