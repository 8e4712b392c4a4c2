"""Loads one module of a main configuration: its robot, pipes, maps, calibrations and sources, of all its files."""

import logging
import os
from typing import Any

from solfer.config.loading.configuration import Configuration, Part, common_tags, own_tags
from solfer.config.loading.layers import AS_CONFIGURED, Layers, ModulePlacement, location_of
from solfer.config.loading.library import CONTROLLER, FEEDBACK, Library, named_records, read_calibrations
from solfer.config.records.middlewares import DEFAULT_MIDDLEWARE, MIDDLEWARES
from solfer.config.records.modules import (
    FeedbackChoice,
    MainRecord,
    ModuleRecord,
    RobotHead,
    RobotRecord,
    is_shared,
    placed_class,
)
from solfer.config.records.pipes import ControllerRecord, DofsRecord, FeedbackRecord, PipeRecord
from solfer.config.records.record import parse
from solfer.config.records.sources import MappingRecord, SourceRecord, TextRecord
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import Folders
from solfer.errors import UnknownName, nearest

logger = logging.getLogger(__name__)

NOT_CONFIGURATIONS = ("name", "rate", "systems")
"""Keys of `robot` beside its configurations."""

Used = set[tuple[str, str]]
"""Direction and name of pipes that a module uses."""


def load(  # noqa: PLR0913 for users: what replaces values of the file, by its name
    file: str | os.PathLike,
    module: str,
    *,
    class_name: str | None = None,
    system: str | None = None,
    search_paths: Folders = (),
    middleware: str | None = None,
    layer: str | None = None,
    shared: YamlNode | None = None,
    over: YamlNode | None = None,
) -> Configuration:
    """Load a module: merge its files, resolve sets, merge pipes with the middleware's part, and check all that is used.

    Args:
        file: The main configuration, also one that was read before.
        module: Name of the plugin configuration.
        class_name: Component to load instead of the configuration's `class`.
        system: `SM` or `HW` instead of the file's `system`.
        search_paths: Folders to search for files that are not where the configuration expects them.
        middleware: Name of a middleware instead of the file's `middleware`.
        layer: `RT` or `NRT` instead of the module's `layer`.
        shared: The shared plugin that lists the module; its layer counts, and its mode if that is `idle`.
        over: What is laid over all files in the end; None: nothing.

    Raises:
        ConfigError: A file is missing or not YAML, or a value does not fit.
        UnknownName: A key, module, set, pipe or robot configuration does not exist.
        SolferErrors: Several of these; all mistakes are reported at once.
    """
    problems = Problems()
    layers = Layers(file, problems, system, folders=search_paths, middleware=middleware, over=over)
    configuration = Reading(layers, module, problems, ModulePlacement(layer, shared)).configuration(class_name)
    problems.log(logger)
    problems.raise_if_any()
    return configuration


