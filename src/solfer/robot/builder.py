"""Builds the Robot that a configuration describes, with all its maps."""

import logging
from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from typing import Any

import numpy as np

from solfer.config import (
    CalibrationRecord,
    Configuration,
    ControllerRecord,
    FeedbackRecord,
    MappingRecord,
    PipeRecord,
    Problems,
)
from solfer.config.records.middlewares import MIDDLEWARES, PREDEFINED_MAPS
from solfer.config.records.pipes import JOINT_COMMAND
from solfer.errors import MiddlewareError, ServiceUnavailable, SolferError, UnknownName, raise_all
from solfer.model import BidirectionalMap, Description, Kinematics
from solfer.model.contacts import ContactRecord
from solfer.robot.description.files import own_contacts
from solfer.robot.description.shipped import with_bundled_base
from solfer.robot.description.sources import (
    Outside,
    is_robot_read,
    read_actuators,
    read_contacts,
    read_description,
    read_semantics,
)
from solfer.robot.hardware_names import commanded_joints, received_joints
from solfer.robot.names import (
    FEEDBACK_MAP,
    LOWER_LEVEL_MAP,
    LOWER_LEVEL_MAPS,
    UNACTUATED,
    RobotNames,
    check_names,
    controller_map,
)
from solfer.robot.robot import Robot
from solfer.robot.selection import commanded_dofs, select

logger = logging.getLogger(__name__)


def build(
    configuration: Configuration,
    outside: Outside,
    beside: Robot | None = None,
    faults: list[SolferError] | None = None,
) -> Robot:
    """Build the Robot of a configuration.

    Besides the maps that every Robot has, it gets the predefined ones (Listing 1 of the paper); `ros_control::<name>`
    for each lower-level controller that the plugin commands, and `LOWER_LEVEL` for all of them together; and
    `FEEDBACK`, the order of the first feedback of the measured joints, then the commanded ones that it lacks: the
    plugin waits until they are measured, too. In a real-time layer `XBOT` is the order in
    which the lower level publishes and receives its joints. A predefined map that no pipe uses is left out
    if its source is not there. In mode `idle`, which sends no command, all actuated DoFs in the Robot's order replace
    the joints of a controller that does not answer.

    Args:
        configuration: One module, merged.
        outside: The middleware, for parameters, orders of topics and joints of controllers.
        beside: The Robot of another component, described alike, of which this one becomes a companion.
        faults: Receives the errors instead of an exception, as long as there is a Robot at all, with which to look for
            others. After the first one no order is requested outside: the Robot's own order replaces all others.

    Raises:
        SolferError: Something that the configuration names is missing, or does not fit the robot.
        SolferErrors: Several of these.
    """
    builder = _Builder(configuration, outside, faults is not None)
    robot = builder.robot(beside)
    if faults is not None:
        faults += builder.faults
    return robot


