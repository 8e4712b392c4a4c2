"""The names that a robot's hardware gives to its joints, against those of the model."""

from solfer.config import CalibrationRecord, ControllerRecord, FeedbackRecord
from solfer.errors import PipeError, UnknownName
from solfer.robot.robot import Robot

HARDWARE = "joint of the hardware"


def heard_joints(
    record: FeedbackRecord, calibration: CalibrationRecord, robot: Robot, order: tuple[str, ...]
) -> tuple[str, ...]:
    """The hardware's `order` in the names of the model, without what the calibration does not know.

    Raises:
        UnknownName: The hardware does not tell a joint that the pipe needs.
    """
    members = set(robot.selectors[record.dofs.chain].names)
    for joint, entry in calibration.joints.items():
        name = calibration.hardware(joint)
        if joint in members and name not in order:
            raise UnknownName(HARDWARE, name, order, where=entry.where("name"),
                              expected=f"the name that '{record.source}' has for '{joint}'")
    return calibration.robot(order)


def commanded_joints(
    record: ControllerRecord, calibration: CalibrationRecord, order: tuple[str, ...]
) -> tuple[str, ...]:
    """The `order` of a controller of the hardware in the names of the model.

    Raises:
        PipeError: The calibration does not know a joint of the controller.
    """
    known = {calibration.hardware(joint) for joint in calibration.joints}
    foreign = [name for name in order if name not in known]
    if foreign:
        raise PipeError(f"controller '{record.name}' has joints that no one calibrated: {', '.join(foreign)}",
                        where=calibration.where(), expected="the hardware's name and zero of each joint")
    return calibration.robot(order)
