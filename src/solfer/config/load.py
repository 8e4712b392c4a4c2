"""Loading one module of a main configuration."""

import os

from pydantic import Field

from solfer.config.configuration import Configuration, common_tags
from solfer.config.layering import layered, location_of
from solfer.config.library import CONTROLLER, FEEDBACK, Library, named_records
from solfer.config.modules import MainRecord, ModuleRecord, RobotRecord
from solfer.config.nodes import Node
from solfer.config.pipes import PipeRecord
from solfer.config.problems import Problems
from solfer.config.record import Record, parse
from solfer.config.sources import MappingRecord, SourceRecord, TextRecord

_NOT_CONFIGURATIONS = ("name", "rate", "systems")  # keys of `robot` beside its configurations


class _RobotHead(Record):
    """What all robot configurations share."""

    name: str = Field(default="", description="name of the robot, top key of its actuators and contacts")
    rate: float = Field(gt=0, description="rate of the control cycle [Hz], usually in the layer's file")


def load(file: str | os.PathLike, module: str, *, class_name: str | None = None) -> Configuration:
    """Load a module: merge its files, resolve sets, merge pipes with the middleware's part, and check all that is used.

    Args:
        file: The main configuration.
        module: Name of the plugin configuration.
        class_name: Component to load instead of the one that the configuration's `class` names.

    Raises:
        ConfigError: A file is missing or not YAML, or a value does not fit.
        UnknownName: A key, module, set, pipe or robot configuration that does not exist.
        SolferErrors: Several of these; all mistakes are reported at once.
    """
    problems = Problems()
    tree = layered(file, module, problems)
    configuration = _Reading(tree, problems).configuration(os.fspath(file), module, class_name)
    problems.raise_if_any()
    return configuration


class _Reading:
    """Steps of `load` on a merged tree; each notes its mistakes and lets the others go on."""

    def __init__(self, tree: Node, problems: Problems):
        self._tree, self._problems = tree, problems

    def configuration(self, file: str, name: str, class_name: str | None) -> Configuration | None:
        main = parse(self._tree, MainRecord, self._problems)
        module = self._module(name, class_name)
        head = self._robot_head()
        robot = self._robot(module, head.name if head else "") if module else None
        if main is None:
            return None
        feedbacks = self._feedbacks(robot, main.middleware) if robot else ()
        controllers = self._controllers(module, main.middleware) if module else ()
        mappings = self._mappings(main.middleware, (*feedbacks, *controllers))
        sources = self._sources(main.middleware, robot) if robot else None
        if self._problems:
            return None
        modules = tuple(main.modules)
        return Configuration(
            file, main.middleware, main.system, head.rate, module, robot, feedbacks, controllers, mappings, sources,
            modules, self._tree,
        )  # fmt: skip

    def _module(self, name: str, class_name: str | None) -> ModuleRecord | None:
        node = self._tree.nearest(("modules", name))
        if node.get("plugins") is not None:
            self._problems.add(node.head, f"'{name}' lists plugins and is none itself", "one of those that it lists")
            return None
        record = parse(common_tags(node), ModuleRecord, self._problems, name=name)
        if record is None or class_name is None:
            return record
        return record.model_copy(update={"class_": class_name})

    def _robot_head(self) -> _RobotHead | None:
        node = self._tree.get("robot")
        if node is None or not isinstance(node.value, dict):
            return None  # reported with the skeleton
        head = {key: child for key, child in node.items() if key in ("name", "rate")}
        return parse(Node(head, node.mark, node.key), _RobotHead, self._problems)

    def _robot(self, module: ModuleRecord, name: str) -> RobotRecord | None:
        node = self._tree.get("robot")
        if node is None:
            return None
        known = [key for key, _ in node.items() if key not in _NOT_CONFIGURATIONS]
        chosen = self._tree.nearest(("modules", module.name, "robot"))
        if module.robot not in known:
            self._problems.unknown(chosen.mark, "robot configuration", module.robot, known)
            return None
        node = node.nearest((module.robot,))
        return parse(node, RobotRecord, self._problems, name=name, configuration=module.robot)

    def _feedbacks(self, robot: RobotRecord, middleware: str) -> tuple[PipeRecord, ...]:
        library = Library(self._tree, middleware, FEEDBACK, self._problems)
        node = self._tree.get("robot", robot.configuration, "feedback")
        if robot.feedback.layer is not None:
            return library.of_set(robot.feedback.layer, node.get("layer").mark)
        return () if robot.feedback.list is None else library.of_list(node.get("list"))

    def _controllers(self, module: ModuleRecord, middleware: str) -> tuple[PipeRecord, ...]:
        library = Library(self._tree, middleware, CONTROLLER, self._problems)
        node = self._tree.nearest(("modules", module.name, "controller"))
        if isinstance(module.controller, str):
            return library.of_set(module.controller, node.mark)
        return library.of_list(node)

    def _mappings(self, middleware: str, pipes: tuple[PipeRecord, ...]) -> dict[str, MappingRecord]:
        """All predefined maps; the files of those that the pipes use are there."""
        node = self._tree.get(middleware.lower(), "mapping")
        mappings = named_records(node, MappingRecord, self._problems)
        for name in sorted({name for pipe in pipes for name in (pipe.dofs.mapping, pipe.dofs.type)}):
            if name in mappings and mappings[name].urdf is not None:
                self._check(mappings[name].urdf)
        return mappings

    def _sources(self, middleware: str, robot: RobotRecord) -> SourceRecord | None:
        section = self._tree.get(middleware.lower())
        if section is None or section.get("source") is None:
            mark = (section or self._tree).head
            self._problems.add(mark, f"there is no '{middleware.lower()}.source'", "at least 'urdf' in it")
            return None
        sources = parse(section.get("source"), SourceRecord, self._problems)
        wanted = {"urdf": True, "srdf": False, "actuators": robot.actuators.read, "contacts": robot.contacts.read}
        for name, needed in wanted.items() if sources else ():
            source = getattr(sources, name)
            if source is not None and (needed or name == "srdf"):
                self._check(source)
            elif needed and source is None:
                why = "" if name == "urdf" else f" because '{robot.configuration}' reads them"
                mark = section.get("source").head
                self._problems.add(mark, f"the key '{name}' is missing", f"a parameter or a file{why}")
        return sources

    def _check(self, source: TextRecord) -> None:
        location_of(source, source.mark, self._problems)
