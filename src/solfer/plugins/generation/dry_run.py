"""A dry run: a plugin is generated as at its start, but connects to nothing, to find all mistakes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from solfer.config import (
    CalibrationRecord,
    Configuration,
    ControllerRecord,
    FeedbackRecord,
    MappingRecord,
    Part,
    SourceRecord,
)
from solfer.config.records.middlewares import MIDDLEWARE_MAPS as MIDDLEWARE_MAPS
from solfer.config.records.sources import TextRecord
from solfer.config.yaml.files import read_text
from solfer.errors import MiddlewareError, SolferError, UnknownName
from solfer.interfaces.declaration import Declaration, Service
from solfer.model import Description, Kinematics, Semantics
from solfer.model.urdf.cut import cut
from solfer.plugins.generation.generator import Generator
from solfer.robot.defaults import ACTUATED, ALL, MODEL_MAPS
from solfer.robot.names import FEEDBACK_MAP, LOWER_LEVEL_MAP, controller_map
from solfer.robot.shipped import ControllerGroups, RobotFiles
from solfer.transport import Middleware
from solfer.transport.endpoints import MessageStatus, NullWriter, Publisher, Queue, Reader, Writer
from solfer.transport.health import Health
from solfer.transport.messages import canonical
from solfer.transport.middleware import HealthReport, Submit
from solfer.transport.topics import Topics

DRY_RUN_RATE = 100.0
"""Rate of a plugin whose own has a mistake [Hz]."""


class UnknownComponent(Generator):
    """Generates all of a plugin but its component, which is not there, or cannot be used."""

    known = False


class DryReader(Reader):
    """Receives nothing.

    Args:
        topic: Name of the topic.
        message: Its message.
    """

    def __init__(self, topic: str, message: str):
        self.topic = topic
        self.carries = message

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        return MessageStatus.NONE

    def update(self) -> Sequence[Publisher]:
        """See `Reader.update`."""
        return ()

    def read_from(self, publisher: Publisher) -> MessageStatus:
        """See `Reader.read_from`."""
        return MessageStatus.NONE

    def age(self) -> float:
        """See `Reader.age`."""
        return float("inf")


class DryWriter(NullWriter):
    """Sends nothing.

    Args:
        topic: Name of the topic.
        message: Its message.
    """

    def __init__(self, topic: str, message: str):
        super().__init__(topic)
        self.carries = message


class DryQueue(Queue):
    """Receives nothing.

    Args:
        topic: Name of the topic.
    """

    def __init__(self, topic: str):
        self.topic = topic

    def drain(self) -> list[Any]:
        """See `Queue.drain`."""
        return []


class DryMiddleware(Middleware):
    """Connects to nothing, and knows of the outside only what the files of the robot contain.

    Args:
        configuration: The plugin's configuration.
        files: The robot's files.
    """

    def __init__(self, configuration: Configuration, files: RobotFiles):
        self.name = configuration.module.name
        self._configuration = configuration
        self._files = files
        self._texts = dict(_texts(configuration.sources, files))
        self._models = {record.urdf.parameter for record in configuration.mappings.values() if record.urdf is not None}
        self._services: set[str] = set()

    def now(self) -> float:
        """See `Middleware.now`; no time passes."""
        return 0.0

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`."""

    def publish_time(self, simulated: float) -> None:
        """See `Middleware.publish_time`."""

    def running(self) -> bool:
        """See `Middleware.running`."""
        return False

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`; of a description, or `/robot_<part>` for a part of the robot."""
        for part in self._files.parts:
            if name.lstrip("/") == f"robot_{part.name}":
                return _part(read_text(str(self._files.urdf)), part.link, part.keep)
        source = self._texts.get(name) or (self._files.urdf if name in self._models else None)
        if source is None:
            raise UnknownName("parameter", name, self._texts, where=where)
        return read_text(str(source), where)

    def reader(self, topic: str, message: str, kept: int = 0) -> Reader:
        """See `Middleware.reader`."""
        return DryReader(topic, message)

    def queue(self, topic: str, message: str, size: int = 64, largest: int | None = None) -> Queue:
        """See `Middleware.queue`."""
        return DryQueue(topic)

    def writer(self, topic: str, message: str) -> Writer:
        """See `Middleware.writer`."""
        return DryWriter(topic, message)

    def joint_order(self, topic: str, message: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.joint_order`; all DoFs, since it is not known which ones a message will have."""
        canonical(message, where)
        pipes = [record for record in self._configuration.feedbacks if record.source == topic]
        return self._of_hardware(_kinematics(self._files).dofs, pipes[0].calibration if pipes else None)

    def controller_joints(self, controller: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.controller_joints`; without a bundle of the robot every DoF that has a drive."""
        known = {each.name: each for each in self._files.controllers}
        if known and controller not in known:
            raise UnknownName("lower-level controller", controller, known, where=where)
        pipe = next(record for record in self._configuration.controllers if record.leads_to == controller)
        return self._of_hardware(_driven(self._files, known.get(controller)), pipe.calibration)

    def controller_gains(self, controller: str, timeout: float, where: str = "") -> dict[str, tuple[float, float]]:
        """See `Middleware.controller_gains`; all are zero."""
        return dict.fromkeys(self.controller_joints(controller, timeout, where), (0.0, 0.0))

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """See `Middleware.call`; there is no reply."""
        raise MiddlewareError(
            f"the service '{name}' is asked for while the plugin is made", expected="a call in `init`"
        )

    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """See `Middleware.request`; there is no reply."""
        return Future()

    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """See `Middleware.serve`."""
        for service in services:
            if service.name in self._services:
                raise MiddlewareError(f"service '{owner}/{service.name}' is offered twice", expected="another name")
            self._services.add(service.name)

    def topics(self) -> "Future[Topics]":
        """See `Middleware.topics`; there are none."""
        answer: Future[Topics] = Future()
        answer.set_result(Topics())
        return answer

    def report(self, name: str, level: Health, summary: str, values: Mapping[str, float | str]) -> None:
        """See `Middleware.report`."""

    def reports(self) -> Mapping[str, HealthReport]:
        """See `Middleware.reports`."""
        return {}

    def close(self) -> None:
        """See `Middleware.close`."""

    def _first_order(self, topic: str, message: str, timeout: float) -> tuple[str, tuple[str, ...] | None]:
        """See `Middleware._first_order`."""
        return topic, None

    def _of_hardware(self, joints: tuple[str, ...], calibration: str | None) -> tuple[str, ...]:
        """Translate joints into the hardware's names, which the other end of a calibrated pipe uses."""
        record = self._configuration.calibrations.get(calibration or "")
        return joints if record is None else tuple(_hardware_name(record, joint) for joint in joints)


