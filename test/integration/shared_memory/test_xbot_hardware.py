"""The RT layer on a mock of the hardware, each in a process: `--hardware` and `--system HW`, and nothing else."""

import time

import pytest
import yaml
from support.integration.world import CONFIG, ROBOT
from support.integration.xbot_system import REPOSITORY, WAIT, WORLD, system, until

from solfer.components.move_joints import MoveJoints, Reply
from solfer.middleware.shared_memory.discovery import published_topics

MOCK = ROBOT / "hardware" / "mock.yaml"
GOAL = {"torso_yaw": 0.3, "neck_yaw": -0.2}  # [rad]
UNLOADED = 0.035
"""How far the hardware's soft springs give way to gravity [rad]."""

LAYER = """
XBotRTPlugins: {{plugins: [joint_states]}}
mwoibn: {{config_file: {{file: {main}}}}}
executor: {{start: [joint_states], blend: 0.2, overruns: 1000000, schedule: {{priority: 0}}}}
"""


@pytest.fixture
def hardware(tmp_path):
    layer = tmp_path / "layer.yaml"
    layer.write_text(LAYER.format(main=CONFIG / "centauro.yaml"))
    with system() as made:
        # a machine that stalls shall not make it hold
        made.start(
            REPOSITORY / "nodes" / "xbot_simulator",
            "--namespace",
            made.name,
            "--hardware",
            str(MOCK),
            "--world",
            str(WORLD),
            "--cycles",
            "100000",
        )
        until(made.look, "joint states")
        made.start(REPOSITORY / "nodes" / "xbot", str(layer), "--namespace", made.name, "--system", "HW")
        yield made


def asked(robot):
    """Ask for the goal; whether it was accepted."""
    answer = robot.middleware.request(
        "joint_states/trajectory",
        "solfer/MoveJoints",
        MoveJoints(joints=tuple(GOAL), positions=tuple(GOAL.values()), speed=1.0),
        Reply,
        WAIT,
    )
    until(lambda: robot.middleware.poll() or answer.done(), "an answer")
    return not answer.exception(0) and answer.result(0).success


@pytest.mark.soak
def test_the_layer_moves_differently_named_hardware(hardware):
    """The encoders' raw readings are the reference; this hardware publishes no floating base, and none is needed."""
    encoders = yaml.safe_load(MOCK.read_text())["joints"]
    assert list(hardware.joints) == [encoder["name"] for encoder in encoders.values()]
    assert "floating_base" not in {each.topic for each in published_topics(hardware.namespace)}

    def away():
        """How far the drives really are from the goal [rad], by the way in which their encoders are mounted."""
        hardware.look()
        readings = dict(zip(hardware.joints, hardware.samples[-1][1], strict=True))
        postures = {
            joint: encoder["direction"] * readings[encoder["name"]] + encoder["zero"]
            for joint, encoder in encoders.items()
        }
        return max(abs(postures[joint] - goal) for joint, goal in GOAL.items())

    def moved():
        """Whether it is there; a layer that has lost its joints to a stall forgets what it was asked for."""
        end = time.monotonic() + 5.0
        if asked(hardware):
            while away() > UNLOADED and time.monotonic() < end:
                time.sleep(0.01)
        return away() < UNLOADED

    assert away() > 0.1
    until(moved, "the hardware at its goal")
