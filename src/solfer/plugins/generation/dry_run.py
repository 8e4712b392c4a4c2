"""What a plugin is generated with that connects to nothing: for a check, which finds all mistakes, and for a replay."""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from solfer.config import Configuration, ControllerRecord, FeedbackRecord, MappingRecord, SourceRecord, TextRecord
from solfer.config.records.middlewares import PREDEFINED_MAPS
from solfer.config.yaml.files import read_text
from solfer.errors import MiddlewareError, UnknownName
from solfer.interfaces.declaration import Declaration
from solfer.plugins.generation.generator import Generator
from solfer.robot.defaults import ACTUATED, MODEL_MAPS
from solfer.robot.description.shipped import RobotFiles
from solfer.robot.names import FEEDBACK_MAP, LOWER_LEVEL_MAP, controller_map
from solfer.transport.messages import canonical
from solfer.transport.unconnected import UnconnectedMiddleware


class DryMiddleware(UnconnectedMiddleware):
    """Connects to nothing, and knows of the outside only what the files of the robot contain.

    Args:
        configuration: The plugin's configuration.
        files: The robot's files.
        whole: Whether the configuration is free of mistakes; if not, its pipes that need missing parts are left out.

    Attributes:
        configuration: The configuration without what only the running robot knows.
    """

    def __init__(self, configuration: Configuration, files: RobotFiles, whole: bool = True):
        super().__init__(configuration.module.name)
        self.configuration = _known(configuration, files, whole)
        self._files = files
        self._texts = dict(_texts(self.configuration.sources, files))
        mappings = self.configuration.mappings.values()
        self._models = {record.urdf.parameter for record in mappings if record.urdf is not None}

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`; of a description, or `/robot_<part>` for a part of the robot."""
        for part in self._files.parts:
            if name.lstrip("/") == f"robot_{part.name}":
                return self._files.part(part)
        source = self._texts.get(name) or (self._files.urdf if name in self._models else None)
        if source is None:
            raise UnknownName("parameter", name, self._texts, where=where)
        return read_text(str(source), where)

    def joint_order(self, topic: str, message: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.joint_order`; all DoFs, since it is not known which ones a message will have."""
        canonical(message, where)
        pipes = (record for record in self.configuration.feedbacks if record.source == topic)
        return self._of_hardware(self._files.kinematics().dofs, next(pipes, None))

    def controller_joints(self, controller: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.controller_joints`; without a bundle of the robot every DoF that has a drive."""
        known = {each.name: each for each in self._files.controllers}
        if known and controller not in known:
            raise UnknownName("lower-level controller", controller, known, where=where)
        pipe = next(record for record in self.configuration.controllers if record.leads_to == controller)
        return self._of_hardware(self._files.driven(known.get(controller)), pipe)

    def controller_gains(self, controller: str, timeout: float, where: str = "") -> dict[str, tuple[float, float]]:
        """See `Middleware.controller_gains`; all are zero."""
        return dict.fromkeys(self.controller_joints(controller, timeout, where), (0.0, 0.0))

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """See `Middleware.call`; there is no reply."""
        raise MiddlewareError(
            f"the service '{name}' is asked for while the plugin is made", expected="a call in `init`"
        )

    def _of_hardware(self, joints: tuple[str, ...], pipe: FeedbackRecord | ControllerRecord | None) -> tuple[str, ...]:
        """Translate joints into the hardware's names, which the other end of a calibrated pipe uses."""
        record = None if pipe is None else self.configuration.calibrations.get(pipe.calibration or "")
        if record is None:
            return joints
        return tuple(record.hardware(joint) if joint in record.joints else joint for joint in joints)


def declared(configuration: Configuration, generator: type[Generator], files: RobotFiles) -> tuple[Declaration, ...]:
    """Return what the component of a plugin declares, and its generator, made without a connection.

    Raises:
        SolferError: A part of the plugin cannot be made.
        SolferErrors: Several of these.
    """
    outside = DryMiddleware(configuration, files)
    generation = generator(outside.configuration, outside)
    with closing(generation.plugin()) as plugin:
        return generation.declarations(plugin.component)


def _known(configuration: Configuration, files: RobotFiles, whole: bool) -> Configuration:
    """Leave out what only the running robot knows: contacts and actuators of a parameter.

    Unless the configuration is `whole`, the pipes that need a map or a calibration which a mistake keeps from being
    made are left out, too; the whole robot, which has all names, stands in for models of maps with mistakes.
    """
    sources = configuration.sources
    robot = configuration.robot
    if sources is None or sources.urdf is None or not sources.urdf.given:
        given = {key: _as_source(path) for key, path in (("urdf", files.urdf), ("srdf", files.srdf)) if path}
        sources = (sources or SourceRecord()).model_copy(update=given)
    unseen = [key for key in ("actuators", "contacts") if _is_unseen(getattr(sources, key), getattr(files, key))]
    choices = {key: getattr(robot, key).model_copy(update={"read": False}) for key in unseen}
    mappings = configuration.mappings
    if not whole:
        named = configuration.tree.get(configuration.section, "mapping")
        model = MappingRecord(name="", loading="model", urdf=_as_source(files.urdf))
        mappings = {**{name: model for name, _ in (named.items() if named else ())}, **mappings}
    known = replace(configuration, sources=sources, robot=robot.model_copy(update=choices), mappings=mappings)
    maps = set(_maps(known))

    def is_known(record: FeedbackRecord | ControllerRecord) -> bool:
        if record.content.contacts and "contacts" in unseen:
            return False
        calibrated = record.calibration is None or record.calibration in known.calibrations
        return whole or (calibrated and (record.dofs is None or record.dofs.mapping in maps))

    return replace(
        known,
        feedbacks=tuple(filter(is_known, known.feedbacks)),
        controllers=tuple(filter(is_known, known.controllers)),
    )


def _is_unseen(source: TextRecord | None, file: Path | None) -> bool:
    return source is None or (source.file is None and file is None)


def _as_source(path: Path) -> TextRecord:
    return TextRecord(file=str(path.absolute()))


def _maps(configuration: Configuration) -> Iterator[str]:
    """Yield the maps that the Robot of an incomplete configuration gets."""
    yield from (*MODEL_MAPS, ACTUATED, *PREDEFINED_MAPS, *configuration.mappings)
    if any(record.measures_joints for record in configuration.feedbacks):
        yield FEEDBACK_MAP
    for record in configuration.controllers:
        if record.lower_level:
            yield from (controller_map(record.leads_to), LOWER_LEVEL_MAP)


def _texts(sources: SourceRecord, files: RobotFiles) -> Iterator[tuple[str, Path]]:
    """Yield the parameters of the descriptions, each with the file that has the same text."""
    for key in ("urdf", "srdf", "actuators", "contacts"):
        source = getattr(sources, key)
        file = getattr(files, key)
        if source is not None and source.parameter is not None and file is not None:
            yield source.parameter, file
