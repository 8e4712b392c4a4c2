"""Services that a controller of the lower level offers."""

from dataclasses import dataclass

from solfer.components.declaration import Service
from solfer.lower_level.controller import Controller


@dataclass(frozen=True)
class JointNamesRequest:
    """Asks for the joints of a controller."""


@dataclass(frozen=True)
class JointNamesReply:
    """Joints of a controller, in its order."""

    success: bool = True
    message: str = ""
    names: tuple[str, ...] = ()


def controller_services(controller: Controller) -> tuple[Service, ...]:
    """What a controller offers as `<controller>/<service>`."""

    def names(_request: JointNamesRequest) -> JointNamesReply:
        return JointNamesReply(names=controller.joints)

    return (Service("get_joint_names", "solfer/GetJointNames", JointNamesRequest, JointNamesReply, names),)
