"""Translation of the hardware's names of joints into the model's."""

from solfer.config import CalibrationRecord, ControllerRecord, FeedbackRecord
from solfer.errors import PipeError, UnknownName
from solfer.robot.robot import Robot


def received_joints(
    record: FeedbackRecord, calibration: CalibrationRecord, robot: Robot, order: tuple[str, ...]
) -> tuple[str, ...]:
    """Translate the hardware's `order` into names of the model, without joints that the calibration does not know.

    Joints of the pipe that are not in the order follow: another driver may publish them later.

    Raises:
        UnknownName: The hardware does not publish a joint that the pipe needs, but others without a calibration: its
            name is wrong.
    """
    members = set(robot.selectors[record.dofs.chain].names)
    joints = calibration.robot(order)
    missing = [joint for joint in calibration.joints if joint in members and joint not in joints]
    if missing and len(joints) < len(order):
        name = calibration.hardware(missing[0])
        raise UnknownName(
            "joint of the hardware",
            name,
            order,
            where=calibration.joints[missing[0]].where("name"),
            expected=f"the name that '{record.source}' has for '{missing[0]}'",
        )
    return (*joints, *missing)


def commanded_joints(
    record: ControllerRecord, calibration: CalibrationRecord, order: tuple[str, ...]
) -> tuple[str, ...]:
    """Translate the `order` of a controller of the hardware into names of the model.

    Raises:
        PipeError: The calibration does not know a joint of the controller.
    """
    known = {calibration.hardware(joint) for joint in calibration.joints}
    foreign = [name for name in order if name not in known]
    if foreign:
        raise PipeError(
            f"controller '{record.name}' has joints without a calibration: {', '.join(foreign)}",
            where=calibration.where(),
            expected="the hardware's name and zero of each joint",
        )
    return calibration.robot(order)
