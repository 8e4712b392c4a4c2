"""Builds the Robot that a configuration describes, with all its maps."""

import logging
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from solfer.config import (
    CalibrationRecord,
    Configuration,
    ControllerRecord,
    FeedbackRecord,
    MappingRecord,
    PipeRecord,
    Problems,
)
from solfer.errors import MiddlewareError, SolferError, raise_all
from solfer.model import BidirectionalMap, Description, Kinematics
from solfer.model.contacts import ContactRecord
from solfer.robot.defaults import undescribed
from solfer.robot.files import own_contacts
from solfer.robot.hardware_names import commanded_joints, received_joints
from solfer.robot.names import FEEDBACK, LOWER_LEVEL, RobotNames, check_names, controller_map
from solfer.robot.robot import Robot
from solfer.robot.sources import Outside, read_actuators, read_contacts, read_description, read_semantics

TIMEOUT, SHORT_TIMEOUT = 10.0, 0.5
"""How long the builder waits for a first message or a controller; after one did not answer, for each other [s]."""

_LOG = logging.getLogger(__name__)


def build(configuration: Configuration, outside: Outside, beside: Robot | None = None) -> Robot:
    """Build the Robot of a configuration.

    Besides the maps that every Robot has, it gets the predefined ones (Listing 1 of the paper); `ros_control::<name>`
    for each lower-level controller that the plugin commands, and `LOWER_LEVEL` for all of them together; and
    `FEEDBACK`, the order of the first feedback of the measured joints. A predefined map that no pipe uses is left out
    if its source is not there. In mode `idle`, which sends no command, all actuated DoFs in the Robot's order replace
    the joints of a controller that does not answer.

    Args:
        configuration: One module, merged.
        outside: The middleware, for parameters, orders of topics and joints of controllers.
        beside: Another Robot; with the same URDF both have the same kinematics and measured numbers.

    Raises:
        SolferError: Something that the configuration names is missing, or does not fit the robot.
        SolferErrors: Several of these.
    """
    return _Builder(configuration, outside).robot(beside)


