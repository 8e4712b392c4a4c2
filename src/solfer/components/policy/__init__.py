"""The component `policy`: a trained network that maps observations to the commands of joints."""

from solfer.components.policy.component import Policy
from solfer.components.policy.tags import PolicyTags

__all__ = ["Policy", "PolicyTags"]
