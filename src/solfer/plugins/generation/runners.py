"""Which node runs a configuration: by its `middleware` and `layer`, or by the file of an RT layer that lists it."""

import logging
import os
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from solfer.config import CheckReport, Configuration
from solfer.config.loading.listed_plugins import Naming
from solfer.config.loading.rt_layer import is_layer, read_layer
from solfer.config.records.middlewares import DEFAULT_MIDDLEWARE, MIDDLEWARES, RT
from solfer.config.yaml.files import YamlFile
from solfer.config.yaml.nodes import Mark
from solfer.errors import ConfigError, SolferError

_LOG = logging.getLogger(__name__)


class Foreign(NamedTuple):
    """What keeps a node under ROS from running a configuration.

    Attributes:
        mark: Place of the value.
        what: What it says, such as `layer RT`.
        setting: The key and its value that this node would run.
    """

    mark: Mark
    what: str
    setting: str


def require_ros(
    configuration: Configuration, default: Naming, shared: bool = False, middleware: str = DEFAULT_MIDDLEWARE
) -> None:
    """Check that a node under ROS is what the configuration requests.

    Args:
        configuration: The configuration.
        default: Returns the configuration of a plugin that an RT layer lists without one.
        shared: Whether the node runs it with others, as one of a shared plugin.
        middleware: That of the node.

    Raises:
        ConfigError: Its `middleware` is not the node's, or its `layer` not NRT; the error names what runs it.
    """
    name = configuration.name
    foreign = _foreign(configuration, middleware)
    if foreign is not None:
        raise ConfigError(
            f"'{name}' is for the {foreign.what}, and this node runs the layer NRT on {middleware}",
            where=str(foreign.mark),
            expected=f"{foreign.setting}, or {_command(configuration, default)} in place of this node",
        )
    if configuration.module.requires and not shared:
        _LOG.info("%s: has no effect: '%s' runs alone", configuration.module.where("requires"), name)


def require_main(file: YamlFile) -> None:
    """Check that a file is not that of an RT layer.

    Raises:
        ConfigError: It is; the error names the command that runs it.
    """
    if is_layer(file):
        raise ConfigError(
            "this is the file of an RT layer, and this node runs one plugin on ROS",
            where=str(file.node.nearest(("XBotRTPlugins",)).head),
            expected=f"a main configuration, or `rosrun solfer xbot {shlex.quote(file.path)}` in place of this node",
        )


def note_runners(report: CheckReport, default: Naming) -> None:
    """Note which configurations of a main file a node under ROS refuses, and `requires` that have no effect.

    Args:
        report: The check of the file; receives the information.
        default: Returns the configuration of a plugin that an RT layer lists without one.
    """
    refused: dict[Foreign, dict[str, Configuration]] = {}
    for name, configuration in _started(report):
        foreign = _foreign(configuration, DEFAULT_MIDDLEWARE)
        if foreign is not None:
            refused.setdefault(foreign, {})[name] = configuration
    for foreign, found in refused.items():
        first = next(iter(found))
        command = _command(next(iter(found.values())), default)
        what = f"`rosrun plugins plugin` refuses {', '.join(found)}, for the {foreign.what}; {command} runs '{first}'"
        report.problems.inform(foreign.mark, what)
    _note_required(report)


def start_line(configuration: Configuration, component: str) -> str:
    """Describe in one line what starts, for the log.

    Args:
        configuration: The configuration.
        component: Name of the component's class.
    """
    module = configuration.module
    robot = configuration.robot
    named = module.name if module.name == configuration.name else f"{module.name} ({configuration.name})"
    return (
        f"{component} runs as {named} of {configuration.file}: layer {module.layer}, middleware "
        f"{configuration.middleware}, {configuration.rate:g} Hz, Robot {robot.name or 'without a name'} "
        f"({robot.configuration})"
    )


def _started(report: CheckReport) -> Iterator[tuple[str, Configuration]]:
    """Yield each name that can be started, with a configuration whose `middleware` and `layer` count for it."""
    for name, part in report.parts.items():
        yield name, part.configuration
    for name, shared in report.shared.items():
        yield from ((name, configuration) for configuration in shared.configurations[:1])


def _note_required(report: CheckReport) -> None:
    """Note `requires` of configurations that no shared plugin of the file lists."""
    members = {each.name for shared in report.shared.values() for each in shared.configurations}
    for name, configuration in report.configurations.items():
        if configuration.module.requires and name not in members:
            what = f"no shared plugin of this file lists '{name}': it requires nothing where it runs alone"
            report.problems.inform(configuration.tree.nearest(("modules", name, "requires")).mark, what)


def _foreign(configuration: Configuration, expected: str) -> Foreign | None:
    """Return what shows that a configuration is not for the layer NRT on a middleware; also of one with mistakes."""
    tree = configuration.tree
    middleware = tree.get("middleware")
    layer = tree.get("modules", configuration.name, "layer")
    if middleware is not None and middleware.value != expected:
        return Foreign(middleware.mark, f"middleware {middleware.value}", f"`middleware: {expected}`")
    if layer is not None and layer.value == "RT":
        return Foreign(layer.mark, "layer RT", "`layer: NRT`")
    return None


def _command(configuration: Configuration, default: Naming) -> str:
    """Return the command that runs a configuration in an RT layer, with the layer's file if one beside it lists it."""
    name = configuration.name
    main = Path(configuration.file)
    middleware, layer = (configuration.tree.get(*path) for path in (("middleware",), ("modules", name, "layer")))
    kind = None if middleware is None else MIDDLEWARES.get(str(middleware.value))
    if kind is not None and kind.layer != RT.layer and (layer is None or layer.value != RT.layer):
        program = "rosrun plugins plugin" if kind.name == DEFAULT_MIDDLEWARE else f"./run {kind.name.lower()} plugin"
        return f"`{program} -p ID -n {shlex.quote(name)} -c {shlex.quote(configuration.file)}`"
    for path in sorted(main.parent.glob("*.yaml")):
        if path.is_file() and is_layer(path) and _lists(path, main, name, default=default):
            return f"`rosrun solfer xbot {shlex.quote(os.fspath(path))}`"
    return f"`rosrun solfer xbot LAYER` with a file LAYER that lists '{name}' in its XBotRTPlugins"


def _lists(path: Path, main: Path, name: str, default: Naming) -> bool:
    """Return whether the file of an RT layer lists a configuration of a main configuration."""
    try:
        layer = read_layer(path, default)
        return os.path.samefile(layer.main, main) and any(entry.configuration == name for entry in layer.plugins)
    except (SolferError, OSError):
        return False