class _Builder:
    """Steps of `build`; mistakes that do not keep the next step from working are collected."""

    def __init__(self, configuration: Configuration, outside: Outside):
        self._configuration, self._outside = configuration, outside
        self._faults: list[SolferError] = []
        self._patience = TIMEOUT

    def robot(self, beside: Robot | None) -> Robot:
        sources = self._configuration.sources
        description = read_description(sources.urdf, self._outside)
        models = dict(self._models())
        if beside is not None and beside.description.text != description.text:
            beside = None
        kinematics = Kinematics(description) if beside is None else beside.kinematics
        semantics = actuators = None
        others = tuple(models.values())
        if sources.srdf is not None:
            semantics = self._try(lambda: read_semantics(sources.srdf, self._outside, description, others))
        if self._configuration.robot.actuators.read:
            actuators = self._try(lambda: read_actuators(self._configuration, self._outside, kinematics.dofs, others))
        if beside is not None and (actuators or undescribed(kinematics)) != beside.actuators:
            beside, kinematics = None, Kinematics(description)
        contacts: tuple[ContactRecord, ...] = ()
        if self._configuration.robot.contacts.read:
            records = self._try(lambda: read_contacts(self._configuration, self._outside))
            contacts = own_contacts(records or (), description, others)
        robot = Robot(kinematics, semantics, actuators, self._configuration.robot.name, contacts, beside)
        if not self._faults:
            problems = Problems()
            check_names(self._configuration, RobotNames.of_robot(robot, others), problems)
            self._faults += problems.errors
        raise_all(self._faults)
        for name, model in models.items():
            self._add_model(robot, name, model)
        self._add_topic_maps(robot)
        self._add_lower_level(robot)
        raise_all(self._faults)
        return robot

    def _models(self) -> Iterator[tuple[str, Description]]:
        """Yield the models of the predefined maps; one that no pipe uses may be missing."""
        for name, record in self._configuration.mappings.items():
            if record.loading != "model":
                continue
            try:
                yield name, read_description(record.urdf, self._outside)
            except SolferError as error:
                if self._used(name):
                    self._faults.append(error.at(record.where("urdf")))
                else:
                    _LOG.info("the map '%s', which no pipe uses, is left out: %s", name, error)

    def _add_model(self, robot: Robot, name: str, model: Description) -> None:
        where = self._configuration.mappings[name].where("urdf")
        kinematics = self._try(lambda: Kinematics(model), where)
        if kinematics is not None:
            self._add(robot, name, kinematics.dofs, where)

    def _add_topic_maps(self, robot: Robot) -> None:
        """Add maps in the order of a message; a map in use waits for the first one."""
        for name, record in self._configuration.mappings.items():
            if record.loading == "topic" and self._used(name):
                self._add_topic(robot, name, record, record.where("source"))
        default = self._default_feedback()
        if default is not None and FEEDBACK not in self._configuration.mappings:
            self._add_topic(robot, FEEDBACK, default, default.where("source"))

    def _default_feedback(self) -> FeedbackRecord | None:
        """Return the first feedback of measured joints, if it is required at the start or a pipe uses its order."""
        for record in self._configuration.feedbacks:
            if record.space == "JOINT" and record.function == "state" and record.source is not None:
                return record if record.initialize or self._used(FEEDBACK) else None
        return None

    def _add_topic(self, robot: Robot, name: str, record: FeedbackRecord | MappingRecord, where: str) -> None:
        message = record.message or "sensor_msgs/JointState"
        order = self._wait(lambda timeout: self._outside.joint_order(record.source, message, timeout, where))
        pipe = record if isinstance(record, FeedbackRecord) else self._user(name)
        if order is not None and pipe is not None and pipe.calibration is not None:
            order = self._try(lambda: received_joints(pipe, self._calibration(pipe), robot, order))
        if order is not None:
            self._add(robot, name, order, where)

    def _add_lower_level(self, robot: Robot) -> None:
        """Add maps of the controllers that the plugin commands."""
        joints: dict[str, None] = {}
        idle = self._configuration.module.mode == "idle"
        for record in self._lower_level():
            order = (
                self._try(partial(self._idle_joints, record, robot))
                if idle
                else self._wait(partial(self._controller_joints, record))
            )
            if order is not None:
                self._add(robot, controller_map(record.name), order, record.where())
                joints |= dict.fromkeys(order)
        if joints and LOWER_LEVEL not in self._configuration.mappings:
            self._add(robot, LOWER_LEVEL, tuple(joints), "")

    def _controller_joints(self, record: ControllerRecord, timeout: float) -> tuple[str, ...]:
        order = self._outside.controller_joints(record.name, timeout, record.where())
        return order if record.calibration is None else commanded_joints(record, self._calibration(record), order)

    def _idle_joints(self, record: ControllerRecord, robot: Robot) -> tuple[str, ...]:
        """Return the controller's joints, or the Robot's if it does not answer: nothing is sent in mode `idle`."""
        try:
            return self._controller_joints(record, SHORT_TIMEOUT)
        except MiddlewareError as error:
            _LOG.info("%s; the Robot's joints are used instead, since nothing is sent", error.line)
            return tuple(robot.dofs[dof] for dof in robot.actuated)

    def _calibration(self, pipe: PipeRecord) -> CalibrationRecord:
        return self._configuration.calibrations[pipe.calibration]

    def _lower_level(self) -> list[ControllerRecord]:
        return [record for record in self._configuration.controllers if record.lower_level]

    def _used(self, name: str) -> bool:
        """Return whether a pipe of this plugin names the map."""
        pipes = (*self._configuration.feedbacks, *self._configuration.controllers)
        return any(name in (pipe.dofs.mapping, pipe.dofs.type) for pipe in pipes if pipe.dofs)

    def _user(self, name: str) -> FeedbackRecord | None:
        """Return the first feedback that is in the order of the map `name`."""
        received = (record for record in self._configuration.feedbacks if record.dofs)
        return next((record for record in received if record.dofs.mapping == name), None)

    def _add(self, robot: Robot, name: str, external: tuple[str, ...], where: str) -> None:
        self._try(lambda: robot.maps.add(BidirectionalMap(name, robot.dofs, external)), where)

    def _wait(self, ask: Callable[[float], Any]) -> Any:
        """Call like `_try`, where an answer may be missing; `ask` gets the time that it may wait [s]."""
        faults = len(self._faults)
        answer = self._try(lambda: ask(self._patience))
        if len(self._faults) > faults:
            self._patience = SHORT_TIMEOUT
        return answer

    def _try(self, call: Callable[[], Any], where: str = "") -> Any:
        """Return the result of a call, None if it fails: then its error is kept for the end."""
        try:
            return call()
        except SolferError as error:
            self._faults.append(error.at(where))
            return None
