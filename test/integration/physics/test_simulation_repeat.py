"""Equal commands give equal motions, to the last bit."""

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np

from solfer.simulation import Simulation
from solfer.transport.messages import JointMessage

ROBOT = Path(__file__).resolve().parents[3] / "config/robots/centauro/robot.yaml"
WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")


def fingerprint(simulation: Simulation) -> str:
    """Hash of all states of a second in which the robot drives a curve and turns its torso."""
    digest = hashlib.sha256()
    for step in range(1000):
        if step % 20 == 0:
            speed = np.array([0.8, -1.6, 0.8, -1.6]) * np.sin(0.003 * step)
            simulation.lower_level.accept("velocity_controller", JointMessage(WHEELS, velocity=speed))
            turn = JointMessage(("torso_yaw",), position=np.array([0.3 * np.sin(0.004 * step)]))
            simulation.lower_level.accept("position_controller", turn)
        simulation.step()
        digest.update(simulation.q.tobytes() + simulation.v.tobytes() + simulation.torque.tobytes())
    return digest.hexdigest()


def test_the_same_run_repeats_bitwise():
    simulation, other = Simulation.from_file(ROBOT), Simulation.from_file(ROBOT)
    first = fingerprint(simulation)
    assert fingerprint(other) == first
    simulation.reset()
    assert simulation.time == 1.0  # it goes on
    assert fingerprint(simulation) == first
    simulation.close()
    other.close()
    run = subprocess.run([sys.executable, __file__], capture_output=True, text=True, check=True)
    assert run.stdout == first + "\n"  # and PyBullet's greetings are not on stdout


if __name__ == "__main__":
    print(fingerprint(Simulation.from_file(ROBOT)))
