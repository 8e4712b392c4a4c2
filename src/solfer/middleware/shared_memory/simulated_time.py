"""The time of a simulation. No clock follows it in shared memory, but all nodes see when it goes back."""

from pathlib import Path

from solfer.segments.latched import latched

SIMULATED_TIME_FILE = "simulated_time"
SIMULATED_TIME_KIND = "simulated time"
SIMULATED_TIME_LAYOUT = b'{"words": ["rewinds", "time [ns]"]}'
REWINDS, TIME = range(2)


class SimulatedTime:
    """The newest time that a simulator of this namespace has published; one that starts again begins before it.

    Args:
        folder: The namespace's folder.

    Attributes:
        words: The time [ns], and how often it has gone back.

    Raises:
        MiddlewareError: The folder cannot be used, or a foreign file is in the way.
    """

    def __init__(self, folder: Path):
        self._segment = latched(folder / SIMULATED_TIME_FILE, SIMULATED_TIME_KIND, SIMULATED_TIME_LAYOUT, size=16)
        self.words = self._segment.data[:16].cast("q")

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
