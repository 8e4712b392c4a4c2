"""The configuration of one plugin, in frozen records."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from solfer.config.loading.effective import EffectiveValue, as_yaml, entries, pruned
from solfer.config.records.calibration import CalibrationRecord
from solfer.config.records.middlewares import MIDDLEWARES
from solfer.config.records.modules import ContactsChoice, ModuleRecord, ReadRecord, RobotRecord, placed_class
from solfer.config.records.pipes import ControllerRecord, DofsRecord, FeedbackRecord
from solfer.config.records.record import Record, RecordType, field_names, parse
from solfer.config.records.sources import MappingRecord, SourceRecord
from solfer.config.yaml.nodes import Key, Mark, YamlNode
from solfer.config.yaml.problems import Problems


@dataclass(frozen=True)
class Configuration:
    """One module of a main configuration after all merging.

    Attributes:
        file: The main configuration.
        name: Name of the module.
        middleware: Name of a middleware, one of `MIDDLEWARES`.
        system: 'HW' or 'SM'.
        rate: Rate of the control cycle [Hz].
        module: The plugin configuration without the component's own tags.
        robot: The robot configuration that the module names.
        feedbacks: Pipes that the plugin receives, in the order of the configuration.
        controllers: Pipes that the plugin sends to, in the order of the configuration.
        mappings: Predefined maps by name.
        calibrations: Calibrations of the hardware by name.
        sources: Where URDF, SRDF, actuators and contacts are.
        modules: Names of all modules of the file.
    """

    file: str
    name: str
    middleware: str
    system: str
    rate: float
    module: ModuleRecord
    robot: RobotRecord
    feedbacks: tuple[FeedbackRecord, ...]
    controllers: tuple[ControllerRecord, ...]
    mappings: dict[str, MappingRecord]
    calibrations: dict[str, CalibrationRecord]
    sources: SourceRecord
    modules: tuple[str, ...]
    tree: YamlNode = field(repr=False, compare=False)

    def tags(self, record: type[RecordType]) -> RecordType:
        """Read the component's own tags: all keys of the module that not every module has.

        Raises:
            ConfigError: A value does not fit the record.
            UnknownName: A key that neither the record nor every module has.
            SolferErrors: Several of these.
        """
        problems = Problems()
        parsed = self.read_tags(record, problems)
        problems.raise_if_any()
        return parsed

    def read_tags(self, record: type[RecordType], problems: Problems) -> RecordType | None:
        """Read the tags as `tags` does; mistakes go to `problems`, and then the result may be None."""
        return parse(own_tags(self._module_node), record, problems, also=field_names(ModuleRecord)[1:])

    def own_tags(self) -> dict[str, Any]:
        """Return the component's own tags as they are written, after all merging."""
        return own_tags(self._module_node).plain()

    def effective(self) -> Iterator[EffectiveValue]:
        """Yield every value that the module uses, after all merging, with its place."""
        yield from entries(pruned(self.tree, self.name, self.robot.configuration, middleware=self.middleware))

    def text(self, origins: bool = True) -> str:
        """Write the effective configuration as YAML; with `origins` each line ends with the place of its value."""
        return as_yaml(self.effective(), origins)

    def where(self, *place: Any) -> str:
        """Return `file:line:column` and key path of a value, for errors that other rooms find.

        Args:
            place: A record and a key path below it, such as `(feedback, "dofs", "chain")`, or a key path from the root
                of the configuration. Where the value itself is not written down, the nearest place on its way counts.
        """
        first = place[0] if place else None
        if isinstance(first, Record):
            return first.where(*place[1:])
        node = self.tree.nearest(place)
        return str(node.head if node is self.tree else node.mark)

    def own_topic(self, topic: str) -> str:
        """Return a topic that it publishes to other plugins, under its unique name in a list of plugins.

        Where a list has the configuration again, as `NAME_2`, its topic gets the same number, such as `desired_2`. A
        topic with a leading slash stays, since it is meant to be that one.
        """
        return topic if topic.startswith("/") else topic + self.module.name.removeprefix(self.name)

    def at(self, rate: float) -> "Configuration":
        """Return the same configuration at another rate [Hz]."""
        return replace(self, rate=rate)

    @property
    def section(self) -> str:
        """Name of the section of its middleware."""
        return MIDDLEWARES[self.middleware].section

    @property
    def _module_node(self) -> YamlNode:
        return self.tree.nearest(("modules", self.name))


@dataclass(frozen=True)
class Part:
    """The readable parts of a module, for checks that go on although it may have mistakes.

    Attributes:
        configuration: Values with mistakes are None, or left out of lists and maps.
        dofs: DoFs of all pipes whose DoFs have no mistake, also of pipes with a mistake elsewhere.
    """

    configuration: Configuration
    dofs: tuple[DofsRecord, ...]

    @property
    def module(self) -> YamlNode:
        """The module with all its tags."""
        return self.configuration.tree.nearest(("modules", self.configuration.name))

    @property
    def class_name(self) -> str | None:
        """The component that the module's `class` names."""
        node = self.module.get("class")
        if node is None or not isinstance(node.value, str):
            return None
        return placed_class(node.value, os.path.dirname(node.mark.file))

    def assumed(self, rate: float) -> Configuration:
        """Return a configuration with stand-ins for what has mistakes; only `sources` may still be None.

        Args:
            rate: Rate of the control cycle, if its own has a mistake [Hz].
        """
        read = self.configuration
        module = ModuleRecord.model_construct(
            name=read.name, layer="NRT", mode="full", robot="", controller=(), kinematics=False, dynamics=False,
            model_change=False, class_=self.class_name,
        )  # fmt: skip
        module._node = self.module
        robot = RobotRecord.model_construct(
            name="", configuration="", actuators=ReadRecord.model_construct(read=False),
            contacts=ContactsChoice.model_construct(read=False),
        )  # fmt: skip
        return replace(
            read,
            system=read.system or "SM",
            rate=read.rate or rate,
            module=read.module or module,
            robot=read.robot or robot,
        )

    def place(self, *path: Key) -> Mark:
        """Return the place of the module, or of the value at `path` below it, or of the nearest one above it."""
        return self.module.nearest(path).mark if path else self.module.head


def common_tags(module: YamlNode) -> YamlNode:
    """Return the part of a module that is the same for all components."""
    common = field_names(ModuleRecord)[1:]
    return _part(module, lambda key: key in common)


def own_tags(module: YamlNode) -> YamlNode:
    """Return the part of a module that belongs to its component."""
    common = field_names(ModuleRecord)[1:]
    return _part(module, lambda key: key not in common)


def _part(module: YamlNode, is_selected: Callable[[str], bool]) -> YamlNode:
    if not isinstance(module.value, dict):
        return module
    return YamlNode({key: child for key, child in module.items() if is_selected(key)}, module.mark, module.key)
