"""Every live parameter of every shipped component is changed on the simulated CENTAURO; none makes it leap."""

import json
import logging
from contextlib import nullcontext

import numpy as np
import pytest
from support.integration.world import CONFIG, World

from solfer.components.gravity_compensation import GravityCompensation
from solfer.components.ground_forces import GroundForces
from solfer.components.inverse_dynamics import InverseDynamics
from solfer.components.inverse_kinematics import InverseKinematics
from solfer.components.odometry import Odometry
from solfer.components.support_shaping import SupportShaping
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.kernel import TUNED
from solfer.config import load
from solfer.config.records.live import live_fields
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Registry
from solfer_tools.cli.main import main
from solfer_tools.cli.params import callers

KINEMATICS = "solfer.components.inverse_kinematics:InverseKinematics"
ODOMETRY = "solfer.components.odometry:Odometry"
HAND = {"task": "left", "values": (0.05, 0.05, 0.1), "relative": True}
CASES = {
    "joint_states": ("", (), ("trajectory", {"state": "mammal_wide_straight"})),
    "soft_compensation": ("", (), None),
    "inverse_kinematics": ("", (), ("reference", HAND)),
    "upper_body_ik": (KINEMATICS, (), None),
    "inverse_dynamics": ("", (), ("reference", {"task": "com", "values": (0.0, 0.0, -0.05), "relative": True})),
    "odometry": (ODOMETRY, (), None),
    "ground_forces": ("", ("odometry",), None),
    "wheeled_motion": ("", ("odometry",), None),
    "support_shaping": ("", ("odometry",), None),
}
"""Component, plugins beside it, and what moves it."""

TOO_FAST = 1.0 + 1e-6


class SpeedWatch:
    """The largest speed of a joint, as a share of its limit, commanded and measured."""

    def __init__(self, world, plugin):
        robot, simulation = plugin.robot, world.simulation
        limits = robot.upper_limits.velocity
        self._dofs = [dof for dof in robot.actuated if np.isfinite(limits[dof])]
        self._limits, self._command = limits[self._dofs], robot.command.velocity
        self.commanded = self.measured = 0.0
        self._robot, self._simulation = robot, simulation
        world.bus.every(1.0 / plugin.rate, self._look)

    def _look(self):
        for name, numbers in (("commanded", self._command), ("measured", self._robot.state.velocity)):
            share = float(np.max(np.abs(numbers[self._dofs]) / self._limits, initial=0.0))
            setattr(self, name, max(getattr(self, name), share))


class BusCaller:
    """Calls the services of a plugin in a world."""

    def __init__(self, world, plugin):
        self._world, self._plugin = world, plugin

    def plugins(self):
        return [self._plugin]

    def call(self, name, interface, request, reply, timeout):
        return self._world.ask(name, **vars(request))


def running(world, name):
    """Let a plugin run, with those beside it, and move."""
    target, others, request = CASES[name]
    for other in others:
        world.plugin(other, target=CASES[other][0])
    plugin = world.plugin(name, target=target or None)
    world.run(1.0)
    assert plugin.running, plugin.health()
    if request is not None:
        service, fields = request
        assert world.ask(f"{name}/{service}", **fields).success
    return plugin


def put(world, name, **values):
    return world.ask(f"{name}/set_parameters", names=tuple(values), values=tuple(values.values()))


def built_with(kind, tags, name, rate):
    """Make the component again, with the tags that the changes have led to."""
    elsewhere = World()
    configuration = load(CONFIG / "centauro.yaml", name)
    generator = Registry().find("joint_states", CASES[name][0] or f"{kind.__module__}:{kind.__name__}")
    robot = generator(configuration, MemoryMiddleware(elsewhere.bus, name)).make_robot()
    made = kind(robot, tags, name)
    made.kinematics = True
    made.set_rate(rate)
    elsewhere.close()
    return made


def numbers_of(component):
    """List what a component computes with, beside its tags."""
    match component:
        case InverseKinematics():
            # while tasks are far from their references, they have another damping than their own
            tasks = [np.delete(task.numbers, 3, axis=1) for level in component._stack.levels for task in level]
            tasks += [damping for level in component._levels for _, damping, _ in level._dampings]
            deflection = component._deflection
            yield from (
                *tasks,
                component._bounds.speed,
                component.references._filter.limits,
                component.references._tolerances,
            )
            yield [deflection.time, deflection.most] if deflection else []
        case InverseDynamics():
            yield from (task.numbers for task in component.tasks.values())
            demand, problem = component._demand, component.problem
            limits = problem._constraints.limits
            yield from (demand.velocity_gains, demand.roots, problem.bounds.speed, component.ground.cones.matrix)
            yield from (limits, problem._constraints.upper[: len(limits)])
            yield [problem.bounds.braking, component.ground.fade, demand.settle, component._motion.follow]
            yield from (numbers for _, _, numbers in component._gains)
            yield from (component.references._filter.limits, component.references._tolerances)
        case WheeledMotion():
            law, record = component._steering.law, component.tasks.numbers.record
            yield from (
                component.tasks.gain,
                [float(law[key][0]) for key in ("across", *TUNED)],
                component.targets._limits,
            )
            yield [float(record[key]) for key in record.dtype.names if record.dtype[key].kind == "f"]
            yield [*component.drive._speeds, *component.drive._limits, component._lifting.margin]
            yield [float(component._guard._block.record["required_margin"]), component._guard.polygon.required_margin]
            yield [float(component._pace._block.record[key]) for key in ("base_speed", "vertex_speed", "acceleration")]
            if isinstance(component, SupportShaping):
                governor = component.shaping.governor
                yield from (
                    governor.limits,
                    np.diag(governor._solver.problem.hessian),
                    [component.shaping.reaction.margin],
                )
                yield [governor.speed, governor._rows.horizon, governor._rows.recovery]
        case GroundForces():
            yield component.touch._limits
            yield [component.checks.friction]
        case Odometry():
            yield from (each.factors for each in (component.law.filter, component.law.smoothing) if each is not None)
        case GravityCompensation():
            yield from (numbers for _, _, numbers in component._gains)


