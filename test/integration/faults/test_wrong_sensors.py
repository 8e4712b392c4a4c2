"""The short form of `benchmark/chaos.py --sensors`: Fig. 5 with sensors, motors and commands that are wrong."""

from contextlib import closing

import numpy as np
import pytest
from breaking.sensors import MOTIONS, SensorTrial, drawn, judge
from support.integration.world import CONFIG, ROBOT
from support.paper.full_control import Nodes

from solfer.demo.waving import Waving
from solfer.middleware.memory import MemoryMiddleware, read_faults
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.transport.messages import FieldsMessage

NAMED = {
    "gyro_spikes": "an angular velocity of",
    "imu_upside_down": "the tilt leaps by",
    "joint_spikes": "leaps by",
    "second_stick": "are ignored while stick sends",
    "base_jump": "the estimate of the base has jumped",
    "jammed_wheel": "does not follow",
}
"""What the log says of faults, of each in any case."""


@pytest.mark.daily(1)
@pytest.mark.parametrize("fault", NAMED)
@pytest.mark.parametrize("motion", ["drives", "turns"])
def test_a_wrong_sensor_moves_nothing(motion, fault):
    trial = SensorTrial(motion, fault, 4)
    outcome = judge(trial, trial.run())
    assert outcome.complaints == []
    assert any(NAMED[fault] in text for _, text in outcome.named)


@pytest.mark.daily(1)
@pytest.mark.parametrize("seed", [20119, 20183, 20105, 20036])
def test_a_wrong_posture_moves_no_leg(seed):
    """Swapped joints, another sign and other scales of legs that stand: the posture stays refused, or topples it."""
    trial = drawn(seed)
    outcome = judge(trial, trial.run())
    assert outcome.complaints == [] and outcome.named[0][0] < 0.02


@pytest.mark.daily(1)
@pytest.mark.parametrize("motion", ["drives", "turns"])
def test_joints_that_freeze_are_named_and_the_robot_rests_meanwhile(motion):
    """All plugins hold, and go on when joints move again: the estimate of the base has not run away."""
    outcome = SensorTrial(motion, "joints_freeze", 4).run()
    frozen = next(time for time, text in outcome.named if "no number has changed, though joints were" in text)
    assert frozen < 0.25
    assert outcome.joint < 1.0 and outcome.base < 0.3 and outcome.tilt < 0.02
    assert outcome.pause < 0.02 and outcome.rest == pytest.approx(MOTIONS[motion][0], rel=0.1)


class Noisy(Nodes):
    """With three times the errors of the shipped sensors and of the mock's joints."""

    def offer(self, middleware):
        """See `World.offer`."""
        bundle = read_bundle(ROBOT / "robot.yaml")
        sensors, imu = bundle.sensors, bundle.sensors.imu
        errors = {name: tripled(getattr(imu, name)) for name in ("gyroscope", "accelerometer")}
        joints = tripled(sensors.joint_noise).model_copy(update={"position": 3e-4, "velocity": 6e-3})
        sensors = sensors.model_copy(update={"imu": imu.model_copy(update=errors), "joint_noise": joints})
        simulation = Simulation.from_file(bundle.model_copy(update={"sensors": sensors}))
        return simulation, SimulationServer(simulation, middleware)


def tripled(record):
    """Return a record of errors, each three times as large."""
    return record.model_copy(update={name: 3.0 * value for name, value in record if isinstance(value, float)})


@pytest.mark.daily(1)
@pytest.mark.parametrize("transport", ["good", "bad"])
@pytest.mark.parametrize("seed", [1, 2])
def test_noise_pushes_and_a_fall_contradict_no_sensor(transport, seed, caplog):
    """Pushed by 300 N at drawn links, and over at last."""
    faults = read_faults(CONFIG / "transport" / "bad.yaml") if transport == "bad" else None
    draw = np.random.default_rng(seed)
    with closing(Noisy(None, faults)) as world:
        world.run(1.0)
        stick = MemoryMiddleware(world.bus, "stick").writer("locomotion/cmd_vel", "geometry_msgs/Twist")
        waving = Waving(MemoryMiddleware(world.bus, "waving"), "hands", world.hands())
        begin = world.bus.time
        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        for step in range(120):
            ahead = 0.4 if step % 60 < 30 else -0.4
            stick.write(FieldsMessage({"linear": zero | {"x": ahead}, "angular": zero | {"z": -ahead}}))
            waving.send(world.bus.time - begin)
            if step % 40 == 20:
                force = draw.normal(size=3) * (1.0, 1.0, 0.0)
                link = str(draw.choice(["pelvis", "wheel_1", "arm1_7", "arm2_4"]))
                world.simulation.pushes.add(link, 300.0 / np.linalg.norm(force) * force, (0.0, 0.0, 0.0), 0.3)
            world.run(0.02)
        world.simulation.pushes.add("pelvis", (0.0, 1500.0, 500.0), (0.0, 0.0, 0.0), 1.0)
        world.run(2.0)
        assert world.simulation.state.now.rotation("pelvis")[2, 2] < 0.5
    assert "otherwise than by its velocities" not in caplog.text
    assert "from the mean of the accelerometer" not in caplog.text
