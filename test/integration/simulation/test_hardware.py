"""The mock of a robot's hardware: names, order, numbers, delays and noise, against those of the robot behind it."""

from contextlib import closing

import numpy as np
import pytest
from support.integration.world import ROBOT, perfect

from solfer.config import read
from solfer.errors import SolferError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.simulation import Simulation
from solfer.simulation.mock_hardware.encoders import Encoders
from solfer.simulation.mock_hardware.mock_hardware import MockHardware
from solfer.simulation.mock_hardware.records import EncoderRecord, HardwareRecord
from solfer.simulation.sensors.kinds.joints import JointNoiseRecord
from solfer.transport import JointMessage, MessageStatus

MOCK = ROBOT / "hardware" / "mock.yaml"
STEP = 0.001  # [s]
DELAY = 2  # [steps], as in the shipped file


class Bench:
    """A mock and a node that receives from it and commands it, cycle by cycle.

    Attributes:
        received: For each message the simulated time of its arrival [s] and the message.
        truth: Positions, velocities and torques of the joints after each cycle.
    """

    def __init__(self, change=None):
        self.bus = Bus()
        middleware = MemoryMiddleware(self.bus, "bench")
        if change is None:
            self.mock = MockHardware.from_file(MOCK, MemoryMiddleware(self.bus, "hardware"))
        else:
            simulation = Simulation.from_file(perfect())
            self.mock = MockHardware(simulation, change(read(MOCK, HardwareRecord)), MemoryMiddleware(self.bus, "mock"))
        self.simulation = self.mock.simulation
        self.reader = middleware.reader("joint_states", "sensor_msgs/JointState")
        self.positions = middleware.writer("position_controller/command", "solfer/JointCommand")
        self.speeds = middleware.writer("velocity_controller/command", "solfer/JointCommand")
        self.received, self.truth = [], {}

    def cycle(self, count=1):
        joints = slice(6, None)
        for _ in range(count):
            self.mock.cycle()
            self.bus.time += STEP
            simulation = self.simulation
            state = simulation.q[joints].copy(), simulation.v[joints].copy(), simulation.torque[joints].copy()
            self.truth[simulation.count] = state
            if self.reader.read() is MessageStatus.NEW:
                self.received.append((simulation.time, self.reader.message))

    def names(self, controller):
        reply = self.bus.call(f"{controller}/get_joint_names")
        self.cycle()
        return reply.result(0).names


@pytest.fixture
def bench(request):
    """Return a function that makes benches, which are closed in the end."""

    def make(change=None):
        made = Bench(change)
        request.addfinalizer(made.mock.close)
        return made

    return make


def exact(record):
    """Make the same hardware without noise."""
    return record.model_copy(update={"joint_noise": JointNoiseRecord()})


def test_joints_have_hardware_names_order_and_numbers(bench):
    hardware = bench(exact)
    hardware.cycle(40)
    arrival, message = hardware.received[-1]
    records = read(MOCK, HardwareRecord).joints
    assert message.names == tuple(record.name for record in records.values())
    assert message.names != tuple(sorted(hardware.simulation.body.joints))
    position, velocity, torque = hardware.truth[round((arrival - DELAY * STEP) / STEP)]
    for index, (joint, record) in enumerate(records.items()):
        place = hardware.simulation.body.joints.index(joint)
        # a reading of zero is at `zero`; from there it counts along the joint or against it
        assert message.position[index] * record.direction + record.zero == pytest.approx(position[place], abs=1e-12)
        assert message.velocity[index] == record.direction * velocity[place]
        assert message.effort[index] == record.direction * torque[place]
    assert {record.direction for record in records.values()} == {1, -1}


def test_controllers_report_the_hardwares_names(bench):
    hardware = bench()
    assert hardware.names("velocity_controller") == ("J46", "J56", "J66", "J76")
    others = hardware.names("position_controller")
    assert others[:2] == ("J01", "J11") and len(others) == 38


def test_a_measurement_arrives_exactly_two_milliseconds_late(bench):
    hardware = bench(exact)
    hardware.cycle(50)
    assert [round(arrival / STEP) for arrival, _ in hardware.received] == [7, 12, 17, 22, 27, 32, 37, 42, 47]
    for arrival, message in hardware.received:
        assert arrival - message.stamp == pytest.approx(DELAY * STEP, abs=1e-12)


def test_a_command_acts_exactly_two_milliseconds_late(bench):
    hardware = bench()
    hardware.cycle(10)
    controller = hardware.simulation.lower_level.controllers["velocity_controller"]
    hardware.speeds.write(JointMessage(("J76", "J46"), velocity=np.array([1.5, 1.5])))
    seen = []
    for _ in range(4):
        hardware.cycle()
        seen.append(controller.velocity.copy())
    assert not seen[0].any() and not seen[1].any()
    # J76 is wheel 1, and J46 is wheel 4, which counts the other way round
    for velocity in seen[2:]:
        np.testing.assert_array_equal(velocity[[controller.joints.index(f"j_wheel_{k}") for k in (1, 4)]], (1.5, -1.5))


def test_positions_and_gains_are_those_of_the_joint(bench):
    hardware = bench()
    command = JointMessage(("J01",), np.array([0.25]), effort=np.array([3.0]), stiffness=np.array([400.0]))
    hardware.positions.write(command)
    hardware.cycle(DELAY + 1)
    controller = hardware.simulation.lower_level.controllers["position_controller"]
    place = controller.joints.index("torso_yaw")
    record = read(MOCK, HardwareRecord).joints["torso_yaw"]
    assert record.direction == -1
    assert controller.position[place] == pytest.approx(record.zero - 0.25)
    assert controller.effort[place] == -3.0
    hardware.cycle(250)  # within its lease
    assert controller.stiffness[place] == pytest.approx(400.0)