class Reading:
    """Reads one module of a main configuration; each step notes its mistakes and lets the others go on.

    Args:
        layers: The main configuration and its files.
        name: Name of the module.
        problems: Receives the mistakes.
        placement: Where the module runs.

    Attributes:
        used: Pipes that were looked up.

    Raises:
        UnknownName: There is no such module.
        ConfigError: The module is empty.
    """

    def __init__(self, layers: Layers, name: str, problems: Problems, placement: ModulePlacement = AS_CONFIGURED):
        self._file = layers.file
        self._name = name
        self._tree = layers.tree(name, problems, placement)
        self._problems = problems
        self.used: Used = set()
        self._dofs: list[DofsRecord] = []

    def configuration(self, class_name: str | None = None) -> Configuration | None:
        """Read the configuration, for the component `class_name` instead of its `class`; None after a mistake."""
        part = self.part(class_name)
        return None if self._problems else part.configuration

    def part(self, class_name: str | None = None) -> Part:
        """Read the parts without mistakes."""
        main = parse(self._tree, MainRecord, self._problems)
        head = self._robot_head()
        module = self._module(class_name)
        node = self._robot_node(self._tree.get("modules", self._name, "robot"))
        robot = None
        if node is not None:
            name = head.name if head else self._written_name()
            robot = parse(node, RobotRecord, self._problems, name=name, configuration=str(node.head.path[-1]))
        middleware = main.middleware if main else self._middleware()
        feedbacks = self._feedbacks(node, middleware) if node else ()
        controllers = self._controllers(self._tree.get("modules", self._name, "controller"), middleware)
        mappings = self._mappings(middleware, (*feedbacks, *controllers))
        sources = self._sources(middleware, node) if node else None
        self._warn_of_services(controllers, sources)
        calibrations = read_calibrations(self._tree, (*feedbacks, *controllers), self._problems)
        configuration = Configuration(
            self._file,
            self._name,
            middleware,
            system=main.system if main else None,
            rate=head.rate if head else None,
            module=module,
            robot=robot,
            feedbacks=feedbacks,
            controllers=controllers,
            mappings=mappings,
            calibrations=calibrations,
            sources=sources,
            modules=tuple(main.modules) if main else (),
            tree=self._tree,
        )
        return Part(configuration, tuple(self._dofs))

    def _middleware(self) -> str:
        """Return the middleware of a skeleton with mistakes; the default if it is none."""
        node = self._tree.get("middleware")
        return node.value if node is not None and node.value in tuple(MIDDLEWARES) else DEFAULT_MIDDLEWARE

    def _module(self, class_name: str | None) -> ModuleRecord | None:
        name = self._name
        node = self._tree.nearest(("modules", name))
        if is_shared(name, node):
            self._problems.add(node.head, f"'{name}' lists plugins and is not one itself", "one of those that it lists")
            return None
        record = parse(common_tags(node), ModuleRecord, self._problems, beside=own_tags(node), name=name)
        if record is None:
            return None
        target = class_name or record.class_
        return record.model_copy(update={"class_": placed_class(target, record.folder("class"))})

    def _robot_head(self) -> RobotHead | None:
        node = self._tree.get("robot")
        if node is None or not isinstance(node.value, dict):
            return None  # reported with the skeleton
        head = {key: child for key, child in node.items() if key in ("name", "rate")}
        return parse(YamlNode(head, node.mark, node.key), RobotHead, self._problems)

    def _written_name(self) -> str:
        """Return the robot's name where another key beside it is wrong; empty if it is wrong itself."""
        node = self._tree.get("robot", "name")
        return node.value if node is not None and isinstance(node.value, str) else ""

    def _robot_node(self, chosen: YamlNode | None) -> YamlNode | None:
        """Return the robot configuration that `chosen` names."""
        if chosen is None or self._tree.get("robot") is None or not isinstance(chosen.value, str):
            return None  # reported with the module or the skeleton
        known = {key: node for key, node in self._tree.entries("robot").items() if key not in NOT_CONFIGURATIONS}
        if chosen.value not in known:
            self._problems.unknown(chosen.mark, "robot configuration", chosen.value, known)
            return None
        return known[chosen.value]

    def _feedbacks(self, robot: YamlNode, middleware: str) -> tuple[FeedbackRecord, ...]:
        chosen = robot.get("feedback")
        choice = parse(chosen, FeedbackChoice, self._problems) if chosen else None
        if choice is None or (choice.layer is None and choice.list is None):
            return ()
        return self._pipes(chosen.get("list") if choice.layer is None else chosen.get("layer"), middleware, FEEDBACK)

    def _controllers(self, chosen: YamlNode | None, middleware: str) -> tuple[ControllerRecord, ...]:
        if chosen is None or not isinstance(chosen.value, str | tuple):
            return ()  # reported with the module
        return self._pipes(chosen, middleware, CONTROLLER)

    def _pipes(self, chosen: YamlNode, middleware: str, direction: str) -> tuple[Any, ...]:
        """Return the pipes of a set's name or of a list."""
        library = Library(self._tree, middleware, direction, problems=self._problems)
        records = library.of_set(chosen) if isinstance(chosen.value, str) else library.of_list(chosen)
        self.used |= library.used
        self._dofs += library.dofs
        return records

    def _mappings(self, middleware: str, pipes: tuple[PipeRecord, ...]) -> dict[str, MappingRecord]:
        """Read all predefined maps; the files of those that the pipes use have to exist."""
        node = self._tree.get(MIDDLEWARES[middleware].section, "mapping")
        mappings = named_records(node, MappingRecord, self._problems)
        for name in sorted({name for pipe in pipes if pipe.dofs for name in (pipe.dofs.mapping, pipe.dofs.type)}):
            if name in mappings and mappings[name].urdf is not None:
                location_of(mappings[name].urdf, self._problems)
        return mappings

    def _sources(self, middleware: str, robot: YamlNode) -> SourceRecord | None:
        """Read where the descriptions are; those that the robot configuration needs have to be given and exist."""
        name = MIDDLEWARES[middleware].section
        section = self._tree.get(name, "source")
        if section is None:
            what = f"there is no '{name}.source'"
            self._problems.add(self._tree.nearest((name,)).head, what, "at least 'urdf' in it")
            return None
        sources = parse(section, SourceRecord, self._problems)
        if sources is None:
            return None
        if sources.controller is not None and sources.controller.given:
            location_of(sources.controller, self._problems)
        if sources.config is not None and sources.config.given:
            self._warn_of_missing_layer(sources.config)
        read = [name for name in ("actuators", "contacts") if robot.nearest((name, "read")).value is True]
        for key in ("urdf", "srdf", *read):
            source = getattr(sources, key)
            if source is not None and source.given:
                location_of(source, self._problems)
            elif key != "srdf":
                why = f" because '{robot.head.path[-1]}' reads them" if key in read else ""
                self._problems.add(section.head, f"the key '{key}' is missing", f"a parameter or a file{why}")
        return sources

    def _warn_of_missing_layer(self, config: TextRecord) -> None:
        """Warn of a file of the RT layer that is not here: only the layer itself needs it."""
        found = Problems()
        location_of(config, found)
        for error in found.errors:
            self._problems.warn(config.place("file"), f"has no effect: {error.what}")

    def _warn_of_services(self, controllers: tuple[ControllerRecord, ...], sources: SourceRecord | None) -> None:
        """Warn of services that are not called: those of no lower-level controller, or without gains to load."""
        gains = sources is not None and sources.controller is not None and sources.controller.given
        for record in controllers:
            for key in ("ff_service", "load_service"):
                if getattr(record, key) is None:
                    continue
                if not record.lower_level:
                    self._problems.warn(record.place(key), "has no effect: the pipe does not lead to the lower level")
                elif key == "load_service" and not gains:
                    self._problems.warn(record.place(key), "has no effect: 'source.controller' names no file of gains")


def misspelt_key(tree: YamlNode) -> UnknownName | None:
    """Return the error of a key of `robot` that is like another one and no robot configuration; None: there is none."""
    for key, node in tree.entries("robot").items():
        if key not in NOT_CONFIGURATIONS and not isinstance(node.value, dict) and nearest(str(key), NOT_CONFIGURATIONS):
            return UnknownName("key of 'robot'", str(key), NOT_CONFIGURATIONS, where=str(node.head))
    return None
