"""What several tests of bodies share."""

import tempfile
from pathlib import Path

import numpy as np
import pybullet
from system import numbers

from solfer.model import Description
from solfer.simulation.bullet.robot import READER
from solfer.simulation.loading.body_urdf import body_urdf


class Bullet:
    """PyBullet's own copy of the robot, put where the robot is by its messages."""

    def __init__(self, description: str):
        self.client = pybullet.connect(pybullet.DIRECT)
        with tempfile.TemporaryDirectory() as folder:
            self.urdf = body_urdf(Description.from_text(description), True, Path(folder), reader=READER)
            file = Path(folder, "robot.urdf")
            file.write_text(self.urdf.text)
            self.body = pybullet.loadURDF(str(file), physicsClientId=self.client)
        infos = [
            pybullet.getJointInfo(self.body, index, self.client)
            for index in range(pybullet.getNumJoints(self.body, self.client))
        ]
        self.joints = {info[1].decode(): info[0] for info in infos}
        self.links = {info[12].decode(): info[0] for info in infos}

    def place(self, pose, joints):
        """Put base and joints."""
        offset = pybullet.getDynamicsInfo(self.body, -1, self.client)[3:5]
        base = pybullet.multiplyTransforms(numbers(pose.position).tolist(), numbers(pose.orientation).tolist(), *offset)
        pybullet.resetBasePositionAndOrientation(self.body, *base, self.client)
        for name, position in joints.items():
            pybullet.resetJointState(self.body, self.joints[name], position, physicsClientId=self.client)

    def center_of_mass(self):
        """Centre of mass of all links [m]."""
        masses = [pybullet.getDynamicsInfo(self.body, index, self.client)[0] for index in (-1, *self.joints.values())]
        places = [pybullet.getBasePositionAndOrientation(self.body, self.client)[0]]
        states = pybullet.getLinkStates(self.body, list(self.joints.values()), True, True, self.client)
        return np.average(places + [state[0] for state in states], axis=0, weights=masses)

    def position(self, link):
        """Origin of a link [m]."""
        return np.array(pybullet.getLinkState(self.body, self.links[link], True, True, self.client)[4])
