"""Makes pipes in joint space."""

from collections.abc import Sequence

import numpy as np

from solfer.config.records.pipes import ControllerRecord, FeedbackRecord, PipeRecord
from solfer.errors import PipeError, UnknownName, nearest
from solfer.model import BidirectionalMap, State
from solfer.pipes.context import PipeContext, fields_of, message_of
from solfer.pipes.dofs import joint_map, select
from solfer.pipes.joint.calibration import Calibration
from solfer.pipes.joint.leaps import JointLeaps
from solfer.pipes.joint.pipes import JointCommandPipe, JointFeedbackPipe, JointReceiver, JointSender, external_names
from solfer.pipes.joint.start_limits import StartLimits
from solfer.pipes.joint.turns import JointTurns
from solfer.pipes.state_field import interface_of
from solfer.robot.names import LOWER_LEVEL_MAPS, controller_map
from solfer.transport.messages import ANY_INTERFACE, GAINS, JOINT_FIELDS, JOINT_MESSAGES


def feedback(record: FeedbackRecord, context: PipeContext) -> JointFeedbackPipe:
    """Make a pipe from a topic to DoFs of a State; see `factory.feedback`."""
    if record.function is None:
        raise PipeError(
            f"feedback '{record.name}' has no function", where=record.where(), expected="function: state | reference"
        )
    fields, message = _carried(record)
    mapping = joint_map(record.dofs, record.dofs.mapping, context.robot, pipe=record.name)
    dofs = np.array(mapping.robot_indices)
    reception = context.reception(record)
    return JointFeedbackPipe(
        record.name,
        context.middleware.reader(record.source, message, record.history or 0),
        mapping,
        state=_state(record, context, fields),
        fields=fields,
        reception=reception,
        sender=JointSender(
            _calibration(record, context, mapping),
            _known(record, context),
            _start_limits(record, context, mapping, fields=fields),
            leaps=JointLeaps(context.robot, dofs) if reception.measured else None,
            turns=_turns(record, context, dofs),
        ),
    )


def _turns(record: FeedbackRecord, context: PipeContext, dofs: np.ndarray) -> JointTurns | None:
    """Make what counts the turns of a pipe's continuous joints; None: it has none of them."""
    if not context.robot.revolutions[dofs].any():
        return None
    return JointTurns(context.robot, dofs, record.function or "state", is_calibrated=record.calibration is not None)


def controller(record: ControllerRecord, context: PipeContext) -> JointCommandPipe:
    """Make a pipe from DoFs of a State to a topic; of a lower-level controller its name plus the sink."""
    fields, message = _carried(record)
    topic = record.sink
    name = record.dofs.mapping
    writer = context.writer
    if record.lower_level:
        writer = context.commander
        if record.sink is not None and not record.sink.startswith("/"):
            raise PipeError(
                f"the sink '{record.sink}' follows the name of the controller '{record.leads_to}' without a slash",
                where=record.where("sink"),
                expected=f"/{record.sink}",
            )
        topic = record.leads_to + (record.sink or "/command")
        _check_commanded(record, fields)
        if name in LOWER_LEVEL_MAPS:
            name = controller_map(record.leads_to)  # a controller accepts its own joints only
    mapping = joint_map(record.dofs, name, context.robot, pipe=record.name)
    state = _state(record, context, fields)
    standing = _published_gains(record, context, mapping) if record.lower_level else {}
    for gain, published in standing.items():
        _begin_with(state[gain], mapping.robot_indices, published)
    return JointCommandPipe(
        record.name,
        writer(topic, message),
        mapping,
        state=state,
        fields=fields,
        receiver=JointReceiver(
            _calibration(record, context, mapping),
            (context.robot.revolutions, context.robot.added_revolutions),
            record.leads_to,
            standing=standing,
            component=context.component,
        ),
        low_pass=context.low_pass(record),
    )


