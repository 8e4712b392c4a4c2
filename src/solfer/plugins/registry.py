"""Finds components by name, or by `class: package.module:Class` in any package on the path."""

import importlib
import inspect
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from solfer.components import Component
from solfer.config import Record
from solfer.errors import ComponentError, UnknownName
from solfer.plugins.generator import Generator


@dataclass(frozen=True)
class Entry:
    """A known plugin.

    Attributes:
        target: `package.module:Class`; the class is a Component, or a Generator of its own. None for a plugin of the
            original program that is not there: its configurations can be read, not run.
        configuration: Configuration that is loaded unless another one is named.
        others: More configurations that are made for this plugin.
    """

    target: str | None
    configuration: str
    others: tuple[str, ...] = ()


BUILT_IN = {
    "joint_states": Entry(
        "solfer.components.joint_states:JointStates", "joint_states", ("joint_lower", "joint_reference")
    ),
    "UpperBodyIK": Entry(None, "upper_body_ik"),
    "gravity_compensation": Entry(None, "gravity_compensation"),
    "compliance_compensation": Entry(None, "compliance_compensation"),
    "odometry3": Entry(None, "odometry"),
    "ground_forces": Entry(None, "ground_forces", ("gravity_forces",)),
    "Nwheels3": Entry(None, "wheeled_motion"),
    "NwheelsZMPII": Entry(None, "wheeled_motion"),
    "NwheelsZMPIV": Entry(None, "wheeled_motion"),
    "NwheelsSecondOrder": Entry(None, "wheeled_motion"),
    "acceleration_test": Entry(None, "acceleration_test"),
}


class Registry:
    """The plugins that can be loaded by name.

    Args:
        entries: Known plugins by name; the built-in ones by default.
    """

    def __init__(self, entries: Mapping[str, Entry] = BUILT_IN):
        self._entries = dict(entries)

    def names(self) -> tuple[str, ...]:
        """Names of the plugins that can run, in alphabetical order."""
        return tuple(sorted(name for name, entry in self._entries.items() if entry.target))

    @property
    def known(self) -> tuple[str, ...]:
        """Names of all plugins, also of those that are not there."""
        return tuple(sorted(self._entries))

    def __contains__(self, name: str) -> bool:
        return name in self._entries

    def configuration(self, name: str) -> str:
        """The configuration that a plugin loads by default; for one that is not known here, its own name."""
        return self._entries[name].configuration if name in self._entries else name

    def of_configuration(self, name: str) -> tuple[str, ...]:
        """The known plugins that the configuration `name` is made for."""
        return tuple(plugin for plugin, entry in self._entries.items() if name in (entry.configuration, *entry.others))

    def require(self, name: str, modules: Iterable[str]) -> None:
        """Check that there is a plugin of that name.

        Args:
            name: Name of the plugin.
            modules: Names of the configurations that there are; one with a `class:` is a plugin of its own.

        Raises:
            UnknownName: Neither a known plugin nor a configuration has that name.
        """
        known = dict.fromkeys((*self._entries, *modules))
        if name not in known:
            raise UnknownName("plugin", name, known)

    def tags(self) -> dict[str, type[Record]]:
        """Records of the own tags of the components that can run, by name of the plugin."""
        found = {name: self.find(name).component.Tags for name in self.names()}
        return {name: record for name, record in found.items() if record is not None}

    def describe(self, name: str) -> str:
        """The first sentence of what a plugin's class says of itself."""
        documentation = inspect.getdoc(self.find(name).component) or ""
        return documentation.split("\n\n")[0].replace("\n", " ")

    def find(self, name: str, target: str | None = None, where: str = "") -> type[Generator]:
        """The generator of a plugin.

        Args:
            name: Name of the plugin.
            target: `package.module:Class` of the configuration; it goes before the name.
            where: Place of the name or the class, for errors.

        Raises:
            UnknownName: There is no plugin of that name.
            ComponentError: The class cannot be imported, or is no component, or the plugin is not there.
        """
        if target is None:
            if name not in self._entries:
                expected = "a known plugin, or `class:` in its configuration"
                raise UnknownName("plugin", name, self._entries, where=where, expected=expected)
            target = self._entries[name].target
        if target is None:
            expected = f"one of {', '.join(self.names())}, or `class:` in its configuration"
            raise ComponentError(f"the plugin '{name}' is not available here", where=where, expected=expected)
        found = load_class(target, where)
        if issubclass(found, Generator):
            return found
        return type(f"{found.__name__}Generator", (Generator,), {"component": found})


def load_class(target: str, where: str = "") -> type:
    """Import `package.module:Class`, a Component or a Generator.

    Raises:
        ComponentError: It cannot be imported, or is something else.
    """
    module_name, colon, class_name = target.partition(":")
    if not (colon and module_name and class_name.isidentifier()):
        raise ComponentError(f"'{target}' names no class", where=where, expected="package.module:Class")
    try:
        module = importlib.import_module(module_name)
    except Exception as error:
        raise ComponentError(
            f"module '{module_name}' cannot be imported: {type(error).__name__}: {error}",
            where=where,
            expected="a module on the Python path (is its catkin workspace sourced?)",
        ) from error
    found = getattr(module, class_name, None)
    if found is None:
        raise UnknownName(f"class in module {module_name}", class_name, vars(module), where=where)
    if not (isinstance(found, type) and issubclass(found, Component | Generator)):
        raise ComponentError(
            f"'{target}' is no component", where=where, expected="a subclass of solfer.components.Component"
        )
    return found
