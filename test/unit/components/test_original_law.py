"""`wheeled_motion` with the original's law, beside the original's equations in plain NumPy: fast motions, and turns."""

import cmath
import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.estimation import part
from support.robots import centauro

from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.kernel import find_errors
from solfer.config import load

PERIOD, LOWER, CLOSE = 0.005, 30, 1e-6  # [s], DoFs of the base and the legs, [rad]
NARROWER = (0.0, -1.0, 0.0, 0.0, 1.0, 0.0) * 2  # directions of the contact points' velocities


def velocity(speed, direction=0.0, rate=0.0, turn=0.0, footprint=0.0):
    """Return a motion: velocity x + i y in the world that turns [m/s, rad/s], rate of the heading, and footprint."""
    return lambda t: (speed * cmath.exp(1j * (direction + rate * t)), turn, footprint)


MOTIONS = {
    "forward, 0.05 m/s": velocity(0.05),
    "forward, 0.2 m/s": velocity(0.2),
    "forward, 0.5 m/s": velocity(0.5),
    "crab, 0.2 m/s": velocity(0.2, 0.5),
    "sideways, 0.2 m/s": velocity(0.2, cmath.pi / 2.0),
    "circle, 0.05 m/s": velocity(0.05, rate=0.2, turn=0.2),
    "circle, 0.2 m/s": velocity(0.2, rate=0.4, turn=0.4),
    "circle, 0.5 m/s": velocity(0.5, rate=0.5, turn=0.5),
    "turn, 0.5 rad/s": velocity(0.0, turn=0.5),
    "beyond half a turn": velocity(0.1, rate=0.8, turn=0.8),
    "turning velocity, 0.05 m/s": velocity(0.05, rate=0.6),
    "turning velocity, 0.2 m/s": velocity(0.2, rate=1.2),
    "turning velocity, 0.5 m/s": velocity(0.5, rate=-1.2),
    "there and back, 0.3 m/s": lambda t: (0.3 if t % 2.0 < 1.0 else -0.3, 0.0, 0.0),
    "jumps, 0.05 m/s": lambda t: (0.05 * cmath.exp(2j * (t // 1.0)), 0.0, 0.0),
    "jumps, 0.2 m/s": lambda t: (0.2 * cmath.exp(1.65j * (t // 0.4)), 0.0, 0.0),
    "jumps, 0.5 m/s": lambda t: (0.5 * cmath.exp(-2j * (t // 0.5) + 0.3j * t), 0.3, 0.0),
    "narrower on a circle": velocity(0.1, rate=-0.3, turn=-0.3, footprint=0.01),
}
"""Velocity of the base in the world, x + i y [m/s], rate of its heading [rad/s], speed of the contact points [m/s]."""

TURNING_ROUND = [name for name in MOTIONS if name.startswith(("jumps", "there"))]
FASTEST = ("turning velocity, 0.5 m/s", "jumps, 0.5 m/s")


@pytest.fixture
def robots(repository):
    """Return two Robots in the same posture."""
    position = json.loads((repository / "test/data/original_wheels.json").read_text())["q0"]
    made = [centauro() for _ in range(2)]
    for robot in made:
        robot.state.position[:] = position
        robot.update()
    return made


@pytest.fixture
def component(repository, robots):
    """Make the component with the original's law, at its start, with the base where it is."""
    shipped = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)
    component = WheeledMotion(robots[0], shipped.model_copy(update={"law": "original"}).placed_as(shipped), "wheels")
    component.set_rate(1.0 / PERIOD)
    component.init()
    component.references.position[:2] = robots[0].state.position[:2]
    return component


def drive(component, law, motion, cycles):
    """Drive both open loop.

    Returns:
        The largest difference of a position in each cycle, and the speeds of the wheels' directions in the desired
        motion, of which the sign changes where a wheel turns round by pi, shape (cycles, 4) [m/s].
    """
    robot, found, speeds = component.model, [], []
    for cycle in range(cycles):
        base, turn, footprint = motion(cycle * PERIOD)
        for desired in (component.references, law.desired):
            desired.velocity[:2], desired.angular[2] = (base.real, base.imag), turn
            desired.vertex_velocity[:] = footprint * np.reshape(NARROWER, (4, 3))
        robot.update()
        component.update()
        component.send()
        robot.state.position[:LOWER] = robot.command.position[:LOWER]
        robot.state.velocity[:LOWER] = robot.command.velocity[:LOWER]
        found.append(np.abs(robot.state.position - law.update()).max())
        speeds.append([wheel.by_motion.speed for wheel in law.steering])
    return np.array(found), np.array(speeds)


@pytest.mark.daily(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", MOTIONS)
def test_fast_motions_are_those_of_the_equations(component, robots, name):
    """Positions are those of the equations in all cycles, also where directions turn round by pi.

    Of the fastest motions 3 s count: then legs become straight, and what was rounded grows to 1e-4 rad in ten cycles.
    """
    law = part("driving_cases.original").OriginalLaw(robots[1], component.tags, PERIOD)
    found, speeds = drive(component, law, MOTIONS[name], 600 if name in FASTEST else 1200)
    assert found.max() <= CLOSE, f"from {PERIOD * np.argmax(found > CLOSE):.3f} s on"
    if name in TURNING_ROUND:
        assert speeds.min() < -0.01 and speeds.max() > 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "motion"), [("0_rest", velocity(0.0)), ("d_circle", velocity(0.1, rate=0.2, turn=0.2))]
)
def test_recorded_motions_are_those_of_the_equations(repository, robots, name, motion):
    """The equations move the robot as the original program did.

    It stands, and wheels turn back; or it drives in a circle, beyond half a turn, where the heading changes its sign.
    """
    rows = json.loads((repository / "test/data/original_wheels.json").read_text())[name]["rows"]
    shipped = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)
    law = part("driving_cases.original").OriginalLaw(robots[0], shipped, PERIOD, is_centred=True)
    positions = []
    for cycle in range(rows[-1][0] + 1):
        base, law.desired.angular[2], _ = motion(cycle * PERIOD)
        law.desired.velocity[:2] = base.real, base.imag
        positions.append(law.update())
    for row, expected in rows:
        assert_allclose(positions[row][:LOWER], expected, rtol=0.0, atol=CLOSE)


def test_directions_turn_round_as_those_of_the_equations(component):
    """Random velocities and errors, of all speeds, which change direction now and then by all angles."""
    random, size = np.random.default_rng(5), (600, 2, 4)
    speeds = 10.0 ** random.uniform(-4.0, -0.3, size)
    turns = random.uniform(-cmath.pi, cmath.pi, size) * (random.random(size) < 0.1) + random.normal(0.0, 0.02, size)
    vectors = speeds * np.exp(1j * np.cumsum(turns, axis=0))
    moved = 10.0 ** random.uniform(-7.0, -3.0, len(speeds))
    steering, pose, original = component._steering, component.wheels.pose.value, part("driving_cases.original")
    gains = component.tags.steering_record()
    plain, found = [original.OriginalSteering(gains, PERIOD) for _ in range(4)], []
    for (velocities, errors), way in zip(vectors, moved, strict=True):
        component.references.vertex_velocity[:, :2] = velocities[:, None].view(float)
        component.wheels.offsets.errors[:, :2] = errors[:, None].view(float)
        steering.before[:2] = pose[:2] - (way, 0.0)
        find_errors(component.tasks.numbers.address, True)
        angles = [wheel.update(*each, way / PERIOD) for wheel, *each in zip(plain, velocities, errors, strict=True)]
        found.append(np.abs(steering.angles - angles))
    assert np.max(found) <= 1e-9, f"in cycle {np.argmax(np.max(found, axis=1) > 1e-9)}"
