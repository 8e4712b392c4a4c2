"""Dataclasses to fields and back."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from support.unit.declarations import Twist, Vector

from solfer.errors import MiddlewareError
from solfer.transport.declared.fields import made, plain


@dataclass
class Path:
    """What a message may hold."""

    name: str
    points: tuple[Vector, ...] = ()
    numbers: np.ndarray = field(default_factory=lambda: np.zeros(0))


def test_nested_fields_come_back():
    path = Path("way", (Vector(1.0), Vector(y=2.0)), np.array([1.0, 2.0]))
    fields = plain(path)
    assert fields["points"][1] == {"x": 0.0, "y": 2.0, "z": 0.0} and fields["numbers"] == (1.0, 2.0)
    again = made(Path, fields)
    assert again.points == path.points and again.numbers.tolist() == [1.0, 2.0]


def test_unknown_fields_are_left_out():
    assert made(Twist, {"linear": {"x": 1, "w": 5}, "seq": 3}) == Twist(Vector(1.0))


@pytest.mark.parametrize(
    "fields, what",
    [
        ({"name": 3}, "field 'name' of Path is 3"),
        ({"points": ()}, "Path cannot be made of points"),
        ({"name": "way", "points": 3.0}, "field 'points' of Path is 3.0"),
        ({"name": "way", "points": ({"x": "fast"},)}, "field 'x' of Vector is 'fast'"),
        ({"name": "way", "numbers": ("one",)}, "field 'numbers' of Path"),
    ],
)
def test_a_wrong_field_is_named(fields, what):
    with pytest.raises(MiddlewareError, match=what):
        made(Path, fields)
