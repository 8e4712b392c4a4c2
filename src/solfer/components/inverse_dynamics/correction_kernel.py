"""One cycle of `ModelCorrection`, compiled."""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part

ESTIMATES, ABSENT, INVALID, STALE, CHANGES, MOVES, DIFFERS = range(7)
"""What `correct` returns: that it estimates, or why not. Forces are not measured, are not finite, do not change;
contacts come or go; the robot is pushed or accelerates; forces contradict the estimate."""

LARGEST = 0.05
"""Largest error of the centre of mass in each direction of the base [m]."""

LARGEST_SHARE = 0.4
"""Largest error of the mass as a share of it."""

DEVIATION, SHARE_DEVIATION = 0.02, 0.2
"""Standard deviations at the start: of the centre of mass in each direction [m], and of the mass as a share of it."""

CORRECTION = BlockLayout(
    "ModelCorrection",
    # contacts: places [m] and wrenches [N, Nm] in the world, those of the cycle before, and how far they have come
    contact_count=int,
    positions=(float, "contact_count", 3),
    wrenches=(float, "contact_count", 6),
    before=(float, "contact_count", 6),
    tracked_count=int,
    fractions=(float, "tracked_count"),
    # the model: masses as in the file and as they are used, by the robot and by its twin; see `KinematicTree.inertial`
    bodies=int,
    base=int,  # joint of the base
    gravity=float,  # [m/s^2]
    placements=(float, "bodies", 12),
    original=(float, "23 * bodies"),
    used=(float, "23 * bodies"),
    twin=(float, "23 * bodies"),
    # estimates: error of the centre of mass in the base [m], that of the mass as a share of it, and what the model has
    offset=(float, 4),
    covariance=(float, 3, 3),
    share_variance=(float, 1),
    applied=(float, 4),
    # smoothed force of the ground [N], and its moment about the model's centre of mass [Nm], in the world
    smooth=(float, 6),
    # times [s]: since forces have changed, since the robot has been pushed or contacts have changed, and for which
    # forces contradict the estimate; the last is the age of `smooth`
    times=(float, 4),
    # H and P H' of a row
    row=(float, 3),
    gain=(float, 3),
)
"""What `correct` reads and writes."""

_correction_at = CORRECTION.at


@part
def restart(block):
    """Let the estimates be as uncertain as at the start."""
    block.covariance[:] = 0.0
    for i in range(3):
        block.covariance[i, i] = DEVIATION * DEVIATION
    block.share_variance[0] = SHARE_DEVIATION * SHARE_DEVIATION


@part
def read(block):
    """Return whether forces are finite, whether there are any, and whether one has changed."""
    size = 0.0
    change = 0.0
    for i in range(block.contact_count):
        for k in range(6):
            size += abs(block.wrenches[i, k])
            change += abs(block.wrenches[i, k] - block.before[i, k])
            block.before[i, k] = block.wrenches[i, k]
    return math.isfinite(size), size > 0.0, change != 0.0


@part
def center(block):
    """Compute the model's centre of mass in the world [m]; also return its mass [kg]."""
    bodies = block.bodies
    mass = 0.0
    x = 0.0
    y = 0.0
    z = 0.0
    for body in range(1, bodies):
        one = block.used[body]
        p = block.placements[body]
        a = block.used[bodies + 3 * body]
        b = block.used[bodies + 3 * body + 1]
        c = block.used[bodies + 3 * body + 2]
        mass += one
        x += one * (p[0] * a + p[3] * b + p[6] * c + p[9])
        y += one * (p[1] * a + p[4] * b + p[7] * c + p[10])
        z += one * (p[2] * a + p[5] * b + p[8] * c + p[11])
    return x / mass, y / mass, z / mass, mass


@part
def smooth(block, coefficient, x, y, z):
    """Smooth the force of the ground and its moment about (x, y, z)."""
    fx = 0.0
    fy = 0.0
    fz = 0.0
    tx = 0.0
    ty = 0.0
    tz = 0.0
    for i in range(block.contact_count):
        force = block.wrenches[i]
        dx = block.positions[i, 0] - x
        dy = block.positions[i, 1] - y
        dz = block.positions[i, 2] - z
        fx += force[0]
        fy += force[1]
        fz += force[2]
        tx += force[3] + dy * force[2] - dz * force[1]
        ty += force[4] + dz * force[0] - dx * force[2]
        tz += force[5] + dx * force[1] - dy * force[0]
    for k, number in enumerate((fx, fy, fz, tx, ty, tz)):
        block.smooth[k] += coefficient * (number - block.smooth[k])


@part
def innovate(block, axis):
    """Write the row H of an axis, 0 or 1, and P H'; return the innovation, and H P H'."""
    force = block.smooth
    p = block.placements[block.base]
    ratio = force[axis] / force[2]
    innovation = -force[4] / force[2] if axis == 0 else force[3] / force[2]
    for j in range(3):
        block.row[j] = p[3 * j + axis] - ratio * p[3 * j + 2]
        innovation -= block.row[j] * (block.offset[j] - block.applied[j])
    variance = 0.0
    for j in range(3):
        block.gain[j] = 0.0
        for k in range(3):
            block.gain[j] += block.covariance[j, k] * block.row[k]
        variance += block.gain[j] * block.row[j]
    return innovation, variance


