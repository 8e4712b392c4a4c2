"""Finds components by name, by `class: package.module:Class` in any package on the path, or by `library.so::Class`."""

import importlib
import inspect
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from solfer.components import Component
from solfer.components.native.library import SEPARATOR
from solfer.config import Record
from solfer.errors import ComponentError, UnknownName, located
from solfer.plugins.generation.generator import Generator


@dataclass(frozen=True)
class RegisteredComponent:
    """A known plugin.

    Attributes:
        target: `package.module:Class`; the class is a Component, or a Generator of its own. None for a plugin of the
            original program that is not available: its configurations can be read, not run.
        configuration: Configuration that is loaded unless another one is named.
        others: Further configurations for this plugin.
    """

    target: str | None
    configuration: str
    others: tuple[str, ...] = ()


BUILT_IN = {
    "joint_states": RegisteredComponent(
        "solfer.components.joint_states:JointStates", "joint_states", ("joint_online", "joint_lower", "joint_reference")
    ),
    "inverse_kinematics": RegisteredComponent(
        "solfer.components.inverse_kinematics:InverseKinematics", "inverse_kinematics", ("manipulation",)
    ),
    "UpperBodyIK": RegisteredComponent("solfer.components.inverse_kinematics:InverseKinematics", "upper_body_ik"),
    "inverse_dynamics": RegisteredComponent(
        "solfer.components.inverse_dynamics:InverseDynamics", "inverse_dynamics", ("squat",)
    ),
    "gravity_compensation": RegisteredComponent(
        "solfer.components.gravity_compensation:GravityCompensation",
        "gravity_compensation",
        ("soft_compensation", "shared_compensation", "spring_compensation"),
    ),
    "compliance_compensation": RegisteredComponent(
        "solfer.components.compliance_compensation:ComplianceCompensation", "compliance_compensation"
    ),
    "odometry3": RegisteredComponent("solfer.components.odometry:Odometry", "odometry"),
    "ground_forces": RegisteredComponent(
        "solfer.components.ground_forces:GroundForces", "ground_forces", ("gravity_forces",)
    ),
    "wheeled_motion": RegisteredComponent("solfer.components.wheeled_motion:WheeledMotion", "wheeled_motion"),
    "Nwheels3": RegisteredComponent("solfer.components.wheeled_motion:WheeledMotion", "wheeled_motion"),
    "support_shaping": RegisteredComponent("solfer.components.support_shaping:SupportShaping", "support_shaping"),
    "NwheelsZMPII": RegisteredComponent("solfer.components.support_shaping:SupportShaping", "wheeled_motion"),
    "NwheelsZMPIV": RegisteredComponent(None, "wheeled_motion"),
    "NwheelsSecondOrder": RegisteredComponent(None, "wheeled_motion"),
}


class Registry:
    """The plugins that can be loaded by name.

    Args:
        entries: Known plugins by name; the built-in ones by default.
    """

    def __init__(self, entries: Mapping[str, RegisteredComponent] = BUILT_IN):
        self._entries = dict(entries)

    def names(self) -> tuple[str, ...]:
        """Return the names of the plugins that can run, in alphabetical order."""
        return tuple(sorted(name for name, entry in self._entries.items() if entry.target))

    @property
    def known(self) -> tuple[str, ...]:
        """Names of all plugins, also of those that are not available."""
        return tuple(sorted(self._entries))

    def __contains__(self, name: str) -> bool:
        return name in self._entries

    def configuration(self, name: str) -> str:
        """Return the name of the configuration that a plugin loads by default; for an unknown plugin, its own name."""
        return self._entries[name].configuration if name in self._entries else name

    def of_configuration(self, name: str) -> tuple[str, ...]:
        """Return the known plugins that the configuration `name` is made for."""
        return tuple(plugin for plugin, entry in self._entries.items() if name in (entry.configuration, *entry.others))

    def require(self, name: str, modules: Iterable[str]) -> None:
        """Check that a plugin of this name exists.

        Args:
            name: Name of the plugin.
            modules: Names of the configurations; one with a `class:` is a plugin of its own.

        Raises:
            UnknownName: Neither a known plugin nor a configuration has that name.
        """
        known = dict.fromkeys((*self._entries, *modules))
        if name not in known:
            raise UnknownName("plugin", name, known)

    def tags(self) -> dict[str, type[Record]]:
        """Return the records of the own tags of the components that can run, by name of the plugin."""
        found = {name: self.find(name).component.Tags for name in self.names()}
        return {name: record for name, record in found.items() if record is not None}

    def describe(self, name: str) -> str:
        """Return the first sentence of the docstring of a plugin's class."""
        documentation = inspect.getdoc(self.find(name).component) or ""
        return documentation.split("\n\n")[0].replace("\n", " ")

    def find(self, name: str, target: str | None = None, where: str = "") -> type[Generator]:
        """Find the generator of a plugin.

        Args:
            name: Name of the plugin.
            target: `class` of the configuration; it takes precedence over the name.
            where: Place of the name or the class, for errors.

        Raises:
            UnknownName: There is no plugin of that name.
            ComponentError: The class cannot be imported, or is not a component, or the plugin is not available.
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
    """Import `package.module:Class`, a Component or a Generator, or load `library.so::Class`.

    Raises:
        ComponentError: It cannot be imported or loaded, or is something else.
        UnknownName: There is no such library, or no such class in it.
    """
    if SEPARATOR in target:
        from solfer.components.native.component import load_native  # ctypes, for those who have libraries

        return load_native(target, where)
    module_name, colon, class_name = target.partition(":")
    if not (colon and module_name and class_name.isidentifier()):
        raise ComponentError(
            f"'{target}' is not the name of a class", where=where, expected="package.module:Class or library.so::Class"
        )
    try:
        module = importlib.import_module(module_name)
    except BaseException as error:  # a script may exit when it is imported
        raise ComponentError(
            f"module '{module_name}' cannot be imported: {located(error)}",
            where=where,
            expected="a module on the Python path (is its catkin workspace sourced?)",
        ) from error
    found = getattr(module, class_name, None)
    if found is None:
        fit = [name for name, value in vars(module).items() if _is_component(value)]
        raise UnknownName(f"class in module {module_name}", class_name, fit, where=where)
    if not _is_component(found):
        raise ComponentError(
            f"'{target}' is not a component", where=where, expected="a subclass of solfer.components.Component"
        )
    return found


def _is_component(value: object) -> bool:
    return isinstance(value, type) and issubclass(value, Component | Generator)
