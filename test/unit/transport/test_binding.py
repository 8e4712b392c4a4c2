"""Parameters that a component declares."""

import pytest

from solfer.components import Parameter
from solfer.errors import ComponentError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport import Inbox
from solfer.transport.declared.binding import bind


def read(kind, value=None, handler=None):
    """Bind a parameter `gain`; return what its handler got."""
    got = []
    bus = Bus({} if value is None else {"/arm/gain": value})
    parameter = Parameter("gain", kind, handler or got.append)
    bind("arm", (parameter,), MemoryMiddleware(bus), Inbox(), rate=100.0)
    return got


@pytest.mark.parametrize(
    "kind, value, expected", [(float, 2, 2.0), (int, 3, 3), (bool, True, True), (str, "left", "left")]
)
def test_a_parameter_comes_as_its_type(kind, value, expected):
    (got,) = read(kind, value)
    assert got == expected and type(got) is kind


def test_a_missing_parameter_calls_nothing():
    assert read(float) == []


@pytest.mark.parametrize("kind, value", [(float, "2"), (float, True), (int, 2.5), (bool, 1), (str, 4)])
def test_a_parameter_of_another_type_is_named(kind, value):
    with pytest.raises(ComponentError, match="parameter 'arm/gain' is") as caught:
        read(kind, value)
    assert kind.__name__ in caught.value.expected


def test_a_refused_parameter_has_its_place():
    def refuse(value):
        raise ComponentError(f"gain {value}", expected="a positive one")

    with pytest.raises(ComponentError) as caught:
        read(float, -1.0, refuse)
    assert "arm/gain" in caught.value.where
