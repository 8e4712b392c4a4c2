"""CDR, the format of messages, little endian: numbers are aligned to their size behind the first 4 bytes."""

import functools
import struct

import numpy as np

ENCAPSULATION = b"\x00\x01\x00\x00"
LENGTH = struct.Struct("<I")
TIME = struct.Struct("<iI")
FLOAT64 = np.dtype("<f8")
NO_VALUES = np.zeros(0)


class CdrWriter:
    """Packs the parts of a message, one after the other.

    Attributes:
        bytes: What is packed so far.
    """

    def __init__(self) -> None:
        self.bytes = bytearray(ENCAPSULATION)

    def time(self, seconds: int, nanoseconds: int) -> None:
        """Pack a stamp."""
        self._align(4)
        self.bytes += TIME.pack(seconds, nanoseconds)

    def count(self, number: int) -> None:
        """Pack a uint32."""
        self._align(4)
        self.bytes += LENGTH.pack(number)

    def text(self, text: str) -> None:
        """Pack a text."""
        self._align(4)
        self.bytes += _packed_text(text)

    def texts(self, texts: tuple[str, ...]) -> None:
        """Pack a list of texts, which mostly was packed before."""
        self._align(4)
        self.bytes += packed_texts(texts)

    def numbers(self, values: np.ndarray) -> None:
        """Pack a fixed count of numbers, shape (n,)."""
        if len(values):
            self._align(8)
            self.bytes += np.asarray(values, FLOAT64).tobytes()

    def array(self, values: np.ndarray | None) -> None:
        """Pack a list of numbers, shape (n,); None is an empty one."""
        values = NO_VALUES if values is None else values
        self.count(len(values))
        self.numbers(values)

    def flags(self, values: tuple[bool, ...]) -> None:
        """Pack a list of booleans."""
        self.count(len(values))
        self.bytes += bytes(values)

    def _align(self, size: int) -> None:
        self.bytes += bytes(-(len(self.bytes) - len(ENCAPSULATION)) % size)


class CdrReader:
    """Unpacks the parts of a message, one after the other.

    Args:
        packed: The message.

    Raises:
        ValueError: It is not little endian, or no plain CDR.
    """

    def __init__(self, packed: bytes):
        if packed[:2] != ENCAPSULATION[:2]:
            raise ValueError("not little endian, plain CDR")
        self._packed = packed
        self._at = len(ENCAPSULATION)

    def time(self) -> float:
        """Unpack a stamp [s]."""
        seconds, nanoseconds = TIME.unpack_from(self._packed, self._begin(4, TIME.size))
        return seconds + 1e-9 * nanoseconds

    def count(self) -> int:
        """Unpack a uint32."""
        return LENGTH.unpack_from(self._packed, self._begin(4, LENGTH.size))[0]

    def text(self) -> str:
        """Unpack a text."""
        length = self.count()
        begin = self._begin(1, length)
        return self._packed[begin : begin + max(length - 1, 0)].decode()

    def texts(self, known: tuple[str, ...]) -> tuple[str, ...]:
        """Unpack a list of texts, which is fast if they are `known`."""
        begin = self._begin(4, 0)
        packed = packed_texts(known)
        if self._packed.startswith(packed, begin):
            self._at += len(packed)
            return known
        return tuple(self.text() for _ in range(self._bounded(5)))

    def numbers(self, count: int) -> np.ndarray:
        """Unpack a fixed count of numbers, shape (count,)."""
        if not count:
            return NO_VALUES
        return np.frombuffer(self._packed, FLOAT64, count, self._begin(8, 8 * count)).copy()

    def array(self) -> np.ndarray:
        """Unpack a list of numbers, shape (n,)."""
        return self.numbers(self._bounded(8))

    def flags(self) -> tuple[bool, ...]:
        """Unpack a list of booleans."""
        count = self._bounded(1)
        begin = self._begin(1, count)
        return tuple(map(bool, self._packed[begin : begin + count]))

    def _bounded(self, size: int) -> int:
        """Unpack the length of a list whose elements have at least `size` bytes."""
        count = self.count()
        if count * size > len(self._packed):
            raise ValueError(f"a list of {count}")
        return count

    def _begin(self, alignment: int, size: int) -> int:
        """Return the offset of a part of a size [bytes], and go on behind it."""
        begin = self._at + -(self._at - len(ENCAPSULATION)) % alignment
        self._at = begin + size
        if size and self._at > len(self._packed):
            raise ValueError("it ends too early")
        return begin


def _packed_text(text: str) -> bytes:
    encoded = text.encode() + b"\0"
    return LENGTH.pack(len(encoded)) + encoded


@functools.lru_cache(64)
def packed_texts(texts: tuple[str, ...]) -> bytes:
    """Pack a list of texts that begins at a multiple of 4 bytes."""
    packed = bytearray(LENGTH.pack(len(texts)))
    for text in texts:
        packed += bytes(-len(packed) % 4) + _packed_text(text)
    return bytes(packed)
