"""Services of the lower level and of its controllers. Handlers run between two cycles."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from solfer.components.declaration import Service
from solfer.config import read
from solfer.config.files import located
from solfer.errors import ConfigError, UnknownName
from solfer.lower_level.claim_request import wanted
from solfer.lower_level.controller import Controller, ImpedanceController
from solfer.lower_level.lower_level import LowerLevel
from solfer.lower_level.records import GainsRecord
from solfer.pipes.lower_level import CLAIM, RELEASE, Answer, ClaimRequest, ReleaseRequest
from solfer.pipes.middleware import JOINT_NAMES, JointNames, NoFields


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


@dataclass(frozen=True)
class SwitchRequest:
    """Controllers to start and to stop."""

    start: tuple[str, ...] = ()
    stop: tuple[str, ...] = ()


@dataclass(frozen=True)
class FileRequest:
    """A file on the machine of the lower level."""

    file: str


@dataclass(frozen=True)
class FlagRequest:
    """On or off."""

    data: bool


def lower_level_services(lower_level: LowerLevel) -> tuple[Service, ...]:
    """What a lower level offers as `lower_level/<service>`."""

    def answer(work: Callable[[Any], None]) -> Callable[[Any], Answer]:
        def handler(request: Any) -> Answer:
            work(request)
            return Answer()

        return handler

    def controllers(_request: NoFields) -> ControllerList:
        items = lower_level.controllers.values()
        return ControllerList(
            names=tuple(lower_level.controllers), types=tuple(item.TYPE for item in items),
            states=tuple("running" if item.running else "stopped" for item in items),
            joints=tuple(" ".join(item.joints) for item in items),
            claimed_by=tuple(lower_level.claims.describe(item.name) for item in items))

    def claim(request: ClaimRequest) -> None:
        lower_level.claim(request.owner, wanted(lower_level.controllers, request))

    return (
        Service("claim", CLAIM, ClaimRequest, Answer, answer(claim)),
        Service("release", RELEASE, ReleaseRequest, Answer, answer(lambda request: lower_level.release(request.owner))),
        Service("list_controllers", "solfer/ListControllers", NoFields, ControllerList, controllers),
        Service("switch", "solfer/SwitchControllers", SwitchRequest, Answer,
                answer(lambda request: lower_level.switch(request.start, request.stop))),
        Service("emergency_stop", "std_srvs/Trigger", NoFields, Answer,
                answer(lambda _: lower_level.emergency_stop("asked for by service"))),
        Service("reset_emergency_stop", "std_srvs/Trigger", NoFields, Answer,
                answer(lambda _: lower_level.reset_emergency_stop())),
    )


def controller_services(controller: Controller, robot: str = "") -> tuple[Service, ...]:
    """What a controller offers as `<controller>/<service>`; `robot` is the key of its robot in gains files."""

    def names(_request: NoFields) -> JointNames:
        return JointNames(names=controller.joints)

    services = (Service("get_joint_names", JOINT_NAMES, NoFields, JointNames, names),)
    if not isinstance(controller, ImpedanceController):
        return services

    def set_ff_torque(request: FlagRequest) -> Answer:
        controller.feed_forward = request.data
        return Answer()

    def load(request: FileRequest) -> Answer:
        load_gains(controller, request.file, robot)
        return Answer()

    return (*services, Service("set_ff_torque", "std_srvs/SetBool", FlagRequest, Answer, set_ff_torque),
            Service("load_gains", "solfer/LoadGains", FileRequest, Answer, load))


def load_gains(controller: ImpedanceController, file: str, robot: str = "") -> None:
    """Give a controller the gains of a file, all or none; they come into force slowly.

    Args:
        controller: The controller.
        file: An absolute path or `package://...`.
        robot: Key of the robot's part in the file; empty: there is none.

    Raises:
        ConfigError, UnknownName, SolferErrors: The file is wrong, or has no gains for a joint of the controller.
    """
    path = located(file, "")
    if not path.is_absolute():
        raise ConfigError(f"'{file}' is not an absolute path", expected="a path from / on, or package://NAME/...")
    record = read(path, GainsRecord, (robot,) if robot else ())
    missing = [joint for joint in controller.joints if joint not in record.gains]
    if missing:
        raise UnknownName("joint", missing[0], record.gains, where=record.where("gains"),
                          expected=f"gains of every joint of controller '{controller.name}'")
    controller.load_gains([record.gains[joint].stiffness for joint in controller.joints],
                          [record.gains[joint].damping for joint in controller.joints])
