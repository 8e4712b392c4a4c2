"""Dataclasses to the fields of an interface and back, and to the messages that pipes carry."""

import dataclasses
import functools
import typing
from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Any

import numpy as np

from solfer.errors import MiddlewareError
from solfer.transport.messages import (
    TYPES,
    VECTOR_MESSAGES,
    WRENCH_MESSAGES,
    FieldsMessage,
    Message,
    VectorMessage,
    WrenchMessage,
)

Converter = Callable[[Any], Any]

_SCALARS = frozenset((float, int, bool, str))
_XYZ = ("x", "y", "z")
_XYZW = ("x", "y", "z", "w")
_PLACES: dict[str, tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]] = {
    "geometry_msgs/PointStamped": ((("point",), _XYZ),),
    "geometry_msgs/Vector3Stamped": ((("vector",), _XYZ),),
    "geometry_msgs/QuaternionStamped": ((("quaternion",), _XYZW),),
    "geometry_msgs/PoseStamped": ((("pose", "position"), _XYZ), (("pose", "orientation"), _XYZW)),
    "geometry_msgs/TwistStamped": ((("twist", "linear"), _XYZ), (("twist", "angular"), _XYZ)),
    "geometry_msgs/WrenchStamped": ((("wrench", "force"), _XYZ), (("wrench", "torque"), _XYZ)),
}
"""Where the numbers of a message of geometry lie in the fields of its interface: the way to them, and their names."""


def require_carried(interface: str) -> None:
    """Check that a declared topic can carry an interface.

    Raises:
        MiddlewareError: Pipes carry it, in a form of their own.
    """
    if interface in TYPES and interface not in _PLACES:
        others = ", ".join(_PLACES)
        raise MiddlewareError(
            f"{interface} cannot be declared", expected=f"a pipe for it, or another interface, such as {others}"
        )


def message_of(interface: str, value: Any) -> Message:
    """Make the message of a dataclass, as it travels."""
    return encoder(interface, type(value))(value)


def encoder(interface: str, cls: type) -> Callable[[Any], Message]:
    """Return what makes messages of dataclasses; numbers of geometry are in the same message each time."""
    return _Geometry(interface, cls).fill if interface in _PLACES else _written_out


def _written_out(value: Any) -> FieldsMessage:
    return FieldsMessage(plain(value))


class _Geometry:
    """A message of geometry, filled with dataclasses; what a dataclass does not have is zero."""

    def __init__(self, interface: str, cls: type):
        paths = [(*place, name) for place, names in _PLACES[interface] for name in names]
        there = [place for place, path in enumerate(paths) if _has(cls, path)]
        self._places = slice(None) if len(there) == len(paths) else there
        # attributes of attributes, without a call of Python for each
        self._numbers = attrgetter(*[".".join(paths[place]) for place in there]) if there else lambda value: ()
        self._has_header = _has(cls, ("header",))
        self._values = np.zeros(len(paths))
        self._is_wrench = interface in WRENCH_MESSAGES
        self._message: VectorMessage | WrenchMessage | None = None

    def fill(self, value: Any) -> Message:
        """Return the message of a dataclass."""
        header = value.header if self._has_header else None
        frame = getattr(header, "frame_id", "")
        values = self._values
        values[self._places] = self._numbers(value)
        message = self._message
        if message is None or message.frame != frame:
            if self._is_wrench:
                message = self._message = WrenchMessage(frame, values[:3], values[3:])
            else:
                message = self._message = VectorMessage(frame, values)
        message.stamp = getattr(header, "stamp", 0.0)
        return message


def _has(cls: Any, path: tuple[str, ...]) -> bool:
    """Return whether a dataclass has an attribute of its attributes."""
    for name in path:
        if dataclasses.is_dataclass(cls):
            hints = typing.get_type_hints(cls)
            if name not in hints:
                return False
            cls = hints[name]
    return True


