"""Training of networks for the component `policy`, over the observations, actions, robot and engine that run them.

`Environment` has the interface of Gymnasium, and `Environments` several of them in processes of their own.
"""

from solfer.policy.environment import Environment
from solfer.policy.environments import Environments

__all__ = ["Environment", "Environments"]
