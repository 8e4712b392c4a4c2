"""The time of a simulation. No clock follows it in shared memory, but all nodes see when it goes back."""

from pathlib import Path

from solfer.segments.latched import latched
from solfer.segments.words import words_of

# words of the memory
REWINDS = 0
TIME = 1


class SimulatedTime:
    """The newest time that a simulator of this namespace has published; one that starts again begins before it.

    Args:
        folder: The namespace's folder.

    Attributes:
        words: How often it has gone back, and the time [ns].

    Raises:
        MiddlewareError: The folder cannot be used, or a foreign file is in the way.
    """

    def __init__(self, folder: Path):
        layout = b'{"words": ["rewinds", "time [ns]"]}'
        self._segment = latched(folder / "simulated_time", "simulated time", layout, size=16)
        self.words = words_of(self._segment.data[:16])

    @property
    def rewinds(self) -> int:
        """How often it has gone back since the namespace was made; 0 where nothing is simulated."""
        return self.words[REWINDS]

    def close(self) -> None:
        """Leave it to the others; the time stays."""
        self._segment.leave()

    def publish(self, simulated: float) -> None:
        """Set the time [s]; only the simulator may."""
        words = self.words
        time = round(1e9 * simulated)
        if time < words[TIME]:
            words[REWINDS] += 1
        words[TIME] = time
