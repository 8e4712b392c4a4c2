"""Live parameters for clients of dynamic_reconfigure, such as rqt_reconfigure."""

import json
import logging
import math
import threading
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import rosgraph
import rospy
from dynamic_reconfigure.encoding import decode_config, encode_config
from dynamic_reconfigure.msg import Config, ConfigDescription, Group, GroupState, ParamDescription
from dynamic_reconfigure.srv import Reconfigure, ReconfigureResponse

from solfer.middleware.ros.codecs.bounded import Rate, bound_requests
from solfer.middleware.ros.services import QUICK_LIMIT, RosService
from solfer.srv import GetParametersRequest, SetParametersRequest
from solfer.throttle import Throttle

logger = logging.getLogger(__name__)

NAME = "parameters"
"""Where they are below the plugin, whose own `set_parameters` is another service."""

FAILURES = (rospy.ROSException, rospy.ServiceException, rosgraph.MasterException, OSError)
"""What may go wrong where a service or a topic is made."""


@dataclass(frozen=True)
class _Row:
    """A parameter as dynamic_reconfigure has it.

    Attributes:
        type: bool, int, double or str.
        lower: Smallest value; empty for a text.
        upper: Largest value, likewise.
        choices: The texts that it may be; empty: any.
        is_text: Whether it is text and not YAML.
    """

    name: str
    type: str
    lower: Any
    upper: Any
    choices: tuple[str, ...]
    is_text: bool

    @classmethod
    def of(cls, name: str, kind: str, minimum: str, maximum: str) -> "_Row":
        types = {"number": "double", "whole number": "int", "true or false": "bool"}
        ranges: dict[str, tuple[Any, Any]] = {
            "double": (-math.inf, math.inf),
            "int": (-(2**31), 2**31 - 1),
            "bool": (False, True),
            "str": ("", ""),
        }
        words = tuple(kind.split(" or "))
        is_kind = {"number", "whole number", "true", "false", "text", "list", "none"}.intersection(words)
        choices = () if is_kind else words
        type_ = types.get(kind, "str")
        lower, upper = (
            limit if type_ in ("bool", "str") or not text else type(limit)(float(text.rpartition(" ")[2]))
            for text, limit in zip((minimum, maximum), ranges[type_], strict=True)
        )
        return cls(name, type_, lower, upper=upper, choices=choices, is_text=kind == "text" or bool(choices))

    def read(self, text: str) -> Any:
        """Read the text of a value."""
        if self.type == "str":
            return text
        if not text:  # a value that has to be given has no default
            return self.lower if self.type == "bool" else type(self.lower)(0)
        return type(self.lower)(json.loads(text))

    def write(self, value: Any) -> str:
        """Write a value, within its range, as YAML; one of another type is for the plugin to refuse."""
        if self.type in ("int", "double") and isinstance(value, int | float):
            value = min(max(value, self.lower), self.upper)
        is_yaml = self.type == "str" and not self.is_text and isinstance(value, str)
        return value if is_yaml else json.dumps(value)

    def kept(self, value: Any) -> Any:
        """Return a value as the parameter server keeps it: numbers and lists as such."""
        if self.type == "str" and not self.is_text:
            with suppress(ValueError):  # a word among other kinds
                return json.loads(value)
        return value

    @property
    def edit_method(self) -> str:
        """The choices, as clients read them."""
        options = [
            {"name": each, "type": "str", "value": each, "description": each, "ctype": "std::string"}
            for each in self.choices
        ]
        return repr({"enum": options, "enum_description": self.name}) if options else ""


