"""What a controller does in each step, compiled, and its numbers."""

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, exact_part

LONGEST_PAUSE = 0.1
"""Longest time between two commands of one stream [s]; a later one is expected where the stream would be by then."""

RAMP = BlockLayout("Ramp", count=int, gains=(float, "count"), goal=(float, "count"), left=(float, "count"))
"""What a ramp changes, where to, and in which time [s]."""

CATCH_UP = BlockLayout(
    "Distances",
    count=int,
    flags=(bool, 2),  # whether any distance is not zero; whether a joint was commanded since the last step
    news=(bool, "count"),  # which one
    position=(float, "count"),  # as commanded
    last=(float, "count"),  # the command before
    speed=(float, "count"),  # of the stream
    age=(float, "count"),  # of its last command
    distance=(float, "count"),
    rate=(float, "count"),
    limit=(float, "count"),  # of the speed
)
"""What `CatchUp` knows of each joint."""

CONTROLLER = BlockLayout(
    "ControllerNumbers",
    count=int,
    dofs=(int, "count"),
    velocity=(float, "count"),
    age=(float, "count"),  # of the velocities
    timeout=float,
    has_springs=int,  # only then it has what follows
    position=(float, "count"),
    target=(float, "count"),
    effort=(float, "count"),
    applied_effort=(float, "count"),
    stiffness=(float, "count"),
    damping=(float, "count"),
    lower=(float, "count"),
    upper=(float, "count"),
    fastest=(float, "count"),
    ramp_addresses=(int, 3),  # addresses of blocks
    catch_up_address=int,  # of a block
)
"""What a controller reads and writes."""

controller_at = CONTROLLER.at
_ramp_at = RAMP.at
_catch_up_at = CATCH_UP.at


@exact_part
def _advance_ramp(address, dt):
    """Change gains linearly to their goals."""
    ramp = _ramp_at(address)
    for k in range(ramp.count):
        left = ramp.left[k]
        if left > 0.0:
            ratio = dt / left
            if ratio >= 1.0:
                ramp.gains[k] = ramp.goal[k]
                ramp.left[k] = 0.0
            else:
                ramp.gains[k] += (ramp.goal[k] - ramp.gains[k]) * ratio
                ramp.left[k] = max(left - dt, 0.0)


@exact_part
def _detect_jumps(catch_up):
    """Compare the commands with where their streams were heading."""
    jump_distance = 0.01  # [rad, m]
    shortest_period = 0.005  # [s] below which that shrinks in proportion: an emptied queue is not a fast stream
    largest_acceleration = 50.0  # of the stream's estimated speed at a jump [rad/s2, m/s2]
    for k in range(catch_up.count):
        if not catch_up.news[k]:
            continue
        time = min(catch_up.age[k], LONGEST_PAUSE)
        moved = catch_up.position[k] - catch_up.last[k]
        # at most the commanded part of the stream's own step: a sender that stood still goes on where it was
        extra = moved - max(min(catch_up.speed[k] * time, max(moved, 0.0)), min(moved, 0.0))
        change = moved / time - catch_up.speed[k]
        if abs(extra) > min(time, shortest_period) * (jump_distance / shortest_period):
            catch_up.distance[k] += extra
            catch_up.flags[0] = True
            largest = time * largest_acceleration  # the stream's speed jumps less
            change = max(min(change, largest), -largest)
        limit = catch_up.limit[k]
        catch_up.speed[k] = max(min(catch_up.speed[k] + change, limit), -limit)
        catch_up.last[k] = catch_up.position[k]
        catch_up.age[k] = 0.0
        catch_up.news[k] = False
    catch_up.flags[1] = False


@exact_part
def _fade(catch_up, dt):
    """Fade for one step, implicit in the speed."""
    frequency = 10.0  # w [rad/s]
    caught_up = 1e-6  # distance and speed below which a joint has caught up [rad, rad/s]
    is_behind = False
    for k in range(catch_up.count):
        rate = catch_up.rate[k] + catch_up.distance[k] * (-frequency * frequency * dt)
        rate /= 1.0 + 2.0 * frequency * dt
        # the target moves at the speed of its stream, if that goes on, minus the rate of the distance
        speed = catch_up.speed[k] if catch_up.age[k] < LONGEST_PAUSE else 0.0
        fastest = 0.2 * catch_up.limit[k]
        whole = 0.8 * catch_up.limit[k]
        rate = min(rate, max(min(speed + whole, fastest), 0.0))
        rate = max(rate, -max(min(whole - speed, fastest), 0.0))
        catch_up.rate[k] = rate
        catch_up.distance[k] += rate * dt
        is_behind = is_behind or not (abs(catch_up.distance[k]) < caught_up and abs(rate) < caught_up)
    if not is_behind:
        catch_up.distance[:] = 0.0
        catch_up.rate[:] = 0.0
        catch_up.flags[0] = False


@exact_part
def _follow(controller, dt):
    """Move the targets of the springs on towards the accepted positions."""
    catch_up = _catch_up_at(controller.catch_up_address)
    for k in range(controller.count):
        catch_up.age[k] += dt
    if catch_up.flags[1]:
        _detect_jumps(catch_up)
    if catch_up.flags[0]:
        _fade(catch_up, dt)
    for k in range(controller.count):
        goal = controller.position[k]
        if catch_up.flags[0]:
            goal = max(min(goal - catch_up.distance[k], controller.upper[k]), controller.lower[k])
        step = controller.fastest[k] * dt
        controller.target[k] += max(min(goal - controller.target[k], step), -step)


def _advance(address, dt, feed_forward):
    """Let `dt` [s] pass; feed-forward torques are applied times a factor."""
    controller = controller_at(address)
    for k in range(controller.count):
        controller.age[k] += dt
        if controller.age[k] > controller.timeout:
            controller.velocity[k] = 0.0
    if controller.has_springs:
        for ramp in controller.ramp_addresses:
            _advance_ramp(ramp, dt)
        for k in range(controller.count):
            controller.applied_effort[k] = controller.effort[k] * feed_forward
        _follow(controller, dt)


advance = cached("void(int64, float64, float64)", _advance)
