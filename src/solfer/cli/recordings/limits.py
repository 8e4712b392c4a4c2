"""Limits of the joints of the robot that a recording is of."""

from solfer.errors import SolferError
from solfer.model.urdf.description import Description
from solfer.recording.model import Recording

URDF = "robot.urdf"
"""Name of the attachment, behind that of the plugin."""


def limits_of(recording: Recording, plugin: str) -> dict[str, tuple[float, float]]:
    """Return the least and the largest position of each joint of a plugin's attached URDF; none without one.

    Raises:
        ModelError: The attachment is no URDF.
    """
    name = f"{plugin}/{URDF}"
    if name not in recording.attachments:
        return {}
    try:
        description = Description.from_text(recording.attachments[name].decode(errors="replace"), name)
    except SolferError as error:
        raise error.at(name) from None
    joints = description.moving_joints
    return {
        joint.name: (joint.lower, joint.upper)
        for joint in joints
        if joint.lower is not None and joint.upper is not None
    }
