"""Motion of the simulated CENTAURO, and recordings of it."""

import numpy as np
from support.integration.world import ROBOT, STEP, World

from solfer.recording.model import COLUMNS_KIND, JOINTS_KIND, Channel, Event, Recording

AGE = "joint_states/feedback/link_side_online/age"
POSITION = "joint_states/feedback/link_side_online/position"
PARTS = ("arm", "neck", "torso_yaw", "hip_pitch")
BASE = 6  # DoFs


class Motion:
    """CENTAURO's joints, each of which moves in its own way.

    Attributes:
        joints: Their names.
        moved: Names of those that were asked to move, all but the legs.
        positions: Where they were in each millisecond, shape (T, joints) [rad].
    """

    def __init__(self, requests: int = 6, seed: int = 0):
        self._cycles = []
        world = World()
        try:
            self._run(world, requests, np.random.default_rng(seed))
        finally:
            world.close()

    def _run(self, world, requests, rng):
        plugin = world.plugin("joint_states")
        robot = plugin.robot
        world.run(0.5)
        rows = []
        world.bus.every(STEP, lambda: rows.append(world.simulation.q.copy()))
        world.bus.every(1.0 / plugin.rate, lambda: self._take(plugin, world.bus.time))
        chosen = [name for name in robot.dofs if any(part in name for part in PARTS)]
        dofs = [robot.dof(name) for name in chosen]
        share = np.array([0.05 if "hip" in name else 0.25 for name in chosen])
        start = robot.state.position[dofs].copy()
        lower, upper = robot.lower_limits.position[dofs] + 0.01, robot.upper_limits.position[dofs] - 0.01
        for _ in range(requests):
            goal = np.clip(start + share * rng.uniform(-1.0, 1.0, len(dofs)), lower, upper)
            assert world.ask(joints=tuple(chosen), positions=tuple(goal), speed=1.0).success
            world.run(rng.uniform(0.3, 0.6))
        self.joints = tuple(robot.dofs[BASE:])
        self.moved = [name for name in chosen if "hip" not in name]
        self.positions = np.array(rows)[:, BASE:]

    def _take(self, plugin, now):
        robot, age = plugin.robot, now - plugin.feedbacks[0].arrival
        numbers = (robot.state.position, robot.command.position, np.array(plugin.timing.times) * 1e-9, [age])
        self._cycles.append((now, *(np.array(each) for each in numbers)))

    def cycles(self):
        """Return what the plugin measured, sent and needed in each cycle, with the URDF attached."""
        times, *values = (np.array(each) for each in zip(*self._cycles, strict=True))
        stages = ("calls", "read", "robot", "component", "gate", "write")
        names = (POSITION, "joint_states/command/position_controller/position", "joint_states/timing", AGE)
        joints = (self.joints, ("rad",) * len(self.joints), JOINTS_KIND)
        forms = (joints, joints, (stages, ("s",) * len(stages), COLUMNS_KIND), (("age",), ("s",), COLUMNS_KIND))
        channels = {}
        for name, (columns, units, kind), numbers in zip(names, forms, values, strict=True):
            numbers = numbers[:, -len(columns) :]
            channels[name] = Channel(name, kind, columns, units, "", times, numbers)
        events = [Event(float(times[0]), "joint_states", "start"), Event(float(times[-1]), "joint_states", "stop")]
        return Recording(channels, events, {"robot.urdf": (ROBOT / "centauro.urdf").read_bytes()}, {"version": "1"})

    def recording(self, positions=None, rate=200.0, start=0.0, clock=0.0, noise=0.0, seed=0):
        """Return what sensors of a rate [Hz] and a noise [rad] record from `start` [s] on, by their own clock."""
        positions = self.positions if positions is None else positions
        rows = positions[round(start / STEP) :: round(1.0 / rate / STEP)]
        times = clock + np.arange(len(rows)) / rate
        values = rows + noise * np.random.default_rng(seed).standard_normal(rows.shape)
        units = ("rad",) * len(self.joints)
        return Recording({POSITION: Channel(POSITION, JOINTS_KIND, self.joints, units, "", times, values)})
