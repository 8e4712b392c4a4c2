"""Measures the steps that a simulator in ROS makes beside floods of messages and requests from other nodes.

Needs a ROS master and `rosrun solfer simulator` beside it:

    ./run exec roslaunch solfer simulation.launch &
    ./run exec python benchmark/flood.py

Prints how much simulated time passes in a second (one, on a machine that has nothing else to do), the processor time
that the loop takes for a simulated millisecond, and that of the simulator's other threads in a second.
"""

import math
import multiprocessing
import os
import threading
import time
import xmlrpc.client
from collections.abc import Callable
from pathlib import Path

import rosgraph
import rospy
from form import Figures, parser_of
from sensor_msgs.msg import JointState

from solfer.middleware.ros.codecs.packed_message import MESSAGE_LENGTH
from solfer.msg import JointCommand
from solfer.srv import ClaimJoints, ClaimJointsRequest
from solfer.supervision import supervise

TOPIC = "/velocity_controller/command"
DURATION = 4.0  # [s] of each flood
TICKS = os.sysconf("SC_CLK_TCK")


class Large(JointCommand):
    """A command with 1e6 names, packed once."""

    BYTES = bytes(16) + MESSAGE_LENGTH.pack(10**6) + 10**6 * (MESSAGE_LENGTH.pack(1) + b"x") + bytes(20)

    def serialize(self, buffer) -> None:
        """Write the bytes."""
        buffer.write(self.BYTES)


def publish(message: object, name: str) -> None:
    """Publish as fast as it goes."""
    rospy.init_node(name)
    publisher = rospy.Publisher(TOPIC, type(message), queue_size=10)
    while not publisher.get_num_connections():
        time.sleep(0.01)
    while True:
        publisher.publish(message)


def request(claim: ClaimJointsRequest, name: str, threads: int = 4) -> None:
    """Call a service as fast as it goes, over connections that stay."""
    rospy.init_node(name)

    def call() -> None:
        while True:
            proxy = rospy.ServiceProxy("/lower_level/claim", ClaimJoints, persistent=True)
            try:
                while True:
                    proxy(claim)
            except (rospy.ServiceException, rospy.exceptions.TransportException, OSError):
                proxy.close()

    for _ in range(threads):
        threading.Thread(target=call, daemon=True).start()
    threading.Event().wait()


FLOODS: dict[str, Callable[[], None]] = {
    "none": lambda: threading.Event().wait(),
    "commands of 1e6 names": lambda: publish(Large(), "flood_large"),
    "wrong commands": lambda: publish(JointCommand(name=["no_such_joint"], velocity=[1.0]), "flood_wrong"),
    "claims": lambda: request(ClaimJointsRequest(owner="/x", controllers=["velocity_controler"]), "flood_claims"),
    "requests of 10 MB": lambda: request(ClaimJointsRequest(owner=10**7 * "x"), "flood_requests"),
}


def used(process: int) -> tuple[float, float]:
    """Read the processor time of the thread that simulates, and of all others of the simulator [s]."""

    def ticks(path: str) -> int:
        fields = Path(path).read_text().rpartition(")")[2].split()
        return int(fields[11]) + int(fields[12])

    loop = ticks(f"/proc/{process}/task/{process}/stat")
    return loop / TICKS, (ticks(f"/proc/{process}/stat") - loop) / TICKS


def measured(process: int, duration: float) -> tuple[float, float, float]:
    """Measure simulated seconds, and processor time of the loop and of all other threads meanwhile [s]."""
    numbers: list[int] = []
    subscriber = rospy.Subscriber("/joint_states", JointState, lambda message: numbers.append(message.header.seq))
    before = used(process)
    time.sleep(duration)
    after = used(process)
    subscriber.unregister()
    simulated = 0.005 * (numbers[-1] - numbers[0]) if numbers else math.nan
    return simulated, after[0] - before[0], after[1] - before[1]


def main() -> None:
    """Print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("--duration", type=float, default=DURATION, help="of each flood [s]")
    options = parser.parse_args()
    duration = options.duration
    figures = Figures(options.json)
    context, workers = multiprocessing.get_context("fork"), {}
    gates = {name: context.Event() for name in FLOODS}
    for name, flood in FLOODS.items():
        workers[name] = context.Process(target=_behind, args=(gates[name], flood), daemon=True)
        workers[name].start()  # before this process has threads
    rospy.init_node("flood")
    uri = rosgraph.Master("/flood").lookupNode("/simulator")
    process = xmlrpc.client.ServerProxy(uri).getPid("/flood")[2]
    for name, worker in workers.items():
        gates[name].set()
        time.sleep(2.0)
        simulated, loop, others = measured(process, duration)
        figures.row(name, factor=simulated / duration, loop_share=loop / simulated, others_share=others / duration)
        worker.kill()
        worker.join()
        time.sleep(1.0)


def _behind(gate, flood: Callable[[], None]) -> None:
    gate.wait()
    flood()


if __name__ == "__main__":
    supervise()
    main()