@part
def contradicts(block, excess):
    """Return whether innovations are beyond three standard deviations of noise and estimate."""
    for axis in range(2):
        innovation, variance = innovate(block, axis)
        if innovation**2 > 9.0 * (variance + 0.003**2):
            return True
    return (excess - block.offset[3]) ** 2 > 9.0 * (block.share_variance[0] + 0.02**2)


@part
def update(block, excess, step):
    """Correct the estimates by one cycle's forces."""
    # [m^2 s], [s]: densities of 3 mm and 2 % that last for 1 s each, as the angular momentum and squats change both
    noise = 0.003**2 * 1.0 / step
    share_noise = 0.02**2 * 1.0 / step
    for axis in range(2):
        innovation, variance = innovate(block, axis)
        scale = 1.0 / (variance + noise)
        for j in range(3):
            block.offset[j] += scale * innovation * block.gain[j]
            for k in range(3):
                block.covariance[j, k] -= scale * block.gain[j] * block.gain[k]
    for j in range(3):
        block.offset[j] = min(max(block.offset[j], -LARGEST), LARGEST)
    ratio = block.share_variance[0] / (block.share_variance[0] + share_noise)
    block.offset[3] += ratio * (excess - block.offset[3])
    block.offset[3] = min(max(block.offset[3], -LARGEST_SHARE), LARGEST_SHARE)
    block.share_variance[0] *= 1.0 - ratio


@part
def write(original, used, bodies, base, applied):
    """Write masses with a correction, see `ModelCorrection`."""
    scale = 1.0 + applied[3]
    lever = original[22 * bodies] / original[base]
    for k in range(bodies):
        used[k] = scale * original[k]
        used[22 * bodies + k] = scale * original[22 * bodies + k]
    for k in range(4 * bodies, 13 * bodies):
        used[k] = scale * original[k]
    for k in range(3):
        used[bodies + 3 * base + k] = original[bodies + 3 * base + k] + lever * applied[k]


@part
def apply(block, step):
    """Let the model follow the estimates, at 10 mm/s and 5 %/s: tasks see no jump."""
    for k in range(4):
        largest = step * (0.05 if k == 3 else 0.01)
        block.applied[k] += min(max(block.offset[k] - block.applied[k], -largest), largest)
    write(block.original, block.used, block.bodies, block.base, block.applied)
    write(block.original, block.twin, block.bodies, block.base, block.applied)


@part
def disturbed(block, weight):
    """Return whether contacts come or go, or the robot is pushed or accelerates; for 0.5 s after that, too."""
    found = 0
    for i in range(block.tracked_count):
        if 0.0 < block.fractions[i] < 1.0:
            found = CHANGES
    force = block.smooth
    # 3 % of the weight: 0.3 m/s^2
    if not force[2] > 0.5 * weight or math.hypot(force[0], force[1]) > 0.03 * force[2]:
        found = MOVES
    if found:
        block.times[1] = 0.0
    return MOVES if not found and block.times[1] < 0.5 else found


def _correct(start, step):
    """Estimate for one cycle of a time [s], and let the model follow; return one of the numbers above."""
    block = _correction_at(start)
    times = block.times
    walk = 0.001**2 / 60.0  # [m^2/s], 1 mm in a minute
    for i in range(3):
        block.covariance[i, i] = min(block.covariance[i, i] + walk * step, DEVIATION * DEVIATION)
    block.share_variance[0] = min(block.share_variance[0] + 0.002**2 / 60.0 * step, SHARE_DEVIATION * SHARE_DEVIATION)
    for i in range(3):
        times[i] += step
    is_finite, is_any, is_new = read(block)
    if not is_finite or not is_any:
        times[1] = times[3] = 0.0
        return ABSENT if is_finite else INVALID
    if is_new:
        times[0] = 0.0
    if times[0] > 0.1:  # [s]
        times[1] = times[3] = 0.0
        return STALE
    x, y, z, mass = center(block)
    if not math.isfinite(x + y + z):
        return INVALID
    times[3] += step
    smooth(block, step / min(max(times[3], step), 0.1), x, y, z)  # over 0.1 s
    weight = block.original[22 * block.bodies] * block.gravity
    found = disturbed(block, weight)
    if found:
        times[2] = 0.0
        return found
    excess = block.smooth[2] / weight - 1.0
    if contradicts(block, excess):
        if times[2] < 5.0:  # [s]
            return DIFFERS
        restart(block)  # it carries something else
    else:
        times[2] = 0.0
    update(block, excess, step)
    apply(block, step)
    return ESTIMATES


def _reset(start):
    """Begin with the model of the file, and with nothing known."""
    block = _correction_at(start)
    for numbers in (block.offset, block.applied, block.smooth, block.times):
        numbers[:] = 0.0
    block.before[:] = 0.0
    restart(block)
    apply(block, 0.0)


correct = cached("int64(int64, float64)", _correct)
reset = cached("void(int64)", _reset)
