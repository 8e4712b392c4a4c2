"""SOL-FER: Simplifying Operations in Locomotion, a Framework for Efficient Research."""

from solfer.lazy import lazy

__all__ = ["Robot"]


# imported when it is first used: commands that need no Robot start without Pinocchio
__getattr__ = lazy(__name__, {"Robot": "robot"})