def dry_run(part: Part, generator: type[Generator], files: RobotFiles, whole: bool) -> list[SolferError]:
    """Generate a plugin as far as possible, and return all errors.

    Args:
        part: Its configuration, as far as it could be read.
        generator: Its generator, or `UnknownComponent`.
        files: The files of its robot.
        whole: Whether the configuration is free of mistakes so far; if not, what needs its missing parts is left out.
    """
    configuration = known_without_robot(part.assumed(DRY_RUN_RATE), files, whole)
    generation = generator(configuration, DryMiddleware(configuration, files))
    plugin = generation.attempt(whole)
    if plugin is not None:
        plugin.close()
    return generation.faults


def declared(configuration: Configuration, generator: type[Generator], files: RobotFiles) -> tuple[Declaration, ...]:
    """Return what the component of a plugin declares, and its generator; see `dry_run`.

    Raises:
        SolferError: A part of the plugin cannot be made.
        SolferErrors: Several of these.
    """
    generation = generator(known_without_robot(configuration, files, True), DryMiddleware(configuration, files))
    plugin = generation.plugin()
    try:
        return generation.declarations(plugin.component)
    finally:
        plugin.close()


def known_without_robot(configuration: Configuration, files: RobotFiles, whole: bool) -> Configuration:
    """Return a configuration without what only the running robot knows, and what mistakes keep from being made.

    Args:
        configuration: The configuration.
        files: The files of its robot.
        whole: Whether it is free of mistakes.
    """
    known = _known(configuration, files)
    return known if whole else _makeable(known, files)


