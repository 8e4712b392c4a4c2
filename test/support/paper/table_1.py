"""What several tests of table 1 share."""

import numpy as np
from support.table_1 import FILE, GRAVITY, System


class MemorySystem(System):
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
        engine = self.world.simulation._engine
        self._bullet, self._client, self._body = engine.bullet, engine.client, self.world.simulation.body.id
        bodies = range(-1, self._bullet.getNumJoints(self._body, self._client))
        self._infos = [self._bullet.getJointInfo(self._body, index, self._client) for index in bodies if index >= 0]
        masses = [self._bullet.getDynamicsInfo(self._body, index, self._client)[0] for index in bodies]
        self.weight = GRAVITY * sum(masses)

    def ask(self, **request):
        reply = self.world.ask("speaker/trajectory", **request)
        assert reply.success, reply.message
        return reply.duration

    def run(self, duration):
        self.world.run(duration)

    def joint(self, name):
        number = next(info[0] for info in self._infos if info[1].decode() == name)
        return self._bullet.getJointState(self._body, number, self._client)[:2]

    def pose(self, link):
        number = next((info[0] for info in self._infos if info[12].decode() == link), None)
        if number is None:  # the base: PyBullet has its centre of mass
            center = self._bullet.getBasePositionAndOrientation(self._body, self._client)
            way = self._bullet.invertTransform(*self._bullet.getDynamicsInfo(self._body, -1, self._client)[3:5])
            return tuple(np.array(part) for part in self._bullet.multiplyTransforms(*center, *way))
        return tuple(
            np.array(part) for part in self._bullet.getLinkState(self._body, number, False, True, self._client)[4:6]
        )

    def ground(self):
        points = self._bullet.getContactPoints(self._body, physicsClientId=self._client)
        forces = np.array(
            [
                np.dot(point[9], point[7]) + np.dot(point[10], point[11]) + np.dot(point[12], point[13])
                for point in points
            ]
        )
        places = np.array([point[5] for point in points])
        return forces.sum(axis=0), np.average(places[:, :2], axis=0, weights=forces[:, 2])
