"""A process that drives a robot's wheels over shared memory and beats, for tests that kill it, stop it and cut it off.

    xbot_driver.py NAMESPACE SPEED
"""

import sys
import time

from solfer.middleware.xbot.board import Board
from solfer.middleware.xbot.middleware import XbotMiddleware
from solfer.middleware.xbot.namespace import Namespace
from solfer.pipes.messages import JointMessage

RATE = 500.0  # [Hz]
PATIENCE = 60.0  # [s]


def main(name: str, speed: float) -> None:
    """Drive until somebody ends this process."""
    namespace = Namespace(name)
    middleware = XbotMiddleware(namespace, "/driver")
    wheels = middleware.controller_joints("velocity_controller", PATIENCE)
    writer = middleware.writer("velocity_controller/command", "solfer/JointCommand")
    message = JointMessage.empty(wheels, ("velocity",))
    message.velocity[:] = speed
    board = Board.create(namespace.folder, RATE, ["driver"], ["component"])
    due = middleware.now()
    while True:
        writer.write(message)
        board.beat(time.monotonic_ns())
        due = max(due + 1.0 / RATE, middleware.now())
        middleware.sleep_until(due)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