def other(value, maximum):
    """Return another value of a parameter, within its range, and one beyond it."""
    most = maximum.removeprefix("below ")
    beyond = 2.0 * float(most) + 1.0 if most else float("nan")
    if not value:
        return "5.0", beyond
    value = json.loads(value)
    changed = [0.9 * each for each in value] if isinstance(value, list) else 0.9 * value if value else 0.5
    return json.dumps(changed), beyond


def check_setters(component):
    """Check that each live tag has a setter, but for the error of a task that says nothing, and springs of no pipe."""
    tags = component.tags
    paths = [each.path for each in component.live_parameters()]
    tasks = tags.stack.tasks if getattr(tags, "stack", None) else {}
    without = {("stack", "tasks", task, "gain") for task, record in tasks.items() if record.is_motion}
    for index, group in enumerate(getattr(tags, "gains", ())):
        without |= {("gains", index, gain) for gain in ("stiffness", "damping") if getattr(group, gain) is None}
    live = [path for path, _ in live_fields(tags) if path not in without]
    for path in paths:
        assert any(path[: len(found)] == found for found in live), path
    for found in live:
        assert any(path[: len(found)] == found for path in paths), found


@pytest.mark.parametrize("name", CASES)
def test_each_parameter_counts_while_the_robot_moves(world, caplog, name):
    """Within its range it is taken over and logged, beyond it is refused, and no joint exceeds its speed."""
    plugin = running(world, name)
    watch, wrong = SpeedWatch(world, plugin), []
    component = plugin.component
    check_setters(component)
    reply = world.ask(f"{name}/get_parameters")
    assert reply.names
    for parameter, value, maximum in zip(reply.names, reply.values, reply.maximums, strict=True):
        new, beyond = other(value, maximum)
        before = component.tags
        answer = put(world, name, **{parameter: str(beyond)})
        if answer.success or component.tags is not before:
            wrong.append(f"{parameter} may be {beyond}")
        elif parameter not in answer.message:
            wrong.append(f"{parameter} is not named in {answer.message!r}")
        answer = put(world, name, **{parameter: new})
        (now,) = world.ask(f"{name}/get_parameters", names=(parameter,)).values
        if not answer.success or json.loads(now) != json.loads(new):
            wrong.append(f"{parameter}: {new} is refused: {answer.message}, it is {now}")
    assert wrong == []
    world.run(0.6)
    assert plugin.running and not plugin.tuning.moves
    built = built_with(type(component), component.tags, name, plugin.rate)
    for numbers, expected in zip(numbers_of(component), numbers_of(built), strict=True):
        np.testing.assert_allclose(numbers, expected, rtol=1e-9, atol=1e-12)
    assert watch.commanded <= TOO_FAST and watch.measured <= 1.0
    with caplog.at_level(logging.INFO):
        plugin.tuning.log()
    lines = [record.message for record in caplog.records if " -> " in record.message]
    assert len(lines) == len(reply.names)


@pytest.mark.parametrize(
    ("name", "gain", "most"),
    [("inverse_kinematics", "stack.tasks.left.gain", "10000"), ("inverse_dynamics", "stack.tasks.com.gain", "20")],
)
def test_a_gain_from_nothing_to_its_maximum_makes_no_joint_leap(world, monkeypatch, name, gain, most):
    """By `solfer params set`, which has the world's bus in place of a master."""
    monkeypatch.setattr(callers, "caller", lambda namespace: nullcontext(BusCaller(world, name)))
    plugin = running(world, name)
    assert put(world, name, **{gain: "0"}).success
    world.run(0.6)
    service, fields = CASES[name][2]
    assert world.ask(f"{name}/{service}", **fields).success
    watch = SpeedWatch(world, plugin)
    assert main(["params", "set", name, f"{gain}={most}"]) == 0
    world.run(1.5)
    assert plugin.running
    assert watch.commanded <= TOO_FAST and watch.measured <= 1.0


def test_a_velocity_gain_beyond_the_rate_is_refused(world):
    plugin = world.plugin("inverse_dynamics")
    before = plugin.component.tags
    reply = put(world, "inverse_dynamics", **{"stack.tasks.com.gain": "500"})
    assert not reply.success and "a velocity gain of 2000 /s" in reply.message and plugin.component.tags is before


def test_a_plugin_that_is_gone_is_named(world):
    world.plugin("joint_states")
    with pytest.raises(LookupError, match="joint_stats"):
        world.bus.call("joint_stats/set_parameters")
