"""Services of the lower level and of its controllers. Handlers run between two cycles."""

from dataclasses import dataclass

from solfer.config.yaml.folders import Folders
from solfer.errors import Suspended
from solfer.interfaces.declaration import Service
from solfer.lower_level.claims.request import measured, requested
from solfer.lower_level.gains.file import Gains, read_gains
from solfer.lower_level.laws.controllers import ImpedanceController, LowerLevelController
from solfer.lower_level.lower_level import LowerLevel
from solfer.transport.lower_level import (
    CLAIM_INTERFACE,
    LOAD_GAINS,
    RELEASE,
    SWITCH_FEED_FORWARD,
    ClaimAnswer,
    ClaimRequest,
    FileRequest,
    ReleaseRequest,
    answered_service,
)
from solfer.transport.middleware import (
    CONTROLLER_GAINS,
    JOINT_NAMES,
    SWITCH,
    ControllerGains,
    Flag,
    JointNames,
    NoFields,
    SwitchRequest,
)


@dataclass(frozen=True)
class ControllerList:
    """Reply of `lower_level/list_controllers`: one element for each controller."""

    success: bool = True
    message: str = ""
    names: tuple[str, ...] = ()
    types: tuple[str, ...] = ()
    states: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    claimed_by: tuple[str, ...] = ()


def lower_level_services(lower_level: LowerLevel) -> tuple[Service, ...]:
    """Declare the services `lower_level/<service>` of a lower level."""

    def controllers(_request: NoFields) -> ControllerList:
        items = lower_level.controllers.values()
        return ControllerList(
            names=tuple(lower_level.controllers),
            types=tuple(item.TYPE for item in items),
            states=tuple("running" if item.running else "stopped" for item in items),
            joints=tuple(" ".join(item.joints) for item in items),
            claimed_by=tuple(lower_level.claims.describe(item.name) for item in items),
        )

    def claim(request: ClaimRequest) -> ClaimAnswer:
        try:
            again = lower_level.claim(
                request.owner,
                requested(lower_level.controllers, request),
                request.follows,
                measured(request),
            )
        except Suspended as error:
            return ClaimAnswer(False, error.line, later=True)
        return ClaimAnswer(again=again)

    return (
        Service("claim", CLAIM_INTERFACE, ClaimRequest, reply=ClaimAnswer, handler=claim),
        answered_service("release", RELEASE, ReleaseRequest, work=lambda request: lower_level.release(request.owner)),
        Service("list_controllers", "solfer/ListControllers", NoFields, reply=ControllerList, handler=controllers),
        answered_service(
            "switch", SWITCH, SwitchRequest, work=lambda request: lower_level.switch(request.start, request.stop)
        ),
        answered_service(
            "emergency_stop",
            "std_srvs/Trigger",
            NoFields,
            work=lambda _: lower_level.emergency_stop("asked for by service"),
            urgent=True,
        ),
        answered_service(
            "reset_emergency_stop", "std_srvs/Trigger", NoFields, work=lambda _: lower_level.reset_emergency_stop()
        ),
    )


def controller_services(controller: LowerLevelController, folders: Folders, robot: str = "") -> tuple[Service, ...]:
    """Declare the services `<controller>/<service>` of a controller.

    Args:
        controller: The controller.
        folders: Folders from which gains files may be read.
        robot: Key of its robot in them; empty: they have no such key.
    """

    def names(_request: NoFields) -> JointNames:
        return JointNames(names=controller.joints)

    services = (Service("get_joint_names", JOINT_NAMES, NoFields, reply=JointNames, handler=names),)
    if not isinstance(controller, ImpedanceController):
        return services

    def set_ff_torque(request: Flag) -> None:
        controller.feed_forward = request.data

    def gains(request: FileRequest) -> Gains:
        return read_gains(controller, request.file, folders, robot=robot)

    def reported(_request: NoFields) -> ControllerGains:
        gains = controller.default_gains
        return ControllerGains(
            names=controller.joints,
            stiffness=tuple(gains["stiffness"].tolist()),
            damping=tuple(gains["damping"].tolist()),
        )

    return (
        *services,
        Service("get_gains", CONTROLLER_GAINS, NoFields, reply=ControllerGains, handler=reported),
        answered_service("set_ff_torque", SWITCH_FEED_FORWARD, Flag, work=set_ff_torque),
        answered_service(
            "load_gains", LOAD_GAINS, FileRequest, work=lambda gains: controller.load_gains(*gains), prepare=gains
        ),
    )