def _carried(record: PipeRecord) -> tuple[tuple[str, ...], str]:
    """Return the fields of a pipe, and a message that can carry them."""
    fields = fields_of(record.interface, record.name)
    message = message_of(record, JOINT_MESSAGES, "joints")
    for field in fields:
        if field not in JOINT_MESSAGES[message] and message != ANY_INTERFACE:
            known = type(record.interface).model_fields
            if field not in known and nearest(field, known, count=1, likeness=0.75):
                raise UnknownName("interface", field, known, where=record.interface.where(field))
            raise PipeError(
                f"{message} carries no '{field}'",
                where=record.where("message"),
                expected=f"{ANY_INTERFACE}, or of {', '.join(JOINT_MESSAGES[message])}",
            )
    return fields, message


def _state(record: FeedbackRecord | ControllerRecord, context: PipeContext, fields: tuple[str, ...]) -> State:
    """Return the State of a pipe, which has all its interfaces: gains are added where the component has not."""
    state = context.state(record.function)
    for field in fields:
        name = interface_of(field)
        where = record.interface.where(field)
        if name in GAINS and name not in state:
            state.add(name)
        if name not in state:
            known = ["effort" if each == "torque" else each for each in state.interfaces]
            raise UnknownName("interface", field, known, where=where)
        if len(state[name]) != state.size:
            raise PipeError(
                f"the interface '{field}' has {len(state[name])} numbers", where=where, expected="one for each DoF"
            )
    return state


def _check_commanded(record: ControllerRecord, fields: tuple[str, ...]) -> None:
    """Check that a controller of the lower level takes all fields of its pipe."""
    taken = ("velocity",) if record.type == "velocity" else JOINT_FIELDS
    for field in fields:
        if field not in taken:
            raise PipeError(
                f"the lower level's controller '{record.leads_to}' takes no '{field}'",
                where=record.interface.where(field),
                expected=f"of {', '.join(taken)}",
            )


def _published_gains(
    record: ControllerRecord, context: PipeContext, mapping: BidirectionalMap
) -> dict[str, np.ndarray]:
    """Request the lower level's gains that a pipe carries, in its order. A plugin that sends nothing needs none.

    Raises:
        MiddlewareError: The lower level does not publish its gains.
    """
    carried = [gain for gain in GAINS if getattr(record.interface, gain)]
    if not carried or context.idle:
        return {}
    timeout = 10.0  # longest wait for the lower level's gains [s]
    published = context.middleware.controller_gains(record.leads_to, timeout, record.interface.where(carried[0]))
    calibration = None if record.calibration is None else context.calibrations[record.calibration]
    names = external_names(mapping)
    hardware = [name if calibration is None else calibration.hardware(name) for name in names]
    # joints that the controller does not have are refused by its map
    known = [published.get(name, (0.0, 0.0)) for name in hardware]
    return {gain: np.array([gains[GAINS.index(gain)] for gains in known], dtype=float) for gain in carried}


def _begin_with(gains: np.ndarray, dofs: Sequence[int], published: np.ndarray) -> None:
    """Write the lower level's gains where a component has written none yet: joints that it leaves alone keep them."""
    gains[dofs] = np.where(gains[dofs] == 0.0, published, gains[dofs])


def _start_limits(
    record: FeedbackRecord, context: PipeContext, mapping: BidirectionalMap, fields: tuple[str, ...]
) -> StartLimits | None:
    if record.limits is None:
        return None
    return StartLimits(record.name, record.limits, context.robot, dofs=mapping.robot_indices, fields=fields)


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
    robot = context.robot
    calibration = context.calibrations[record.calibration]
    selected = np.intersect1d(select(record.dofs, robot), robot.actuated)
    missing = [robot.dofs[dof] for dof in selected if robot.dofs[dof] not in calibration.joints]
    if missing:
        raise PipeError(
            f"calibration '{calibration.name}' lacks joints of the pipe '{record.name}': {', '.join(missing)}",
            where=calibration.where(),
            expected="the hardware's name, the sign and the offset of each of them",
        )
    joints = [calibration.joints[name] for name in external_names(mapping)]
    names = [calibration.hardware(name) for name in external_names(mapping)]
    return Calibration(names, [joint.sign for joint in joints], [joint.offset for joint in joints])
