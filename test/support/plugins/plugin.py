"""What several tests of plugin share."""

import numpy as np
import yaml
from support.integration.world import CONFIG, ROBOT

from solfer.components import Component
from solfer.middleware.memory import MemoryMiddleware

WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")


class Saboteur(Component):
    """Fails in one step of its life, or commands NaN, and turns the wheels until then."""

    step = ""

    def _maybe(self, step):
        if self.step == step:
            raise RuntimeError(f"sabotage in {step}")

    def init(self):
        self.model.command.position[:] = self.model.state.position
        self.cycles = 0
        self._maybe("init")

    def update(self):
        self.cycles += 1
        self.model.command.velocity[[self.model.dof(wheel) for wheel in WHEELS]] = (1.0, -1.0, 1.0, -1.0)
        if self.cycles > 100:
            self._maybe("update")
            if self.step == "nan":
                self.model.command.position[self.model.dof("torso_yaw")] = np.nan

    def send(self):
        if self.cycles > 100:
            self._maybe("send")

    def stop(self):
        self._maybe("stop")

    def close(self):
        self._maybe("close")


class SilentRelay:
    """Publishes messages of one topic on another one, until it does not; the robot itself goes on.

    Args:
        world: The World.
        topic: The topic.
        message: The type of its messages.
    """

    topic = "relayed"

    def __init__(self, world, topic, message):
        middleware = MemoryMiddleware(world.bus, "relay")
        self.received = True
        self._reader = middleware.reader(topic, message)
        self._writer = middleware.writer(self.topic, message)
        world.bus.every(0.002, self._publish)

    def _publish(self):
        if self.received and self._reader.read():
            self._writer.write(self._reader.message)


def configuration(tmp_path, **tags):
    """Load the shipped configuration with a module `test` of other tags."""
    tree = yaml.safe_load((CONFIG / "centauro.yaml").read_text())
    for name in ("actuators", "contacts"):
        tree["mwoibn"]["ros"]["source"][name] = {"file": str(ROBOT / f"{name}.yaml")}
    for place in (*tree["mwoibn"]["layers"].values(), *tree["mwoibn"]["robot"]["systems"].values()):
        place["file"] = str(CONFIG / place["file"])
    module = {
        key: tree["mwoibn"]["modules"]["joint_states"][key]
        for key in ("layer", "robot", "controller", "mode", "kinematics", "dynamics", "model_change")
    }
    tree["mwoibn"]["modules"]["test"] = module | tags
    path = tmp_path / "configuration.yaml"
    path.write_text(yaml.safe_dump(tree))
    return path
