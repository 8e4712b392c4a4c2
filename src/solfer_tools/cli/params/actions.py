"""Actions of `solfer params`."""

import argparse
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from solfer.cli.columns import aligned
from solfer.config.records.live import saved
from solfer.errors import ConfigError, MiddlewareError, SolferError, UnknownName
from solfer.interfaces.declaration import Accepted
from solfer.transport.parameters import (
    GET_INTERFACE,
    GET_PARAMETERS,
    SET_INTERFACE,
    SET_PARAMETERS,
    GetParameters,
    ParametersReply,
    SetParameters,
)
from solfer_tools.cli.params.callers import TIMEOUT, Caller


@dataclass(frozen=True)
class _Parameter:
    """A parameter of a plugin, in the order of a `ParametersReply`."""

    name: str
    kind: str
    value: str
    configured: str
    default: str
    unit: str
    minimum: str
    maximum: str
    description: str

    @property
    def range(self) -> str:
        """The values that it may have."""
        bounds = " to ".join(filter(None, (self.minimum, self.maximum)))
        return ", ".join(filter(None, (self.kind, bounds)))


def show(options: argparse.Namespace, caller: Caller) -> None:
    """Print a table for each plugin."""
    plugins = caller.plugins()
    for plugin in plugins if options.running is None else [_known(options.running, plugins)]:
        rows = [(each.name, each.value, each.unit, each.range, each.default, each.description)
                for each in _parameters(caller, plugin)]  # fmt: skip
        print(plugin)
        titles = ("name", "value", "unit", "range", "default", "description")
        for line in aligned((titles, *rows), indent="  "):
            print(line)


def get(options: argparse.Namespace, caller: Caller) -> None:
    """Print values, as `put` takes them."""
    for each in _parameters(caller, _known(options.running, caller.plugins()), options.parameters):
        print(f"{each.name}={each.value}")


def put(options: argparse.Namespace, caller: Caller) -> None:
    """Change parameters.

    Raises:
        ConfigError: One of them has no value.
        MiddlewareError: The plugin refuses; nothing has changed.
    """
    pairs = [text.partition("=") for text in options.parameters]
    for name, separator, _ in pairs:
        if not separator:
            raise ConfigError(f"'{name}' has no value", expected="NAME=VALUE, such as speed=0.8")
    request = SetParameters(tuple(name for name, _, _ in pairs), tuple(value for _, _, value in pairs))
    plugin = _known(options.running, caller.plugins())
    _answered(caller.call(f"{plugin}/{SET_PARAMETERS}", SET_INTERFACE, request, Accepted, TIMEOUT))


def save(options: argparse.Namespace, caller: Caller) -> None:
    """Write the parameters that differ from the configuration.

    Raises:
        ConfigError: The file cannot be written.
    """
    plugin = _known(options.running, caller.plugins())
    file = options.file
    values = {each.name: (each.value, each.configured) for each in _parameters(caller, plugin)}
    module = plugin.rpartition("/")[2]
    try:
        before = file.read_text(encoding="utf-8") if file.exists() else ""
        text, count = saved(before, str(file), module, values=values)
        temporary = file.with_name(f".{file.name}.{os.getpid()}")
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(file)
    except (OSError, ValueError) as error:
        if isinstance(error, SolferError):
            raise
        why = getattr(error, "strerror", None) or str(error)
        raise ConfigError(
            f"the parameters cannot be written: {why}", where=str(file), expected="a YAML file that you may write to"
        ) from error
    print(f"{file}: {count} values of {module} written")


PARAMETER_ACTIONS = {"list": show, "get": get, "set": put, "save": save}


def names(kind: str, namespace: str, plugin: str) -> list[str]:
    """List plugins (`running`), or the parameters of one; empty where none can be reached."""
    from solfer_tools.cli.params.callers import caller

    try:
        with caller(namespace) as made:
            return made.plugins() if kind == "running" else [each.name for each in _parameters(made, plugin)]
    except SolferError:
        return []


def _known(plugin: str, plugins: list[str]) -> str:
    """Return the name of a plugin without a leading slash.

    Raises:
        UnknownName: There is no such plugin, or it is gone.
    """
    name = plugin.strip("/")
    if name not in plugins:
        raise UnknownName("plugin", name, plugins)
    return name


def _parameters(caller: Caller, plugin: str, names: Iterable[str] = ()) -> Iterator[_Parameter]:
    request = GetParameters(tuple(names))
    reply = caller.call(f"{plugin}/{GET_PARAMETERS}", GET_INTERFACE, request, ParametersReply, TIMEOUT)
    _answered(reply)
    columns = (reply.names, reply.types, reply.values, reply.configured, reply.defaults, reply.units, reply.minimums,
               reply.maximums, reply.descriptions)  # fmt: skip
    return (_Parameter(*row) for row in zip(*columns, strict=True))


def _answered(reply: Accepted | ParametersReply) -> None:
    if not reply.success:
        raise MiddlewareError(reply.message)