def _known(configuration: Configuration, files: RobotFiles) -> Configuration:
    """Leave out what only the running robot knows: contacts and actuators of a parameter."""
    sources = configuration.sources
    robot = configuration.robot
    if sources is None or sources.urdf is None or not sources.urdf.given:
        given = {key: _as_source(path) for key, path in (("urdf", files.urdf), ("srdf", files.srdf)) if path}
        sources = (sources or SourceRecord()).model_copy(update=given)
    unknown = [key for key in ("actuators", "contacts") if _unseen(getattr(sources, key), getattr(files, key))]
    choices = {key: getattr(robot, key).model_copy(update={"read": False}) for key in unknown}
    configuration = replace(configuration, sources=sources, robot=robot.model_copy(update=choices))
    if "contacts" in unknown:
        return _filtered(configuration, lambda record: not record.content.contacts)
    return configuration


def _unseen(source: TextRecord | None, file: Path | None) -> bool:
    return source is None or (source.file is None and file is None)


def _as_source(path: Path) -> TextRecord:
    return TextRecord(file=str(path.absolute()))


def _makeable(configuration: Configuration, files: RobotFiles) -> Configuration:
    """Leave out the pipes that need a map or a calibration which a mistake keeps from being made.

    The whole robot, which has all names, stands in for models of maps with mistakes.
    """
    named = configuration.tree.get(configuration.section, "mapping")
    whole = MappingRecord(name="", loading="model", urdf=_as_source(files.urdf))
    mappings = {**{name: whole for name, _ in (named.items() if named else ())}, **configuration.mappings}
    configuration = replace(configuration, mappings=mappings)
    maps = set(_maps(configuration))
    return _filtered(
        configuration,
        lambda record: (
            (record.calibration is None or record.calibration in configuration.calibrations)
            and (record.dofs is None or record.dofs.mapping in maps)
        ),
    )


def _maps(configuration: Configuration) -> Iterator[str]:
    """Yield the maps that the Robot of an incomplete configuration gets."""
    yield from (*MODEL_MAPS, ACTUATED, *MIDDLEWARE_MAPS, *configuration.mappings)
    if any(record.measures_joints for record in configuration.feedbacks):
        yield FEEDBACK_MAP
    for record in configuration.controllers:
        if record.lower_level:
            yield from (controller_map(record.leads_to), LOWER_LEVEL_MAP)


def _filtered(configuration: Configuration, keeps: Callable[[Any], bool]) -> Configuration:
    feedbacks: tuple[FeedbackRecord, ...] = tuple(filter(keeps, configuration.feedbacks))
    controllers: tuple[ControllerRecord, ...] = tuple(filter(keeps, configuration.controllers))
    return replace(configuration, feedbacks=feedbacks, controllers=controllers)


def _texts(sources: SourceRecord, files: RobotFiles) -> Iterator[tuple[str, Path]]:
    """Yield the parameters of the descriptions, each with the file that has the same text."""
    for key in ("urdf", "srdf", "actuators", "contacts"):
        source = getattr(sources, key)
        file = getattr(files, key)
        if source is not None and source.parameter is not None and file is not None:
            yield source.parameter, file


def _hardware_name(calibration: CalibrationRecord, joint: str) -> str:
    return calibration.hardware(joint) if joint in calibration.joints else joint


def _driven(files: RobotFiles, controller: ControllerGroups | None) -> tuple[str, ...]:
    """Return the joints of a controller, or all that move."""
    kinematics = _kinematics(files)
    moving = kinematics.dofs[0 if kinematics.base is None else 6 :]
    if controller is None:
        return moving
    members, left_out = (_members(files, group, moving) for group in (controller.group, controller.without))
    return tuple(joint for joint in moving if joint in members and (not controller.without or joint not in left_out))


def _members(files: RobotFiles, group: str | None, moving: tuple[str, ...]) -> tuple[str, ...]:
    groups = {} if files.srdf is None else _semantics(read_text(str(files.srdf)), read_text(str(files.urdf))).groups
    return groups[group].joints if group != ALL and group in groups else moving


def _kinematics(files: RobotFiles) -> Kinematics:
    return _model(read_text(str(files.urdf)), files.floating_base)


@lru_cache(maxsize=4)
def _model(urdf: str, floating_base: bool | None) -> Kinematics:
    return Kinematics(Description.from_text(urdf, "URDF"), floating_base)


@lru_cache(maxsize=4)
def _semantics(srdf: str, urdf: str) -> Semantics:
    return Semantics.from_text(srdf, Description.from_text(urdf, "URDF"))


@lru_cache(maxsize=8)
def _part(urdf: str, link: str, keep: str) -> str:
    return cut(Description.from_text(urdf, "URDF"), link, keep)
