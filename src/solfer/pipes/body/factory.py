"""Makes pipes in operational space: pose and twist of a link."""

from solfer.config.records.conventions import ConventionRecord
from solfer.config.records.pipes import ControllerRecord, FeedbackRecord
from solfer.errors import PipeError, SolferError
from solfer.model import Kinematics
from solfer.model.state import POSE_COVARIANCE, TWIST_COVARIANCE
from solfer.pipes.body.command import SENT_MESSAGES, BodyCommandPipe, PublishedLink
from solfer.pipes.body.feedback import BodyFeedbackPipe, BodySensor
from solfer.pipes.body.reading import CHART_AXES, READINGS, BodyReading, turns
from solfer.pipes.body.sensor_mount import SensorMount
from solfer.pipes.context import PipeContext, fields_of, message_of
from solfer.pipes.dofs import require_base, require_link


def feedback(record: FeedbackRecord, context: PipeContext) -> BodyFeedbackPipe:
    """Make a pipe from a topic to the floating base of a State; see `factory.feedback`."""
    robot = context.robot
    convention = record.convention or ConventionRecord()
    link = require_base(record, robot)
    fields = _fields(record)
    message = message_of(record, READINGS, "rigid body")
    reading = READINGS[message]
    _check_orientation(record, convention, reading)
    _check_carried(record, convention, reading, fields=fields)
    if record.calibrate and "position" not in fields:
        raise PipeError(
            f"pipe '{record.name}' is calibrated by the pose that it does not carry",
            where=record.where("calibrate"),
            expected="interface: {position: true}",
        )
    state = context.state(record.function or "state")
    return BodyFeedbackPipe(
        record.name,
        context.middleware.reader(record.source, message, record.history or 0),
        state,
        chart=robot.kinematics.base,
        sensor=BodySensor(
            _mount(record, context, link),
            reading(_body_name(record, link), convention, turns(record.output_angles)),
            located=convention.position.type == "FULL",
            calibrated=record.calibrate,
        ),
        fields=fields,
        reception=context.reception(record),
    )


def controller(record: ControllerRecord, context: PipeContext) -> BodyCommandPipe:
    """Make a pipe from pose and twist of a link of a State to a topic; see `factory.controller`."""
    robot = context.robot
    convention = record.convention or ConventionRecord()
    if record.filter is not None and record.filter.run:
        raise PipeError(
            f"controller '{record.name}' filters the state of a link",
            where=record.filter.where(),
            expected="a filter in the pipe that receives it",
        )
    link = require_link(record.dofs, robot)
    message = message_of(record, SENT_MESSAGES, "rigid body that a plugin can send")
    for field in _fields(record):
        if field not in SENT_MESSAGES[message]:
            raise PipeError(
                f"{message} carries no '{field}'",
                where=record.interface.where(field),
                expected=f"{field}: false, or another message",
            )
    if convention.orientation.type == "EULER" or convention.position.type == "NONE":
        raise PipeError(
            f"{message} is sent with a quaternion and a position",
            where=record.where("convention"),
            expected="orientation.type: QUATERNION, position.type: FULL",
        )
    state = context.state(record.function)
    known = link == robot.kinematics.base_link and POSE_COVARIANCE in state and TWIST_COVARIANCE in state
    covariances = (state[POSE_COVARIANCE], state[TWIST_COVARIANCE]) if known else None
    return BodyCommandPipe(
        record.name,
        context.writer(record.sink, message),
        message,
        kinematics=Kinematics(robot.description, robot.kinematics.base is not None),
        state=state,
        link=PublishedLink(link, convention, record.frame_id, covariances=covariances),
    )


def _fields(record: FeedbackRecord | ControllerRecord) -> tuple[str, ...]:
    fields = fields_of(record.interface, record.name)
    for field in fields:
        if field not in ("position", "velocity"):
            raise PipeError(
                f"pipe '{record.name}' carries no '{field}': it carries a link",
                where=record.interface.where(field),
                expected=f"{field}: false",
            )
    return fields


def _check_orientation(record: FeedbackRecord, convention: ConventionRecord, reading: type[BodyReading]) -> None:
    """Check that the type of orientation, angles or quaternion, is that of the message."""
    lacking = "EULER" if reading is READINGS["geometry_msgs/Vector3Stamped"] else "QUATERNION"
    given = convention.orientation.type
    if "orientation" in reading.carries and given != lacking:
        raise PipeError(
            f"the message of '{record.name}' has no orientation of the type {given}",
            where=convention.orientation.where("type") or record.where("convention"),
            expected=f"type: {lacking}, or another message",
        )
    if lacking == "QUATERNION" and turns(record.output_angles) != CHART_AXES:
        raise PipeError(
            "the base of the robot turns about x, then y, then z",
            where=record.output_angles.where(),
            expected="angle_1: 0, angle_2: 1, angle_3: 2, or orientation.type: EULER",
        )


def _check_carried(
    record: FeedbackRecord, convention: ConventionRecord, reading: type[BodyReading], fields: tuple[str, ...]
) -> None:
    """Check that the message carries all that the pipe needs."""
    located = convention.position.type == "FULL"
    needed = {"position": {"orientation", "position"}, "velocity": {"angular", "linear"}}
    for field in fields:
        lacking = needed[field] if located else needed[field] & {"orientation", "angular"}
        missing = sorted(lacking - reading.carries)
        if missing:
            cure = "convention.position.type: NONE" if missing[0] in ("position", "linear") else f"{field}: false"
            raise PipeError(
                f"the message of '{record.name}' carries no {' and no '.join(missing)}",
                where=record.interface.where(field),
                expected=f"{cure}, or another message",
            )


def _mount(record: FeedbackRecord, context: PipeContext, link: str) -> SensorMount:
    position = record.offset_position
    rotation = record.offset_orientation
    try:
        return SensorMount(
            context.robot.description,
            link,
            context.state(record.function or "state"),
            position=position.vector() if position else None,
            rotation=rotation.matrix() if rotation else None,
        )
    except SolferError as error:
        raise error.at(record.where("sensor") if record.reads_sensor else record.dofs.where("name")) from None


def _body_name(record: FeedbackRecord, link: str) -> str:
    """Return the sender's name of the link; a name such as `robot::link` ends with it."""
    return (record.reference or link).rpartition("::")[2]
