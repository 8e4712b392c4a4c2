"""Services that a controller of the lower level offers."""

from solfer.components.declaration import Service
from solfer.lower_level.controller import Controller
from solfer.pipes.middleware import JOINT_NAMES, JointNames, NoFields


def controller_services(controller: Controller) -> tuple[Service, ...]:
    """What a controller offers as `<controller>/<service>`."""

    def names(_request: NoFields) -> JointNames:
        return JointNames(names=controller.joints)

    return (Service("get_joint_names", JOINT_NAMES, NoFields, JointNames, names),)
