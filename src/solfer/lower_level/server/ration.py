"""Largest sizes of commands and requests, from the number of joints and the length of their names."""

from collections.abc import Iterable

from solfer.lower_level.laws.controllers import LowerLevelController
from solfer.lower_level.lower_level import LowerLevel
from solfer.transport.messages import JOINT_FIELDS

LENGTH_BYTES = 4
NUMBER_BYTES = 8  # bytes of a length and of a number in a message
HEADER_BYTES = 1024  # bytes for everything but joints, such as the name of a frame
NAMES_BYTES = 4096  # bytes for the names of an owner, of controllers, or of a file
AMPLE = 2  # names of the hardware may be longer than those of the model


def largest_command(controller: LowerLevelController) -> int:
    """Compute the bytes of a command for all joints of a controller, with room to spare."""
    fields = len(JOINT_FIELDS) * (LENGTH_BYTES + NUMBER_BYTES * len(controller.joints))
    return AMPLE * (_bytes(controller.joints) + fields) + HEADER_BYTES


def largest_request(lower_level: LowerLevel) -> int:
    """Compute the bytes of a request that names all joints, with room to spare."""
    joints = [controller.joints for controller in lower_level.controllers.values()]
    return AMPLE * sum(_bytes(names) + NUMBER_BYTES * len(names) for names in joints) + NAMES_BYTES


def _bytes(names: Iterable[str]) -> int:
    return sum(LENGTH_BYTES + len(name.encode()) for name in names)
