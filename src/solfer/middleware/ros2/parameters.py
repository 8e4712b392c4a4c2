"""Live parameters of a plugin as parameters of its node."""

import json
import logging
import math
import threading
from collections.abc import Sequence
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from solfer.errors import SolferError, described
from solfer.interfaces.declaration import Service
from solfer.transport.middleware import Submit
from solfer.transport.parameters import GetParameters, SetParameters

logger = logging.getLogger(__name__)


class NativeParameters:
    """Declares live parameters with their ranges, and passes changes on to the plugin, which accepts or refuses them.

    Args:
        node: The plugin's node.
        prefix: In front of each name; empty where the node has one plugin.
        getting: The plugin's service that describes parameters.
        setting: The one that changes them.
        submit: Passes calls to the loop.
    """

    def __init__(self, node: Node, prefix: str, getting: Service, setting: Service, submit: Submit):
        self._node = node
        self._prefix = prefix
        self._getting = getting
        self._setting = setting
        self._submit = submit
        threading.Thread(target=self._declare, daemon=True).start()  # the loop that answers has yet to start

    def _request(self, service: Service, request: Any) -> Any:
        return self._submit(service.prepared(request)).result(service.timeout)

    def _declare(self) -> None:
        try:
            found = self._request(self._getting, GetParameters())
            limits = zip(found.minimums, found.maximums, strict=True)
            rows = zip(found.names, found.types, found.values, limits, found.descriptions, strict=True)
            for name, kind, text, ends, description in rows:
                self._declare_one(name, kind, text, limits=ends, description=description)
            self._node.add_on_set_parameters_callback(self._change)
        except (SolferError, FutureTimeout, ParameterException, RuntimeError) as error:  # such as the end of the node
            logger.warning("%s offers no parameters: %s", self._node.get_name(), error)

    def _declare_one(self, name: str, kind: str, text: str, limits: Sequence[str], description: str) -> None:
        descriptor = ParameterDescriptor(description=description, dynamic_typing=True)
        value = _read(text)
        if kind.split(",")[0].split()[0] == "number" and isinstance(value, int | float):
            value = float(value)
            low, high = (float(each.rpartition(" ")[2]) if each else math.nan for each in limits)
            begin = -math.inf if math.isnan(low) else low
            end = math.inf if math.isnan(high) else high
            descriptor.floating_point_range = [FloatingPointRange(from_value=begin, to_value=end)]
        full = self._prefix + name
        if not self._node.has_parameter(full):  # one that was given at the start is with the plugin already
            self._node.declare_parameter(full, value, descriptor)
        else:
            self._node.set_descriptor(full, descriptor, value)

    def _change(self, changes: Sequence[Parameter]) -> SetParametersResult:
        ours = [each for each in changes if each.name.startswith(self._prefix)]
        names = tuple(each.name.removeprefix(self._prefix) for each in ours)
        texts = tuple(each.value if isinstance(each.value, str) else json.dumps(_plain(each.value)) for each in ours)
        try:
            reply = self._request(self._setting, SetParameters(names, texts))
            return SetParametersResult(successful=reply.success, reason=reply.message)
        except SolferError as error:
            return SetParametersResult(successful=False, reason=described(error, lines=True))
        except FutureTimeout:
            return SetParametersResult(successful=False, reason="the plugin's loop does not answer")


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else value


def _read(text: str) -> Any:
    """Read a value in YAML: what JSON cannot read is a word."""
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return text if value is None or isinstance(value, dict) else value
