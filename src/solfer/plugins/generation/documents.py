"""What a recording needs to repeat a plugin."""

import json
from contextlib import suppress

from solfer.config import Configuration
from solfer.errors import UnknownName
from solfer.recording.log import RunDocuments
from solfer.robot import Robot
from solfer.transport import Middleware
from solfer.transport.middleware import SEED


def documents_of(configuration: Configuration, robot: Robot, middleware: Middleware) -> RunDocuments:
    """Return a plugin's configuration, the description of its robot, its tags, and the seed of a simulated robot."""
    files = {"configuration.yaml": configuration.text(), "robot.urdf": robot.description.text}
    if robot.semantics.text:
        files["robot.srdf"] = robot.semantics.text
    texts = {f"{configuration.module.name}/tags": json.dumps(configuration.own_tags())}
    with suppress(UnknownName):  # a robot of hardware has none
        texts["seed"] = str(middleware.parameter(SEED))
    return RunDocuments(files, texts)