def value_of(cls: type, message: Message) -> Any:
    """Make the dataclass of a message.

    Raises:
        MiddlewareError: A field is missing, or of another kind.
    """
    return made(cls, message.fields if isinstance(message, FieldsMessage) else _fields_of(message))


def plain(value: Any) -> Any:
    """Convert a dataclass to a mapping of its fields, nested ones as well; arrays become tuples."""
    kind: Any = type(value)
    names = _names(kind)
    if names is not None:
        fields = {}
        for name in names:
            each = getattr(value, name)
            fields[name] = each if type(each) in _SCALARS else plain(each)
        return fields
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, tuple | list):
        return tuple(value) if _SCALARS.issuperset(map(type, value)) else tuple(map(plain, value))
    return value


@functools.cache
def _names(cls: type) -> tuple[str, ...] | None:
    """Return the names of the fields of a dataclass; None for another class."""
    return tuple(field.name for field in dataclasses.fields(cls)) if dataclasses.is_dataclass(cls) else None


def made(cls: type, fields: Mapping[str, Any]) -> Any:
    """Make a dataclass of a mapping of fields; those that it does not have are left out, those missing are defaults.

    Raises:
        MiddlewareError: A field without a default is missing, or one is of another kind.
    """
    values = {}
    for name, convert in _converters(cls):
        if name in fields:
            try:
                values[name] = convert(fields[name])
            except (TypeError, ValueError, AttributeError) as error:
                raise MiddlewareError(
                    f"field '{name}' of {cls.__name__} is {fields[name]!r:.80}",
                    expected=str(typing.get_type_hints(cls)[name]),
                ) from error
    try:
        return cls(**values)
    except TypeError as error:
        raise MiddlewareError(
            f"{cls.__name__} cannot be made of {', '.join(fields) or 'nothing'}",
            expected=f"the fields {', '.join(name for name, _ in _converters(cls))}",
        ) from error


@functools.cache
def _converters(cls: type) -> tuple[tuple[str, Converter], ...]:
    hints = typing.get_type_hints(cls)
    return tuple((field.name, _converter(hints[field.name])) for field in dataclasses.fields(cls))


def _converter(hint: Any) -> Converter:
    """Return what makes a value of a kind; it raises TypeError or ValueError for one of another kind."""
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return functools.partial(made, hint)
    if hint is np.ndarray:
        return functools.partial(np.array, dtype=float)
    if typing.get_origin(hint) is tuple:
        element = _converter(typing.get_args(hint)[0])
        return lambda values: tuple(element(each) for each in _sequence(values))
    return functools.partial(exactly, hint) if hint in (float, int, bool, str) else lambda value: value


def exactly(kind: type, value: Any) -> Any:
    """Return a value of a kind; a whole number counts as a float, and nothing else as another kind."""
    if isinstance(value, bool) is not (kind is bool) or not isinstance(value, (int, float) if kind is float else kind):
        raise TypeError(value)
    return kind(value)


def _sequence(values: Any) -> Any:
    if not isinstance(values, tuple | list | np.ndarray):
        raise TypeError(values)
    return values


def _fields_of(message: Message) -> dict[str, Any]:
    """Convert a message of geometry to the fields of its interfaces; its readers name them."""
    assert isinstance(message, VectorMessage | WrenchMessage)
    fields: dict[str, Any] = {"header": {"stamp": message.stamp, "frame_id": message.frame}}
    if isinstance(message, WrenchMessage):
        interfaces = WRENCH_MESSAGES
        numbers = [*message.force.tolist(), *message.torque.tolist()]
    else:
        numbers = message.values.tolist()
        interfaces = tuple(each for each, size in VECTOR_MESSAGES.items() if size == len(numbers))
    for interface in interfaces:
        rest = iter(numbers)
        for path, names in _PLACES[interface]:
            place = fields
            for name in path:
                place = place.setdefault(name, {})
            place |= {name: next(rest) for name in names}
    return fields
