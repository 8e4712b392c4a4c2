"""A decoder that remembers how messages lie reads each as a decoder that has read nothing before."""

import io
import itertools

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from solfer.errors import PipeError
from solfer.middleware.ros.codecs.table import codec
from solfer.msg import JointCommand
from solfer.transport.messages import JOINT_FIELDS

COMMAND = "solfer/JointCommand"
JOINTS = (("hip", "knee"), ("knee", "hip"), ("hip", "foot"), ("hip",), ("wheel", "wrist"))


def packed(rng, names, fields, component, interfaces=()) -> bytes:
    """Pack a command with random numbers by genpy."""
    message = JointCommand(name=list(names), component=component, interface=list(interfaces))
    message.header.seq, message.header.stamp.secs = rng.integers(1000, size=2).tolist()
    for field in fields:
        setattr(message, field, rng.normal(size=len(names)).tolist())
    message.value = rng.normal(size=len(names) * len(interfaces)).tolist()
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def read(decoder, data):
    """Decode; returns what the message holds, or the text of the error."""
    try:
        message = decoder.decode(data, "/limbs")
    except PipeError as error:
        return str(error)
    numbers = {field: getattr(message, field) for field in (*JOINT_FIELDS, "values")}
    numbers = {name: None if values is None else values.tolist() for name, values in numbers.items()}
    return message.names, message.stamp, message.component, message.interfaces, numbers


@pytest.fixture
def messages():
    """Messages of all kinds, each several times with other numbers, in any order."""
    rng = np.random.default_rng(5)
    sets = [fields for count in range(4) for fields in itertools.combinations(JOINT_FIELDS, count)]
    kinds = itertools.product(JOINTS, sets, ("", "drives"), ((), ("bias",)))
    made = [packed(rng, *kind) for kind in kinds for _ in range(2)]
    return [made[index] for index in rng.permutation(len(made))]


def test_any_message_is_read_as_by_a_new_decoder(messages):
    decoder = codec(COMMAND)
    for data in messages:
        expected = read(codec(COMMAND), data)
        assert read(decoder, data) == expected
        assert read(decoder, data) == expected


def test_any_wrong_byte_is_read_as_by_a_new_decoder():
    rng, decoder = np.random.default_rng(6), codec(COMMAND)
    whole = packed(rng, ("hip", "knee"), ("position", "velocity"), "drives")
    decoder.decode(whole, "/limbs")
    for place in range(len(whole)):
        wrong = bytearray(whole)
        wrong[place] ^= 1
        assert read(decoder, bytes(wrong)) == read(codec(COMMAND), bytes(wrong))
        assert read(decoder, whole) == read(codec(COMMAND), whole)


@pytest.mark.parametrize("fields", [("velocity",), ("velocity", "effort"), ("position", "damping")])
def test_repeated_messages_have_numbers_of_their_own(fields):
    rng, decoder = np.random.default_rng(7), codec(COMMAND)
    first, second = (packed(rng, ("hip", "knee"), fields, "drives") for _ in range(2))
    alone = decoder.decode(first, "").numbers(fields[-1])
    before, message = decoder.decode(first, ""), decoder.decode(second, "")
    assert message.rows == fields and message.block.flags.aligned and message.block.flags.writeable
    assert_array_equal(message.block, [getattr(message, field) for field in fields])
    message.block[:] = 0.0
    assert_array_equal(before.numbers(fields[-1]), alone)


def test_rows_at_unequal_distances_lie_apart():
    rng, decoder = np.random.default_rng(8), codec(COMMAND)
    for _ in range(3):
        message = decoder.decode(packed(rng, ("hip", "knee"), ("position", "velocity", "damping"), ""), "")
        assert message.block is None and message.damping is not None
