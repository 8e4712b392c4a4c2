"""The emergency stop."""


class EmergencyStop:
    """A latch: once tripped it stays until it is reset. Springs fade out, dampers stay.

    Args:
        fade: Time in which the springs and the feed-forward torques fade out [s].

    Attributes:
        reason: Why it was tripped; empty while it is not.
        factor: Factor of springs and feed-forward torques, from 1 down to 0.
    """

    def __init__(self, fade: float):
        self._fade = fade
        self.reason = ""
        self.factor = 1.0

    def __bool__(self) -> bool:
        return bool(self.reason)

    def trip(self, reason: str) -> None:
        """Trip the latch; the first reason stays."""
        self.reason = self.reason or reason

    def reset(self) -> None:
        """Release the latch."""
        self.reason = ""
        self.factor = 1.0

    def advance(self, dt: float) -> None:
        """Fade for `dt` [s]."""
        if self.reason:
            self.factor = max(0.0, self.factor - dt / self._fade)
