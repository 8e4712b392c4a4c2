"""Training of networks for the component `policy`, over the observations, actions, robot and engine that run them.

`Environment` has the interface of Gymnasium, `Environments` are several of them in processes of their own, and
`write_layers` writes what was trained as an ONNX file.
"""

from solfer.policy.environment import Environment
from solfer.policy.environments import Environments
from solfer.policy.onnx_file import write_layers

__all__ = ["Environment", "Environments", "write_layers"]
