"""Settings of a node: `name:=value` behind its command, or a private parameter `~name` in a launch file."""

from argparse import ArgumentTypeError
from collections.abc import Callable, Sequence
from typing import Any

import rosgraph
import rospy

from solfer.errors import ConfigError


def argument(argv: Sequence[str], name: str) -> str | None:
    """Return the value of `name:=value` behind the command; None if it is not there. Needs no master."""
    return rosgraph.names.load_mappings(list(argv)).get(name) or None


def setting(argv: Sequence[str], name: str, default: Any, kind: Callable[[str], Any] = str) -> Any:
    """Return the value of a setting.

    Args:
        argv: Arguments of the process.
        name: Name of the setting.
        default: Value if it is not set.
        kind: Converts the text to the value; raises ValueError, or argparse's ArgumentTypeError, for other texts.

    Raises:
        ConfigError: The text is not a value of that kind.
    """
    where = f"{name}:="
    value = argument(argv, name)
    if value is None:
        where = f"parameter {rospy.resolve_name('~' + name)}"
        value = rospy.get_param(f"~{name}", None)
    if value is None or value == "":
        return default
    try:
        return kind(str(value))
    except (ValueError, ArgumentTypeError) as error:
        raise ConfigError(f"'{value}' is not a value of '{name}'", where=where, expected=str(error)) from error
