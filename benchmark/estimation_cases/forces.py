"""Courses on which `ground_forces` is compared with PyBullet's contact forces, and their figures."""

import sys
import time
from contextlib import closing

import numpy as np
import pinocchio
from estimation_cases.forces_world import LEGS, ForcesWorld, Legs

SPEED, PUSH = 0.5, 100.0  # [m/s], [N]
TOUCHES, STEADY, GRACE = 5.0, 5, 20  # [N], [ms], [ms]
LOOSE, TIGHT = {"wheel_rms": 5.0, "sum_rms": 3.0}, {"wheel_rms": 2.0, "sum_rms": 1.0}  # [%]


def stand(world: ForcesWorld, count: int, random: np.random.Generator) -> None:
    """Rest."""
    world.run(10.0)


def drive(world: ForcesWorld, count: int, random: np.random.Generator) -> None:
    """Drive straight on, and stop."""
    world.roll(np.full(4, SPEED))
    world.run(6.0)
    world.roll(np.zeros(4))
    world.run(3.0)


def arms(world: ForcesWorld, count: int, random: np.random.Generator) -> None:
    """Move both arms to drawn postures, as fast as their joints may."""
    robot = world.driver.robot
    joints = tuple(name for name in robot.dofs if name.startswith("j_arm"))
    dofs = [robot.dof(name) for name in joints]
    home, limits = robot.state.position[dofs].copy(), (robot.lower_limits, robot.upper_limits)
    lower, upper = (limit.position[dofs] for limit in limits)
    for _ in range(12):
        goal = np.clip(home + random.uniform(-0.6, 0.6, len(dofs)), lower + 0.05, upper - 0.05)
        world.run(world.move(joints=joints, positions=tuple(goal.tolist()), speed=20.0) + 0.3)


