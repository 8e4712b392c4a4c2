"""The records of `solfer/component.h` for ctypes, field by field in the same order; see there what they mean."""

import ctypes
from ctypes import (
    CFUNCTYPE,
    POINTER,
    PYFUNCTYPE,
    Structure,
    c_char,
    c_char_p,
    c_double,
    c_int,
    c_long,
    c_size_t,
    c_uint,
    c_void_p,
)

INTERFACE = 1
"""Version of the headers."""

ERROR_SIZE = 512
"""Bytes of room for the text of an error."""

NUMBER, INTEGER, SWITCH, TEXT, NUMBERS = range(5)
"""`solfer_kind`."""

Doubles = POINTER(c_double)
Names = POINTER(c_char_p)


class Array(Structure):
    """`solfer_array`."""

    _fields_ = [("data", c_void_p), ("rows", c_size_t), ("columns", c_size_t)]


class Value(Structure):
    """`solfer_value`."""

    _fields_ = [("number", c_double), ("text", c_char_p), ("numbers", Doubles), ("size", c_size_t)]


class Tag(Structure):
    """`solfer_tag`."""

    _fields_ = [
        ("name", c_char_p),
        ("description", c_char_p),
        ("kind", c_int),
        ("is_required", c_int),
        ("is_live", c_int),
        ("value", Value),
        ("lower", c_double),
        ("upper", c_double),
    ]


class Time(Structure):
    """`solfer_time`."""

    _fields_ = [(name, c_double) for name in ("period", "passed", "step", "lost", "pace")]


class PointRecord(Structure):
    """`solfer_point`."""

    _fields_ = [("index", c_int), ("value", Array), ("jacobian", Array)]


class PointRequest(Structure):
    """`solfer_point_request`."""

    _fields_ = [
        ("kind", c_char_p),
        ("link", c_char_p),
        ("operands", POINTER(c_int)),
        ("operand_count", c_size_t),
        ("numbers", Doubles),
        ("number_count", c_size_t),
    ]


class Endpoint(Structure):
    """`solfer_endpoint`; its handler is an address."""

    _fields_ = [
        ("name", c_char_p),
        ("interface", c_char_p),
        ("fields", Names),
        ("field_count", c_size_t),
        ("reply_fields", Names),
        ("reply_field_count", c_size_t),
        ("numbers", Doubles),
        ("rate", c_double),
        ("handler", c_void_p),
        ("user", c_void_p),
    ]


class Move(Structure):
    """`solfer_move`."""

    _fields_ = [("before", 3 * c_double), ("after", 3 * c_double), ("yaw", c_double)]


# the interpreter's lock stays with the caller: handlers take a few microseconds
Handler = PYFUNCTYPE(c_int, *(c_void_p, Doubles, Doubles, POINTER(c_char), c_size_t))

HOST_FUNCTIONS = {
    "dof": CFUNCTYPE(c_long, c_void_p, c_char_p),
    "group": CFUNCTYPE(c_void_p, c_void_p, c_char_p, POINTER(c_size_t)),
    "links": CFUNCTYPE(c_void_p, c_void_p, c_char_p, POINTER(c_size_t)),
    "array": CFUNCTYPE(c_void_p, c_void_p, c_char_p, c_char_p),
    "point": CFUNCTYPE(c_void_p, c_void_p, POINTER(PointRequest)),
    "port": CFUNCTYPE(c_void_p, c_void_p, c_int, c_char_p, c_char_p),
    "log": CFUNCTYPE(c_int, *(c_void_p, c_char_p, Doubles, c_size_t, c_char_p)),
    "receive": CFUNCTYPE(c_int, c_void_p, POINTER(Endpoint)),
    "publish": CFUNCTYPE(c_int, c_void_p, POINTER(Endpoint)),
    "serve": CFUNCTYPE(c_int, c_void_p, POINTER(Endpoint)),
}
"""The functions of `solfer_host`, in their order."""


class HostRecord(Structure):
    """`solfer_host`."""

    _fields_ = [
        ("context", c_void_p),
        ("name", c_char_p),
        ("size", c_size_t),
        ("dofs", Names),
        ("time", POINTER(Time)),
        ("tags", POINTER(Value)),
        *HOST_FUNCTIONS.items(),
    ]


STEPS = ("init", "update", "send", "reset", "stop")
"""Steps of a component, which have no arguments."""


class ClassRecord(Structure):
    """`solfer_class`; its functions are addresses."""

    _fields_ = [
        ("name", c_char_p),
        ("description", c_char_p),
        ("tags", POINTER(Tag)),
        ("tag_count", c_size_t),
        *((name, c_void_p) for name in ("create", "destroy", *STEPS, "move_world", "error")),
    ]


class LibraryRecord(Structure):
    """`solfer_library_record`."""

    _fields_ = [
        ("interface_number", c_uint),
        ("class_count", c_size_t),
        ("classes", POINTER(POINTER(ClassRecord))),
    ]


Create = PYFUNCTYPE(c_void_p, POINTER(HostRecord), POINTER(c_char), c_size_t)
Destroy = PYFUNCTYPE(None, c_void_p)
ErrorText = PYFUNCTYPE(c_char_p, c_void_p)
Step = PYFUNCTYPE(c_int, c_void_p)
"""A step of a component that keeps the interpreter's lock."""

MoveWorld = PYFUNCTYPE(c_int, c_void_p, POINTER(Move))

FreeStep = CFUNCTYPE(c_int, c_void_p)
"""One that releases it."""


def text(value: bytes | None) -> str:
    """Decode a text of a library; none is empty."""
    return (value or b"").decode(errors="replace")


def texts(names: "ctypes._Pointer[c_char_p]", count: int) -> tuple[str, ...]:
    """Decode several."""
    return tuple(text(names[index]) for index in range(count))
