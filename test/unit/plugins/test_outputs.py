"""Commands of a plugin, from the measured state to those of the component, and at rest; without a robot's body."""

import numpy as np
import pytest
from support.unit.joint_pipes import RATE, dofs, make_robot, published

from solfer.components import Component, Port
from solfer.errors import NotFinite
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.plugins.outputs.command_gate import CommandGate
from solfer.plugins.outputs.outputs import Outputs
from solfer.plugins.outputs.start_blend import StartBlend

SHORTEST = 0.5  # [s]


class CartOutputs:
    """Pipes of a cart to its lower level, and to others.

    Args:
        interface: Fields of the pipe to the lower level.
        filter: Its filter.
        measured: Joints whose position is measured; None: all.
        idle: Whether the plugin is idle.
        efforts: Whether efforts are measured.
    """

    def __init__(self, interface=("position",), filter=None, measured=None, idle=False, efforts=False):
        self.robot, self.middleware = make_robot(), MemoryMiddleware(Bus(), "cart")
        context = PipeContext(self.robot, self.middleware, {}, RATE)
        pipe = factory.controller(
            published(
                name="arm",
                type="impedance",
                sink="/command",
                dofs=dofs(mapping="ACTUATED"),
                interface=dict.fromkeys(interface, True),
                filter=filter,
            ),
            context,
        )
        other = factory.controller(published(sink="out", interface={"position": True, "velocity": True}), context)
        known = None if measured is None else np.isin(self.robot.dofs, measured)
        everything = np.ones(self.robot.size, dtype=bool)
        self.blend = StartBlend(
            "cart", [pipe], self.robot, RATE, SHORTEST, measured=known, efforts=everything if efforts else None
        )
        gate = CommandGate("cart", pipe, self.robot.lower_limits, self.robot.upper_limits)
        self.outputs = Outputs([(pipe, gate), (other, None)], self.blend, self.robot, 1.0 / RATE, idle)
        self.names = pipe.message.names
        receiver = MemoryMiddleware(self.middleware.bus, "receiver")
        self.commands = receiver.queue("arm/command", "solfer/JointCommand", 10000)
        self.published = receiver.queue("out", "solfer/JointCommand", 10000)
        self.dof = self.robot.dofs.index

    def cycles(self, duration, moves=lambda: None):
        """Run cycles for `duration` [s]; return the commands to the lower level by field, a row for each cycle."""
        self.commands.drain()
        for _ in range(round(duration * RATE)):
            moves()
            self.outputs.collect()
            self.outputs.send(0.0)
        sent = self.commands.drain()
        return {
            field: np.array([getattr(message, field) for message in sent])
            for field in ("position", "velocity", "effort")
            if getattr(sent[0], field) is not None
        }

    def place(self, joint):
        """Return the index of a joint in a command."""
        return self.names.index(joint)


def test_a_start_without_a_gap_is_not_blended():
    sender = CartOutputs(("position", "velocity", "effort"))
    shoulder = sender.dof("shoulder")
    sender.robot.state.position[shoulder] = sender.robot.command.position[shoulder] = 0.7
    sender.outputs.start()
    goes = iter(np.linspace(0.7, 1.5, 101)[1:])
    sender.cycles(1.0 / RATE)
    assert not sender.outputs.blending

    def move():
        sender.robot.command.position[shoulder] = next(goes)

    sent = sender.cycles(100 / RATE, move)
    assert np.array_equal(sent["position"][:, sender.place("shoulder")], np.linspace(0.7, 1.5, 101)[1:])


def test_a_start_uses_a_fifth_of_the_speed():
    sender = CartOutputs()
    sender.robot.state.position[:] = 0.2
    sender.robot.command.position[sender.dof("shoulder")] = 1.2  # 3 rad/s
    sender.robot.command.position[sender.dof("roll")] = -0.8  # 10 rad/s
    sender.outputs.start()
    sent = sender.cycles(4.0)["position"]
    speeds = np.abs(np.diff(sent, axis=0)).max(axis=0) * RATE
    assert speeds[sender.place("shoulder")] == pytest.approx(0.2 * 3.0, rel=1e-2)
    assert speeds[sender.place("roll")] == pytest.approx(0.2 * 3.0, rel=1e-2)  # all of them arrive together
    assert sent[0] == pytest.approx([0.2, 0.2])
    assert sent[-1][[sender.place("shoulder"), sender.place("roll")]].tolist() == [1.2, -0.8]
    assert not sender.outputs.blending
    # the minimum-jerk profile covers half of its way in half of its time, here 15/8 / (0.2 * 3) s
    assert sent[round(15 / 8 / 0.6 * RATE / 2)][sender.place("shoulder")] == pytest.approx(0.7, abs=5e-3)