def lifts(world: ForcesWorld, count: int, random: np.random.Generator) -> None:
    """Lift wheels and put them down, by drawn heights and speeds, while the base leans to the other side."""
    legs = Legs(world)
    for leg in LEGS:
        tilt = np.array((0.21 if leg in (1, 2) else 0.0, 0.07 if leg in (1, 3) else -0.07, 0.0))
        joints = sum(legs.joints, ())
        tilted = sum((legs.reach(each, tilt) for each in LEGS), ())
        world.run(world.move(joints=joints, positions=tilted, speed=0.3) + 0.5)
        for _ in range((count + len(LEGS) - 1) // len(LEGS)):
            for height in (random.uniform(0.01, 0.1), random.uniform(-0.005, 0.0)):
                goal = legs.reach(leg, tilt + (0.0, 0.0, height))
                took = world.move(joints=legs.joints[leg - 1], positions=goal, speed=random.uniform(0.1, 0.6))
                world.run(took + random.uniform(0.15, 0.5))
        straight = sum((legs.reach(each, np.zeros(3)) for each in LEGS), ())
        world.run(world.move(joints=joints, positions=straight, speed=0.3) + 0.3)
        print(f"leg {leg}: {world.bus.time:.0f} s", file=sys.stderr, flush=True)


def push(world: ForcesWorld, count: int, random: np.random.Generator) -> list[tuple[int, np.ndarray]]:
    """Push the pelvis in drawn directions for half a second; return the steps at which pushes begin, and directions."""
    pushes = []
    for _ in range(count):
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        world.run(0.5)
        pushes.append((len(world.truth), direction))
        world.simulation.pushes.add("pelvis", PUSH * direction, np.zeros(3), 0.5)
        world.run(1.0)
    return pushes


COURSES = {"stand": stand, "drive": drive, "arms": arms, "lifts": lifts, "push": push}


def touching(forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which wheels touch by normal forces of each ms, shape (t, k), and for how long they do or do not [ms]."""
    pressed = forces > TOUCHES
    touch, since = np.empty_like(pressed), np.zeros(pressed.shape, dtype=int)
    now, waited, left = pressed[0].copy(), np.zeros(pressed.shape[1], dtype=int), np.full(pressed.shape[1], 10**6)
    for index, row in enumerate(pressed):
        waited = np.where(row != now, waited + 1, 0)
        changes = waited >= STEADY
        now ^= changes
        left = np.where(changes, 0, left + 1)
        touch[index], since[index] = now, left
    return touch, since


def figures(world: ForcesWorld, begin: int, pushes: list[tuple[int, np.ndarray]] | None) -> dict[str, float]:
    """Compute the figures of the cycles from `begin` on."""
    steps = np.array([row[0] for row in world.rows[begin:]])
    forces, touched, pushed = (np.array([row[k] for row in world.rows[begin:]]) for k in (1, 2, 3))
    truth, weight = np.array(world.truth), 9.81 * world.forces.robot.kinematics.mass
    means = np.array([truth[step - 5 : step].mean(axis=0) for step in steps])
    error = 100.0 / weight * (forces - means)[:, :, 2]
    touch, since = touching(truth[:, :, 2])
    counted = since[steps - 1] > GRACE
    wrong = (touched != touch[steps - 1]) & counted
    made = {
        "wheel_rms": np.sqrt(np.mean(error**2, axis=0)).max(),
        "sum_rms": np.sqrt(np.mean(error.sum(axis=1) ** 2)),
        "contact_right": 100.0 * (1.0 - wrong.sum() / counted.sum()),
        "wrong": wrong.sum(),
        "changes": np.count_nonzero(np.diff(touch[steps[0] :].astype(int), axis=0)),
    }
    if pushes:
        early, late = [], []
        for step, direction in pushes:
            early.append(pushed[np.flatnonzero(steps - step >= 20)[0], :3] @ direction * 100.0 / PUSH)
            lasting = (steps - step >= 60) & (steps - step < 500)
            mean = pushed[lasting, :3].mean(axis=0)
            late.append(np.linalg.norm(mean - PUSH * direction) * 100.0 / PUSH)
        made |= {"push_20ms_mean": np.mean(early), "push_20ms_least": min(early)}
        made |= {"push_error_mean": np.mean(late), "push_error_worst": max(late)}
    return {key: round(float(value), 3) for key, value in made.items()}


def cost(world: ForcesWorld, cycles: int = 500) -> float:
    """Measure the median time of a cycle without transport, in `pinocchio.computeAllTerms`."""
    robot, component, times = world.forces.robot, world.forces.component, np.zeros((2, cycles))
    model, data = robot.kinematics.pinocchio
    q, v = pinocchio.neutral(model), np.full(model.nv, 0.1)
    for row in times.T:
        robot.state.position[6] += 1e-9  # what has not changed is not computed
        begun = time.thread_time()  # the machine may be busy with others
        robot.update()
        robot.dynamics.update()
        component.update()
        between = time.thread_time()
        pinocchio.computeAllTerms(model, data, q, v)
        row[:] = between - begun, time.thread_time() - between
    return float(np.divide(*np.median(times, axis=1)))


def missed(course: str, made: dict[str, float]) -> list[str]:
    """Return the names of the goals that a course misses."""
    bounds = TIGHT if course == "stand" else LOOSE
    names = [key for key, most in bounds.items() if not made[key] <= most]
    names += ["contact_right"] if not made["contact_right"] >= 99.9 else []
    if course == "push":
        names += ["push_20ms_mean"] if not made["push_20ms_mean"] >= 50.0 else []
        names += ["push_error_mean"] if not made["push_error_mean"] <= 10.0 else []
    return names


def run(course: str, seed: int, noise: float, count: int, world: str | None = None) -> dict[str, float]:
    """Run a course, and return its figures."""
    with closing(ForcesWorld(seed, noise, world)) as made:
        begin = len(made.rows)
        result = figures(made, begin, COURSES[course](made, count, np.random.default_rng(seed)))
        return result | {"cycle": round(cost(made), 2)}
