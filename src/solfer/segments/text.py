"""Text in a record of float64."""

import numpy as np

from solfer.errors import MiddlewareError


class Text:
    """Bytes in an array of float64, behind their length.

    Args:
        values: Where they lie, shape (n,).
    """

    def __init__(self, values: np.ndarray):
        self._length = values[:1]
        self._bytes = values[1:].view(np.uint8)

    @staticmethod
    def width(size: int) -> int:
        """Compute how many numbers `size` bytes need."""
        return 1 + -(-size // 8)

    @property
    def size(self) -> int:
        """Bytes that fit."""
        return len(self._bytes)

    def write(self, text: bytes) -> None:
        """Write a text.

        Raises:
            MiddlewareError: It does not fit.
        """
        if len(text) > self.size:
            raise MiddlewareError(f"{len(text)} bytes do not fit into shared memory", expected=f"at most {self.size}")
        self._length[0] = len(text)
        self._bytes[: len(text)] = np.frombuffer(text, np.uint8)

    def read(self) -> bytes:
        """Read the text."""
        return self._bytes[: int(self._length[0])].tobytes()