def test_a_joint_that_follows_its_command_starts_there():
    """One that springs hold below its command goes on from the command; one that is elsewhere starts where it is."""
    sender = CartOutputs()
    shoulder, roll = sender.dof("shoulder"), sender.dof("roll")
    sender.robot.state.position[[shoulder, roll]] = sender.robot.command.position[[shoulder, roll]] = 0.5
    sender.outputs.start()
    sender.cycles(1.0)
    sender.robot.state.position[[shoulder, roll]] = 0.45, 0.1
    sender.outputs.start()
    start = sender.outputs.start_position
    assert start[[shoulder, roll]].tolist() == [0.5, 0.1]
    sender.robot.command.position[:] = start
    sent = sender.cycles(1.0)["position"]
    assert (sent[:, sender.place("shoulder")] == 0.5).all() and (sent[:, sender.place("roll")] == 0.1).all()
    sender.outputs.forget()
    sender.outputs.start()
    assert start[[shoulder, roll]].tolist() == [0.45, 0.1]


@pytest.mark.parametrize(
    "there, starts", [(0.35, 0.5), (0.38, 0.5), (0.32, 0.5), (0.31, 0.31), (0.67, 0.5), (0.7, 0.7)]
)
def test_a_joint_that_was_moved_meanwhile(there, starts):
    """It hung 0.13 rad below its command when the plugin began to wait; further away it is another robot's."""
    sender = CartOutputs()
    shoulder = sender.dof("shoulder")
    sender.robot.state.position[shoulder] = sender.robot.command.position[shoulder] = 0.5
    sender.outputs.start()
    sender.cycles(1.0)
    sender.robot.state.position[shoulder] = 0.37
    sender.outputs.hold(0.0)
    sender.robot.state.position[shoulder] = there
    sender.outputs.start()
    assert sender.outputs.start_position[shoulder] == starts


@pytest.mark.parametrize("joint, gap", [("shoulder", 1e-3), ("roll", -1e-3)])
def test_a_short_way_takes_the_shortest_time(joint, gap):
    sender = CartOutputs()
    sender.robot.command.position[sender.dof(joint)] = gap
    sender.outputs.start()
    sent = sender.cycles(SHORTEST + 0.1)["position"][:, sender.place(joint)]
    count = round(SHORTEST * RATE)
    assert (np.abs(sent[:count]) < abs(gap)).all() and (sent[count:] == gap).all()


def test_speeds_and_efforts_begin_at_zero():
    sender = CartOutputs(("velocity", "effort"))
    roll = sender.dof("roll")
    sender.robot.command.velocity[roll], sender.robot.command.torque[roll] = 2.0, -8.0
    sender.outputs.start()
    sent = sender.cycles(SHORTEST + 0.1)
    share = sent["velocity"][:, sender.place("roll")] / 2.0
    assert share[0] == 0.0 and (np.diff(share) >= 0.0).all() and share[-1] == 1.0
    assert np.array_equal(sent["effort"][:, sender.place("roll")] / -8.0, share)


def test_commanded_efforts_begin_with_measured_ones():
    sender = CartOutputs(("effort",), efforts=True)
    roll, shoulder = sender.dof("roll"), sender.dof("shoulder")
    sender.robot.state.torque[roll], sender.robot.state.torque[shoulder] = 4.0, 2.0
    sender.robot.command.torque[roll] = -8.0
    sender.outputs.start()
    sent = sender.cycles(SHORTEST + 0.1)["effort"][:, [sender.place("roll"), sender.place("shoulder")]]
    assert sent[0].tolist() == [4.0, 2.0] and sent[-1].tolist() == [-8.0, 0.0]
    assert (np.diff(sent[:, 0]) <= 0.0).all()


def test_blended_commands_stay_between_measured_and_desired():
    sender, random = CartOutputs(), np.random.default_rng(3)
    shoulder = sender.dof("shoulder")
    sender.robot.state.position[shoulder] = 0.3
    desired = []

    def jump():
        desired.append(random.uniform(-2.0, 2.0))
        sender.robot.command.position[shoulder] = desired[-1]

    sender.outputs.start()
    sent = sender.cycles(3.0, jump)["position"][:, sender.place("shoulder")]
    share = (sent - 0.3) / (np.array(desired) - 0.3)
    assert share.min() >= 0.0 and share.max() <= 1.0 + 1e-12 and share[0] == 0.0


def test_an_unmeasured_joint_is_not_blended():
    sender = CartOutputs(measured=["roll"])
    sender.robot.state.position[sender.dof("roll")] = 0.5
    sender.robot.command.position[sender.dof("shoulder")] = 1.0
    sender.outputs.start()
    sent = sender.cycles(2.0)["position"]
    assert (sent[:, sender.place("shoulder")] == 1.0).all()
    assert sent[0, sender.place("roll")] == 0.5 and sent[-1, sender.place("roll")] == 0.0


def test_a_joint_beyond_its_limit_begins_at_it():
    sender = CartOutputs()
    sender.robot.state.position[sender.dof("shoulder")] = 2.03
    sender.robot.command.position[sender.dof("shoulder")] = 1.9
    sender.outputs.start()
    sent = sender.cycles(1.0)["position"][:, sender.place("shoulder")]
    assert sent[0] == 2.0 and sent.max() == 2.0 and sent[-1] == 1.9


