"""What several tests of table 1 share."""

import numpy as np
from support.bullet import raw_bullet
from support.simulation.engine_state import joint_states
from support.table_1 import FILE, GRAVITY, Table1System


class MemorySystem(Table1System):
    """All in one process, on a virtual clock.

    Args:
        world: The robot.
        file: Configuration of the plugins.
    """

    def __init__(self, world, file=FILE):
        self.world = world
        self.speaker = self.world.plugin("speaker", file)
        self.world.run(0.3)
        self.listener = self.world.plugin("listener", file)
        self.spring = self.world.plugin("spring", file)
        self.world.run(2.0)
        self._body = self.world.simulation.body
        self._raw = raw_bullet(self.world.simulation)
        self.weight = GRAVITY * self._body.mass()

    def ask(self, **request):
        reply = self.world.ask("speaker/trajectory", **request)
        assert reply.success, reply.message
        return reply.duration

    def run(self, duration):
        self.world.run(duration)

    def joint(self, name):
        states, number = joint_states(self._body.robot), self._body.joints.index(name)
        return states.position[number], states.velocity[number]

    def pose(self, link):
        bullet, client, body, *_ = self._raw
        number = self._raw.links[link]
        if number < 0:  # the base: PyBullet has its centre of mass
            center = bullet.getBasePositionAndOrientation(body, client)
            way = bullet.invertTransform(*bullet.getDynamicsInfo(body, -1, client)[3:5])
            return tuple(np.array(part) for part in bullet.multiplyTransforms(*center, *way))
        return tuple(np.array(part) for part in bullet.getLinkState(body, number, False, True, client)[4:6])

    def ground(self):
        points = self._body.robot.contacts()
        forces = np.array([point.force for point in points])
        places = np.array([point.position for point in points])
        return forces.sum(axis=0), np.average(places[:, :2], axis=0, weights=forces[:, 2])
