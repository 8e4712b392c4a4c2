"""A process with a heartbeat that drives a robot's wheels over shared memory, for tests that kill, stop or isolate it.

xbot_driver.py NAMESPACE SPEED
"""

import sys
import time

from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.segments.namespace import Namespace
from solfer.telemetry.statistics import RuntimeStatistics
from solfer.transport.lower_level import CLAIM_INTERFACE, LOWER_LEVEL, ClaimAnswer, ClaimRequest
from solfer.transport.messages import JointMessage

RATE = 500.0  # [Hz]
PATIENCE = 60.0  # [s]


def main(name: str, speed: float) -> None:
    """Drive until this process is ended."""
    namespace = Namespace(name)
    middleware = XbotMiddleware(namespace, "/driver")
    wheels = middleware.controller_joints("velocity_controller", PATIENCE)
    writer = middleware.writer("velocity_controller/command", "solfer/JointCommand")
    message = JointMessage.empty(wheels, ("velocity",))
    message.velocity[:] = speed
    request = ClaimRequest(middleware.name, ("velocity_controller",))
    middleware.call(f"{LOWER_LEVEL}/claim", CLAIM_INTERFACE, request, ClaimAnswer, PATIENCE)
    statistics = RuntimeStatistics.create(namespace.folder, RATE, ["driver"], ["component"])
    due = middleware.now()
    while True:
        writer.write(message)
        statistics.beat(time.monotonic_ns())
        due = max(due + 1.0 / RATE, middleware.now())
        middleware.sleep_until(due)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