@pytest.mark.parametrize("beyond, said", [(1e-9, False), (1e-3, True)])
def test_rounding_at_a_limit_is_no_news(caplog, beyond, said):
    sender = CartOutputs()
    limit = sender.robot.upper_limits.position[sender.dof("shoulder")]
    sender.robot.state.position[sender.dof("shoulder")] = limit
    sender.outputs.start()
    sender.robot.command.position[sender.dof("shoulder")] = limit + beyond
    sent = sender.cycles(0.01)["position"]
    assert sent[-1, sender.names.index("shoulder")] == limit
    assert ("is held at its limit" in caplog.text) is said
    assert sum(sender.outputs.counts().values()) > 0


def test_each_start_forgets_the_efforts_before_it():
    """Who commands none sends none, whatever is measured."""
    sender = CartOutputs(("position", "effort"), efforts=True)
    effort, torque = sender.robot.command.torque, sender.robot.state.torque
    for commanded in (3.0, 0.0):
        effort[:], torque[:] = commanded, 5.0
        sender.outputs.start()
        assert sender.cycles(SHORTEST)["effort"].any() == bool(commanded)


def test_each_start_begins_anew():
    sender = CartOutputs()
    shoulder = sender.dof("shoulder")
    sender.robot.command.position[shoulder] = 0.4
    sender.outputs.start()
    sender.cycles(0.2)
    sender.robot.state.position[shoulder] = 0.1
    sender.outputs.forget()
    sender.outputs.start()
    assert sender.outputs.blending
    sent = sender.cycles(2.0)["position"][:, sender.place("shoulder")]
    assert sent[0] == 0.1 and sent[-1] == 0.4


def test_a_hold_repeats_the_last_command_without_velocity():
    """A failed component leaves NaN in its command: the hold must use the last one sent, half-way in its blend."""
    sender = CartOutputs(("position", "velocity", "effort"))
    sender.outputs.start()
    sender.outputs.hold(0.0)
    assert not sender.commands.drain() and not sender.published.drain()
    command = sender.robot.command
    command.position[:], command.velocity[:], command.torque[:] = 0.5, 1.0, 3.0
    last = {field: rows[-1] for field, rows in sender.cycles(0.3).items()}
    assert last["velocity"].all() and not np.array_equal(last["position"], np.full(2, 0.5))
    command.position[:] = np.nan  # a component that failed
    sender.published.drain()
    sender.outputs.hold(1.0)
    (message,) = sender.commands.drain()
    assert np.array_equal(message.position, last["position"]) and np.array_equal(message.effort, last["effort"])
    assert not message.velocity.any() and message.stamp == 1.0
    (published,) = sender.published.drain()
    assert not published.velocity.any() and np.array_equal(published.position, np.full(sender.robot.size, 0.5))


def test_a_hold_publishes_points_as_they_are_now():
    component = Component(make_robot())
    component.outputs = {"tip": Port("position")}
    bus = Bus()
    context = PipeContext(component.model, MemoryMiddleware(bus, "cart"), {}, RATE, outputs=component.outputs)
    tip = published(name="tip", space="POINT", quantity="position", sink="tip", dofs=None, interface="world")
    pipes = [(factory.controller(record, context), None) for record in (tip, published(sink="out"))]
    outputs = Outputs(pipes, StartBlend("cart", [], component.model, RATE, SHORTEST), component.model, 1.0 / RATE)
    points = MemoryMiddleware(bus, "receiver").queue("tip", "geometry_msgs/PointStamped", 10)
    outputs.start()
    for height, step in ((1.0, outputs.collect), (2.0, lambda: outputs.hold(3.0))):
        component.outputs["tip"].value[:] = height
        step()
        outputs.send(3.0)
    assert points.drain()[-1].values.tolist() == [2.0] * 3


def test_rest_sends_no_velocity_despite_a_filter():
    sender = CartOutputs(("position", "velocity"), filter={"frequency": 2.0})
    sender.robot.command.velocity[:] = 1.5
    sender.outputs.start()
    sender.cycles(1.0)
    sender.outputs.rest(2.0)
    message, published = sender.commands.drain()[-1], sender.published.drain()[-1]
    assert not message.velocity.any() and not published.velocity.any() and message.stamp == 2.0


def test_an_idle_plugin_commands_nothing_but_counts():
    sender = CartOutputs(idle=True)
    assert sender.outputs.commanding == () and len(CartOutputs().outputs.commanding) == 1
    sender.robot.command.position[sender.dof("shoulder")] = 7.0
    sender.outputs.start()
    sender.outputs.collect()
    assert sender.outputs.counts() == {"gate: not finite": 0, "gate: position": 1}


def test_nothing_is_sent_if_a_value_is_nan():
    sender = CartOutputs()
    sender.robot.command.position[sender.dof("shoulder")] = np.nan
    sender.outputs.start()
    with pytest.raises(NotFinite, match="shoulder"):
        sender.outputs.collect()
    sender.outputs.hold(0.0)
    assert not sender.commands.drain() and sender.outputs.counts()["gate: not finite"] == 1