class _Builder:
    """Steps of `build`; mistakes that do not keep the next step from working are collected."""

    _SHORT_TIMEOUT = 0.5  # for an answer after one was missing, or that nothing depends on [s]

    def __init__(self, configuration: Configuration, outside: Outside, goes_on: bool):
        self._configuration = configuration
        self._outside = outside
        self._goes_on = goes_on
        self.faults: list[SolferError] = []
        self._timeout = 10.0  # for the first message or the joints of a controller [s]
        self._waits = True

    def robot(self, beside: Robot | None) -> Robot:
        models = dict(self._models())
        others = tuple(models.values())
        robot = self._described(others) if beside is None else beside.companion()
        if not self.faults:
            problems = Problems()
            check_names(self._configuration, RobotNames.of_robot(robot, others), problems)
            self.faults += problems.errors
        self._raise()
        self._waits = not self.faults
        for name, model in models.items():
            self._add_model(robot, name, model)
        self._add_lower_level(robot)
        self._add_topic_maps(robot)
        self._add_middleware_map(robot)
        self._raise()
        return robot

    def _described(self, others: tuple[Description, ...]) -> Robot:
        """Read the descriptions of a Robot; `others` are models with names that its own does not have."""
        sources = self._configuration.sources
        description = with_bundled_base(self._configuration, read_description(sources.urdf, self._outside))
        kinematics = Kinematics(description)
        semantics = actuators = None
        is_known = is_robot_read(self._configuration)
        if sources.srdf is not None:
            semantics = self._try(lambda: read_semantics(sources.srdf, self._outside, description, others=others))
        if self._configuration.robot.actuators.read and is_known:
            actuators = self._try(
                lambda: read_actuators(self._configuration, self._outside, kinematics.dofs, others=others)
            )
        contacts: tuple[ContactRecord, ...] = ()
        if self._configuration.robot.contacts.read and is_known:
            records = self._try(lambda: read_contacts(self._configuration, self._outside))
            contacts = own_contacts(records or (), description, others)
        return Robot(
            kinematics, semantics, actuators, name=self._configuration.robot.name, contacts=contacts, others=others
        )

    def _raise(self) -> None:
        if not self._goes_on:
            raise_all(self.faults)

    def _models(self) -> Iterator[tuple[str, Description]]:
        """Yield the models of the predefined maps; one that no pipe uses may be missing."""
        for name, record in self._configuration.mappings.items():
            if record.loading != "model":
                continue
            try:
                yield name, read_description(record.urdf, self._outside)
            except SolferError as error:
                if self._used(name):
                    self.faults.append(error.at(record.where("urdf")))
                else:
                    logger.info("the map '%s', which no pipe uses, is left out: %s", name, error)

    def _add_model(self, robot: Robot, name: str, model: Description) -> None:
        where = self._configuration.mappings[name].where("urdf")
        dofs = self._try(lambda: _dofs(model.text, model.where), where)
        if dofs is not None:
            self._add(robot, name, dofs, where=where)

    def _add_topic_maps(self, robot: Robot) -> None:
        """Add maps in the order of messages; a map in use waits for the first one."""
        for name, record in self._configuration.mappings.items():
            if record.loading == "topic" and self._used(name):
                self._add_topic(robot, name, record, where=record.where("source"))
        default = self._default_feedback()
        if default is not None and FEEDBACK_MAP not in self._configuration.mappings:
            self._add_topic(robot, FEEDBACK_MAP, default, where=default.where("source"))

    def _default_feedback(self) -> FeedbackRecord | None:
        """Return the first feedback of measured joints, if it is required at the start or a pipe uses its order."""
        for record in self._configuration.feedbacks:
            if record.measures_joints and record.source is not None:
                return record if record.initialize or any(map(self._used, (FEEDBACK_MAP, *PREDEFINED_MAPS))) else None
        return None

    def _add_topic(self, robot: Robot, name: str, record: FeedbackRecord | MappingRecord, where: str) -> None:
        if not self._waits:
            self._add(robot, name, robot.dofs, where=where)
            return
        message = record.travels_as if isinstance(record, FeedbackRecord) else record.message
        order = self._wait(partial(self._joint_order, record, message or "sensor_msgs/JointState", where))
        pipe = record if isinstance(record, FeedbackRecord) else self._user(name)
        if order is not None and pipe is not None and pipe.calibration is not None:
            order = self._try(lambda: received_joints(pipe, self._calibration(pipe), robot, order=order))
        if order is not None:
            if pipe is not None and pipe.measures_joints and pipe.source == record.source:
                order = tuple(dict.fromkeys((*order, *self._commanded(robot, name, pipe))))
            self._add(robot, name, self._with_base(robot, name, order), where=where)

    def _commanded(self, robot: Robot, name: str, feedback: FeedbackRecord) -> list[str]:
        """List the joints of a `feedback` in the map `name` that are commanded and that no other map measures."""
        if self._configuration.module.mode == "idle":
            return []
        free = select(feedback.dofs, robot)
        for other in self._configuration.feedbacks:
            if other.measures_joints and other.dofs.mapping != name:
                free = np.setdiff1d(free, select(other.dofs, robot))
        commanded = [commanded_dofs(record, robot) for record in self._lower_level()]
        return [robot.dofs[dof] for dof in np.intersect1d(free, np.concatenate(commanded))] if commanded else []

    def _with_base(self, robot: Robot, name: str, order: tuple[str, ...]) -> tuple[str, ...]:
        """Add the floating base's DoFs to the order of a robot, where a pipe carries them in it.

        No robot measures or drives its base like a joint: orders from outside lack it (Listing 14 of the paper).
        """
        carried = any(pipe.dofs.type == UNACTUATED and pipe.dofs.mapping == name for pipe in self._joint_pipes())
        base = robot.dofs[:6] if carried and robot.kinematics.base is not None else ()
        return (*order, *(dof for dof in base if dof not in order))

    def _joint_pipes(self) -> Iterator[PipeRecord]:
        for pipe in (*self._configuration.feedbacks, *self._configuration.controllers):
            if pipe.dofs:
                yield pipe

    def _joint_order(
        self, record: FeedbackRecord | MappingRecord, message: str, where: str, timeout: float
    ) -> tuple[str, ...]:
        try:
            return self._outside.joint_order(record.source, message, timeout, where)
        except UnknownName as error:  # of the message
            error.where = record.where("message")
            raise
        except SolferError as error:
            raise error.at(where) from None

    def _add_lower_level(self, robot: Robot) -> None:
        """Add maps of the controllers that the plugin commands."""
        joints: dict[str, None] = {}
        idle = self._configuration.module.mode == "idle"
        for record in self._lower_level():
            if not self._waits:
                order = _actuated(robot)
            elif idle:
                order = self._try(partial(self._idle_joints, record, robot))
            else:
                order = self._wait(partial(self._commanded_joints, record, robot)) or _actuated(robot)
            if order is not None:
                own = controller_map(record.leads_to)
                named = record.dofs.mapping if record.dofs.mapping in LOWER_LEVEL_MAPS else own
                if own not in robot.maps:
                    self._add(robot, own, self._with_base(robot, named, order), where=record.where())
                joints |= dict.fromkeys(order)
        if joints and LOWER_LEVEL_MAP not in self._configuration.mappings:
            self._add(robot, LOWER_LEVEL_MAP, self._with_base(robot, LOWER_LEVEL_MAP, tuple(joints)), where="")

    def _add_middleware_map(self, robot: Robot) -> None:
        """Add the map of the middleware's order, if it has one, which is that of the lower level."""
        name = MIDDLEWARES[self._configuration.middleware].map
        order = next(
            (robot.maps[each].external for each in (FEEDBACK_MAP, LOWER_LEVEL_MAP) if each in robot.maps), None
        )
        if name is not None and name not in self._configuration.mappings and order is not None:
            self._add(robot, name, self._with_base(robot, name, order), where="")

    def _controller_joints(self, record: ControllerRecord, timeout: float) -> tuple[str, ...]:
        order = self._outside.controller_joints(record.leads_to, timeout, record.where())
        return order if record.calibration is None else commanded_joints(record, self._calibration(record), order)

    def _commanded_joints(self, record: ControllerRecord, robot: Robot, timeout: float) -> tuple[str, ...]:
        """Return the controller's joints; those of the pipe if a node receives its commands and does not name them."""
        unknowing = 2.0  # time after which it counts that a node receives the commands [s]
        topic = record.leads_to + (record.sink or "/command")
        try:
            return self._controller_joints(record, min(unknowing, timeout))
        except ServiceUnavailable:
            is_received = self._outside.is_received(topic, JOINT_COMMAND)
        try:
            # the service of a lower level that has just started may follow its subscription
            return self._controller_joints(record, self._SHORT_TIMEOUT if is_received else timeout - unknowing)
        except ServiceUnavailable as error:
            if not is_received:
                raise
            joints = tuple(robot.dofs[dof] for dof in np.intersect1d(select(record.dofs, robot), robot.actuated))
            logger.warning("%s; commands are for %s", error.what, ", ".join(joints))
            return joints

    def _idle_joints(self, record: ControllerRecord, robot: Robot) -> tuple[str, ...]:
        """Return the controller's joints, or the Robot's if it does not answer: nothing is sent in mode `idle`."""
        try:
            return self._controller_joints(record, self._SHORT_TIMEOUT)
        except MiddlewareError as error:
            logger.info("%s; the Robot's joints are used instead, since nothing is sent", error.line)
            return _actuated(robot)

    def _calibration(self, pipe: PipeRecord) -> CalibrationRecord:
        return self._configuration.calibrations[pipe.calibration]

    def _lower_level(self) -> list[ControllerRecord]:
        return [record for record in self._configuration.controllers if record.lower_level]

    def _used(self, name: str) -> bool:
        """Return whether a pipe of this plugin names the map."""
        return any(name in (pipe.dofs.mapping, pipe.dofs.type) for pipe in self._joint_pipes())

    def _user(self, name: str) -> FeedbackRecord | None:
        """Return the first feedback that is in the order of the map `name`."""
        received = (record for record in self._configuration.feedbacks if record.dofs)
        return next((record for record in received if record.dofs.mapping == name), None)

    def _add(self, robot: Robot, name: str, external: tuple[str, ...], where: str) -> None:
        self._try(lambda: robot.maps.add(BidirectionalMap(name, robot.dofs, external)), where)

    def _wait(self, query: Callable[[float], Any]) -> Any:
        """Call like `_try`, where an answer may be missing; `query` gets the time that it may wait [s]."""
        faults = len(self.faults)
        answer = self._try(lambda: query(self._timeout))
        if len(self.faults) > faults:
            self._timeout = self._SHORT_TIMEOUT
        return answer

    def _try(self, call: Callable[[], Any], where: str = "") -> Any:
        """Return the result of a call, None if it fails: then its error is kept for the end."""
        try:
            return call()
        except SolferError as error:
            self.faults.append(error.at(where))
            return None


def _actuated(robot: Robot) -> tuple[str, ...]:
    return tuple(robot.dofs[dof] for dof in robot.actuated)


@lru_cache(maxsize=8)
def _dofs(urdf: str, where: str) -> tuple[str, ...]:
    """Return the DoFs of a model, which several plugins of a process may have maps to."""
    return Kinematics(Description.from_text(urdf, where)).dofs
