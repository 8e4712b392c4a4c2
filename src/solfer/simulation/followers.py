"""Who works in lock-step with a simulation."""

from collections.abc import Callable


class Followers:
    """Nobody. A middleware may have nodes that follow a simulation, which waits after each step for their cycles."""

    def present(self) -> bool:
        """Whether all followers are there; until then simulated time stands still."""
        return True

    def follow(self, now: float, meanwhile: Callable[[], None]) -> None:
        """Return when the followers have made the cycles that are due at simulated time `now` [s].

        Args:
            now: Simulated time [s].
            meanwhile: To be called again and again: answers requests that a follower may wait for.
        """
