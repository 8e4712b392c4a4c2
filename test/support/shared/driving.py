"""`wheeled_motion` beside its odometry, driven by a plan, in memory and in an RT layer."""

import yaml
from support.integration.world import CONFIG
from support.shared.figure_5 import tree, write
from support.shared.middlewares import BEGIN, BLEND, STEP, InLayer, InMemory

from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.drive import Twist
from solfer.components.wheeled_motion.targets import WheelsSupport
from solfer.interfaces.geometry import Vector

LISTED = ("odometry", "driver")
"""The plugins, in the order of their cycles."""

PLAN = (
    (60, (0.15, 0.0, 0.0), 0.0),
    (240, (0.1, 0.1, 0.2), -0.02),
    (500, (0.0, -0.1, -0.3), 0.02),
    (760, (0.0, 0.0, 0.0), 0.0),
)
"""From a cycle on: velocity of the base and rate of its heading [m/s, rad/s], and speed of the vertices to the sides
[m/s]."""

FILTERS = {
    "filter": {"cut_off_frequency": 200, "damping": 1.0, "unit": "rad/s"},
    "velocity": {"cut_off_frequency": 200, "damping": 4.0, "unit": "rad/s"},
}
"""Of the odometry, the same in every layer."""

EVERY = 10
"""Cycles between two messages."""

LAST = 4600
"""Last step of the simulation that is compared."""


class PlannedDrive(WheeledMotion):
    """The component, which gets the messages of PLAN by itself: in the same cycles on every middleware."""

    def init(self):
        """See `WheeledMotion.init`."""
        super().init()
        self._cycles = 0

    def update(self):
        """See `WheeledMotion.update`."""
        self._cycles += 1
        now = [part for part in PLAN if part[0] <= self._cycles]
        if now and self._cycles % EVERY == 0:
            _, (x, y, turn), wider = now[-1]
            self.drive.receive(Twist(Vector(x, y), Vector(z=turn)))
            self.targets.receive(WheelsSupport(velocity=(0.0, wider, 0.0, 0.0, -wider, 0.0) * 2))
        super().update()


def write_driving(folder):
    """Write the configuration of all middlewares, and return the file."""
    shipped = tree()["mwoibn"]["modules"]["wheeled_motion"]
    legs = {"secondary_file": {"file": str(CONFIG / "support" / "lower_body.yaml")}}
    driver = shipped | legs | {"class": f"{__name__}:PlannedDrive", "blend": BLEND}
    part = yaml.safe_load((CONFIG / "support" / "odometry.yaml").read_text())
    part["mwoibn"].setdefault("modules", {})["odometry"] = FILTERS
    secondary = folder / "odometry.yaml"
    secondary.write_text(yaml.safe_dump(part))
    return write(
        folder,
        driver=driver,
        odometry={"blend": BLEND, "secondary_file": {"file": str(secondary)}},
        shared={"plugins": ["odometry3::odometry", "driver"]},
    )


class _Drives:
    """What both worlds have.

    Attributes:
        listed: See `LISTED`.
    """

    listed = LISTED

    def drive(self):
        """Let the plan be carried out."""
        self.bus.run_until(BEGIN + (LAST + 0.25) * STEP)


class DrivesInMemory(_Drives, InMemory):
    """CENTAURO on a bus, and the plugins of a file."""


class DrivesInLayer(_Drives, InLayer):
    """CENTAURO in shared memory, and the plugins under the executor of a layer's file."""