def test_hardware_refuses_the_models_names(bench, caplog):
    hardware = bench()
    controller = hardware.simulation.lower_level.controllers["position_controller"]
    before = controller.position.copy()
    hardware.positions.write(JointMessage(("torso_yaw",), np.array([0.2])))
    hardware.positions.write(JointMessage(("J01", "J1"), np.array([0.2, 0.2])))
    hardware.cycle(10)
    np.testing.assert_array_equal(controller.position, before)
    assert "unknown joint of the hardware 'torso_yaw'" in caplog.text


def test_claims_name_the_hardware_s_joints(bench):
    """A client of the hardware knows J46, never `j_wheel_1`: claims, refusals and lists must use those names."""
    hardware = bench()

    def ask(service, **request):
        reply = hardware.bus.call(f"lower_level/{service}", **request)
        hardware.cycle()
        return reply.result(0)

    wheels = {"controllers": ("velocity_controller",), "modes": ("velocity",)}
    assert ask("claim", owner="test", joints=("J46",), **wheels).success
    taken = ask("claim", owner="other", joints=("J46", "J76"), **wheels)
    assert not taken.success and "test" in taken.message
    refused = ask("claim", owner="other", joints=("j_wheel_1",), **wheels)
    assert not refused.success and "unknown joint of the hardware 'j_wheel_1'" in refused.message
    listed = ask("list_controllers")
    assert set(listed.joints[listed.names.index("velocity_controller")].split()) == {"J46", "J56", "J66", "J76"}


def test_noise_has_its_deviation_and_repeats_itself(bench):
    """Two runs are equal to the bit, and the errors against the delayed truth have the file's deviation."""
    first, second = bench(), bench()
    for hardware in (first, second):
        hardware.cycle(600)
    numbers = [np.array([message.position for _, message in hardware.received]) for hardware in (first, second)]
    assert len(numbers[0]) > 100
    np.testing.assert_array_equal(numbers[0], numbers[1])
    records = read(MOCK, HardwareRecord)
    errors = []
    for arrival, message in first.received:
        position, velocity, _ = first.truth[round((arrival - DELAY * STEP) / STEP)]
        place = [first.simulation.body.joints.index(joint) for joint in records.joints]
        direction = np.array([record.direction for record in records.joints.values()])
        zero = np.array([record.zero for record in records.joints.values()])
        errors.append(
            (direction * message.position + zero - position[place], direction * message.velocity - velocity[place])
        )
    deviation = np.std(errors, axis=(0, 2))
    noise = records.joint_noise
    np.testing.assert_allclose(deviation, (noise.position, noise.velocity), rtol=0.06)


def test_what_only_a_simulation_has_is_not_offered(bench):
    hardware = bench()
    with pytest.raises(UnknownName):
        hardware.bus.call("simulator/pause", data=True)
    truth = MemoryMiddleware(hardware.bus, "test").reader("floating_base", "nav_msgs/Odometry")
    hardware.cycle(20)
    assert truth.read() is MessageStatus.NONE


def test_its_health_is_that_of_hardware(bench):
    hardware = bench()
    hardware.cycle(1000)
    assert hardware.bus.reports["hardware"].summary == "running"
    assert "simulation" not in hardware.bus.reports


def changed(text, old, new, tmp_path):
    assert old in text
    path = tmp_path / "mock.yaml"
    path.write_text(
        text.replace(old, new)
        .replace("../robot.yaml", str(ROBOT / "robot.yaml"))
        .replace("gains.yaml", str(ROBOT / "hardware" / "gains.yaml"))
    )
    return path


@pytest.mark.parametrize(
    ("old", "new", "texts"),
    [
        ("torso_yaw:  ", "torso_jaw:  ", ["unknown joint 'torso_jaw'", "did you mean: torso_yaw", "mock.yaml:22:3"]),
        ("name: J11,", "name: J01,", ["two encoders have the name 'J01'", "mock.yaml:22:"]),
        ("command: 0.002", "command: 0.0025", ["a delay of 0.0025 s", "a multiple of 0.001 s", "mock.yaml:7:"]),
        ("xx: 0.36", "xx: 0.37", ["mock.yaml:15:"]),
        ("direction: -1", "direction: 0", ["expected 1 or -1, got 0", "mock.yaml:22:"]),
    ],
)
def test_a_wrong_mock_has_its_place(tmp_path, old, new, texts):
    path = changed(MOCK.read_text(), old, new, tmp_path)
    with pytest.raises(SolferError) as caught:
        MockHardware.from_file(path, MemoryMiddleware(Bus(), "mock"))
    for text in texts:
        assert text in str(caught.value)


def test_every_joint_has_an_encoder():
    encoder = EncoderRecord(name="J01", direction=1, zero=0.0)
    with pytest.raises(SolferError, match="joints without an encoder: knee, hip"):
        Encoders({"yaw": encoder}, ("yaw", "knee", "hip"))


class Ending(MemoryMiddleware):
    """Ends after some cycles."""

    cycles = 300

    def running(self):
        self.cycles -= 1
        return self.cycles >= 0


def test_it_runs_until_the_end_and_leaves_the_robot_at_rest():
    bus = Bus()
    with closing(MockHardware.from_file(MOCK, Ending(bus, "hardware"), factor=0.0)) as mock:
        simulation = mock.simulation
        writer = MemoryMiddleware(bus, "bench").writer("velocity_controller/command", "solfer/JointCommand")
        reply = bus.call("velocity_controller/get_joint_names")
        mock.cycle()
        names = reply.result(0).names
        writer.write(JointMessage(names, velocity=np.full(len(names), 0.5)))
        mock.run()
        assert simulation.count >= 300
        assert np.abs(simulation.v[6:]).max() < 0.05