class ReconfigureServer:
    """Serves the live parameters of a plugin to clients of dynamic_reconfigure.

    The parameter server has those that are in it from the beginning, and all that change later.

    Numbers beyond their range become its end, as these clients expect. What the plugin refuses is logged, and the
    client receives the values that count.

    Args:
        owner: Name of the plugin.
        getting: Its service `get_parameters`.
        setting: Its service `set_parameters`.
    """

    def __init__(self, owner: str, getting: RosService, setting: RosService):
        self._owner = owner
        self._getting = getting
        self._setting = setting
        self._lock = threading.Lock()
        self._throttle = Throttle(logger)
        self._rows: dict[str, _Row] = {}
        self._kept: dict[str, Any] = {}
        self._parts: list[rospy.Publisher] = []
        self._server: rospy.Service | None = None
        # the answer may come from a bridge, whose loop has called here
        self._thread = threading.Thread(target=self._try_to_start, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Unregister."""
        self._thread.join()
        if self._server is not None:
            self._server.shutdown()
        for each in self._parts:
            each.unregister()

    def _try_to_start(self) -> None:
        try:
            self._start()
        except FAILURES as error:  # such as the end of the node
            logger.warning("%s offers no parameters to dynamic_reconfigure: %s", self._owner, error)

    def _start(self) -> None:
        found = self._getting.answer(GetParametersRequest())
        if not found.success:
            logger.warning("%s offers no parameters to dynamic_reconfigure: %s", self._owner, found.message)
            return
        texts = zip(found.names, found.types, found.minimums, found.maximums, strict=True)
        self._rows = {row.name: row for row in (_Row.of(*each) for each in texts)}
        prefix = f"{self._owner}/{NAME}"
        described, self._updates = (
            rospy.Publisher(f"{prefix}/{name}", kind, latch=True, queue_size=1)
            for name, kind in (("parameter_descriptions", ConfigDescription), ("parameter_updates", Config))
        )
        self._parts += (described, self._updates)
        self._kept = self._values() | first_values(self._owner)
        described.publish(self._description(found))
        self._publish()
        self._setting.done = self._publish
        self._server = rospy.Service(f"{prefix}/set_parameters", Reconfigure, self._set)
        busy = object()
        bound_requests(
            self._server.protocol,
            self._setting.service.largest,
            Rate(*QUICK_LIMIT),
            instead=lambda size: busy,
            busy=busy,
        )

    def _set(self, request: Any) -> ReconfigureResponse:
        if isinstance(request, Reconfigure._request_class):
            self._change(decode_config(request.config))
        return ReconfigureResponse(_message(self._values()))

    def _change(self, changes: dict[str, Any]) -> None:
        """Change what differs from the values that count; all of it, or nothing."""
        before = self._values()
        changed = {name: value for name, value in changes.items() if before.get(name) != value}
        texts = [self._rows[name].write(value) if name in self._rows else "" for name, value in changed.items()]
        reply = self._setting.answer(SetParametersRequest(list(changed), texts))
        if not reply.success:
            self._throttle.warning("refused", "%s/%s: refused: %s", self._owner, NAME, reply.message)

    def _values(self) -> dict[str, Any]:
        found = self._getting.answer(GetParametersRequest())
        return {name: self._rows[name].read(text) for name, text in zip(found.names, found.values, strict=True)}

    def _publish(self) -> None:
        with self._lock, suppress(*FAILURES):  # the node ends
            values = self._values()
            self._updates.publish(_message(values))
            for name, value in values.items():
                kept = self._rows[name].kept(value)
                if self._kept[name] not in (value, kept):
                    rospy.set_param(f"{self._owner}/{NAME}/{name}", kept)
                self._kept[name] = kept

    def _description(self, found: Any) -> ConfigDescription:
        rows = self._rows.values()
        described = [
            ParamDescription(row.name, row.type, 1, text, row.edit_method)
            for row, text in zip(rows, found.descriptions, strict=True)
        ]
        defaults = zip(found.names, found.defaults, strict=True)
        return ConfigDescription(
            [Group("Default", "", described, 0, 0)],
            _message({row.name: row.upper for row in rows}),
            _message({row.name: row.lower for row in rows}),
            _message({name: self._rows[name].read(text) for name, text in defaults}),
        )


def first_values(owner: str) -> dict[str, Any]:
    """Return the values that a plugin's live parameters have on the parameter server."""
    found = rospy.get_param(f"{owner}/{NAME}", {})
    return found if isinstance(found, dict) else {NAME: found}


def _message(values: dict[str, Any]) -> Config:
    message = encode_config(values)
    message.groups.append(GroupState("Default", True, 0, 0))
    return message
