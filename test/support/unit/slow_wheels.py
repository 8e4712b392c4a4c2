"""`wheeled_motion` in plain Python and NumPy, one wheel and one equation after the other, for comparison."""

import math

import numpy as np
from support.unit.dense_levels import dense_levels, dense_within

from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.points import ROUNDED, wrapped
from solfer.components.wheeled_motion.tags import SOFT

SLOW, GAIN = 0.1, 1000.0
RESTING, RELAXATION, SMALL, AWAKE, NEAR = 2e-3, 1e-3, 2.5e-3, 4e-3, 2e-4
LONGER, SPARE, AHEAD = 0.35, 0.1, 4.0


def nearest(angle, other, half=math.pi):
    """Return the angle nearest to another one among those that differ by half turns, and the sign of its direction."""
    turns = math.ceil((angle - other) / math.pi - 0.5)
    return angle - turns * half, -1.0 if turns % 2 else 1.0


class Direction:
    """A direction that is low-passed the more, the slower what points there is."""

    def __init__(self, threshold, half):
        self.threshold, self._half, self.angle, self.speed = threshold, half, 0.0, 0.0

    def follow(self, angle, speed):
        """Turn towards a direction, or the one against it if that is nearer."""
        angle, sign = nearest(angle, self.angle, self._half)
        share = math.tanh(abs(speed) / self.threshold)
        self.angle += share * (angle - self.angle)
        self.speed += share * (sign * speed - self.speed)


class MergedSteering:
    """The original's law."""

    def __init__(self, tags, period, rests):
        self.tuning, self.period, self.rests = tags.steering_record(), period, rests
        self.half = ROUNDED if tags.faithful else math.pi
        self.motion = Direction(self.tuning.damp_icm / period, self.half)
        self.error = Direction(self.tuning.damp_sp / period, self.half)
        self.threshold = self.tuning.damp / period * (self.motion.threshold + self.error.threshold)
        self.angle = 0.0

    def start(self, angle):
        """Begin with a direction, at rest."""
        for direction in (self.motion, self.error):
            direction.angle, direction.speed = angle, 0.0
        self.angle = angle

    def update(self, wanted, error, speed):
        """Return the direction of this cycle."""
        if self.rests and wanted == (0.0, 0.0) and math.hypot(*error) < RESTING:
            return self.angle
        tuning, motion, errors = self.tuning, self.motion, self.error
        if wanted == (0.0, 0.0) and nearest(motion.angle, self.angle)[0] > math.pi / 4.0:
            motion.angle -= math.pi - self.half
        motion.follow(math.atan2(wanted[1], wanted[0]), math.hypot(*wanted))
        errors.follow(math.atan2(error[1], error[0]), tuning.tracking * math.hypot(*error))
        scale = 1.0
        if speed < SLOW and abs(errors.speed * self.period) < NEAR:
            scale = GAIN * speed + abs(errors.speed)
        trust = min(scale, 1.0)
        if scale < 1.0 and abs(motion.speed) < SLOW:
            trust += GAIN * abs(motion.speed)
        a = tuning.icm * motion.speed * np.exp(1j * motion.angle)
        b = tuning.sp * errors.speed * np.exp(1j * errors.angle)
        angle, _ = nearest(float(np.angle(a + scale * b)), self.angle, self.half)
        self.angle += math.tanh(abs(a + b) * trust / self.threshold) * (angle - self.angle)
        return self.angle


class KeptSteering:
    """The law with a gain across the wheels."""

    def __init__(self, gain, period):
        self.gain, self.rate, self.angle, self.is_resting = gain, period / RELAXATION, 0.0, False

    def start(self, angle):
        """Begin with a direction."""
        self.angle = angle

    def update(self, wanted, error, speed):
        """Return the direction of this cycle."""
        distance = math.hypot(*error)
        self.is_resting = wanted == (0.0, 0.0) and distance < (AWAKE if self.is_resting else SMALL)
        if not self.is_resting:
            gain = self.gain * (1.0 - RESTING / distance) if distance > RESTING else 0.0
            x, y = wanted[0] + gain * error[0], wanted[1] + gain * error[1]
            aim, _ = nearest(math.atan2(y, x), self.angle)
            self.angle += (1.0 - math.exp(-self.rate * math.hypot(x, y))) * (aim - self.angle)
        return self.angle


class SlowWheels(WheeledMotion):
    """The component, whose joint velocities are computed slowly; the pace is 1."""

    def init(self):
        """See `WheeledMotion.init`."""
        super().init()
        tags, count = self.tags, len(self._wheels)
        rests, across = tags.is_mended("rest"), tags.gain_across
        self.slow = [
            KeptSteering(across, self.period) if across else MergedSteering(tags, self.period, rests)
            for _ in range(count)
        ]
        heading, self.ways = self._offsets.heading, np.zeros(count)
        if tags.is_mended("start_in_place"):
            for wheel, angle in zip(self.slow, self.steering_angles.tolist(), strict=True):
                wheel.start(angle - heading)
        self.last, self.found = (self._pose.value[:2].copy(), heading), (0, 1.0)

    def update(self):
        """Compute one cycle."""
        references, offsets, tags, stack = self.references, self._offsets, self.tags, self.stack
        self._take_over()
        self._lifting.update()
        references.step(self.period)
        offsets.reference[:] = references.vertices
        stack.update()
        if self._is_first and not tags.is_mended("prompt"):
            offsets.errors[:] = 0.0
        rates = np.zeros(len(stack.velocity))
        errors = self.errors(self.aims())
        feeds = self.feeds() if tags.is_mended("feed_forward") else {}
        gains = np.concatenate([task.gain for task in stack.tasks])
        for name, rows in self._rows.items():
            rates[rows] = gains[rows] * errors.get(name, 0.0) + feeds.get(name, 0.0)
        self._bounds.update(self._position)
        given = stack.jacobian, rates, stack.numbers[:, 3], stack.ends, self.moved
        if tags.is_mended("limits"):
            velocity, *self.found = dense_within(*given, self._bounds, stack.ends[1])
        else:
            velocity = dense_levels(*given)
        self._descent.velocity[:] = velocity
        self._integrate()
        offsets.remember()
        self._is_first = False

    def aims(self):
        """Return where wheels are to point in the world."""
        references, offsets = self.references, self._offsets
        place, heading = self._pose.value[:2].copy(), offsets.heading
        turn = np.array(((math.cos(heading), math.sin(heading)), (-math.sin(heading), math.cos(heading))))
        moved = turn @ (place - self.last[0]) / self.period
        rate = wrapped(heading - self.last[1], 2.0 * math.pi) / self.period
        self.last = place, heading
        center = self._points["base"].value[3:5] if self.tags.base == "center_of_mass" else place
        self._measure_steering()
        aims, share = np.zeros(len(self.slow)), 0.0 if references.waits else references.limits
        for index, wheel in enumerate(self.slow):
            x, y = offsets.states[index, :2] - turn @ (center - place)
            wx, wy = share * (turn @ references.velocity[:2] + references.vertex_velocity[index, :2])
            rx, ry = -y * share * references.turn[2], x * share * references.turn[2]
            wx, wy = float(wx + rx), float(wy + ry)
            ex, ey = offsets.errors[index, :2].tolist()
            aims[index] = wheel.update((wx, wy), (ex, ey), math.hypot(moved[0] - ey * rate, moved[1] + ex * rate))
            if references.lifted[index]:
                wheel.start(self.steering_angles[index] - heading)
                aims[index] = wheel.angle
                self.stack.jacobian[self._rows["STEERING"].start + index] = 0.0
        return aims + heading

    def errors(self, aims):
        """Return the errors of the tasks."""
        references, points = self.references, self._points
        (x, y, z, w), (rx, ry, rz, rw) = self._pose.value[3:], references.orientation
        turn = np.array((w, x, y, z)) @ (
            (rx, ry, rz, rw),
            (-rw, -rz, ry, rx),
            (rz, -rw, -rx, ry),
            (-ry, rx, -rw, rz),
        )
        turn = turn[:3] * (1.0 if turn[3] >= 0.0 else -1.0)
        if self.tags.is_mended("limits"):
            aims = self.turned(aims)
        found = {
            "BASE": np.concatenate((turn, references.position - points["base"].value[3:])),
            "CONTACT_POINTS": -self._offsets.value,
            "STEERING": self.soft("STEERING", self.steering_angles, aims),
        }
        for name in ("CAMBER", "CASTER"):
            wanted, angles = getattr(references, name.lower()), points[name.lower()].value
            found[name] = self.soft(name, angles, wanted)
            wanted[:] = angles + found[name]
        return found

    def soft(self, name, angles, wanted):
        """Return errors of angles of any number of half turns."""
        half = ROUNDED if self.tags.faithful else math.pi
        away = wanted - angles
        return np.clip(away - half * np.floor(away / half + 0.5), -SOFT[name], SOFT[name])

    def turned(self, aims):
        """Return aims within the ranges of the joints that steer; a wheel keeps the way that it has begun."""
        rows, limit, bounds = self._rows["STEERING"], SOFT["STEERING"], self._bounds
        for index, dof in enumerate(self._turning):
            row, angle, told = self.stack.jacobian[rows.start + index, dof], aims[index], self._position[dof]
            place, step = self.model.state.position[dof], AHEAD * self.period * self._velocity[dof]
            way = self.ways[index] + wrapped(angle - self.steering_angles[index] - self.ways[index], math.pi)
            lower, upper = bounds.lower_position[dof], bounds.upper_position[dof]
            ends = [lower < place + row * way < upper, lower < told + step < upper]
            other = way - math.copysign(math.pi, step * row if ends == [True, False] else way)
            is_good = abs(way) <= math.pi / 2.0 + LONGER and all(ends)
            if not is_good and lower + SPARE < place + row * other < upper - SPARE:
                way = other
            self.ways[index] = way
            aims[index] = self.steering_angles[index] + np.clip(way, -limit, limit)
        return aims

    def feeds(self):
        """Return the velocities that are wanted, by tasks."""
        references, offsets = self.references, self._offsets
        heading, free = offsets.heading, references.lifted
        velocity = references.vertex_velocity[:, :2] @ (
            (math.cos(heading), math.sin(heading)),
            (-math.sin(heading), math.cos(heading)),
        )
        along, (fx, fy) = np.sum(offsets.directions * velocity, axis=1), offsets.directions.T
        across = np.where(free, fx * velocity[:, 1] - fy * velocity[:, 0], 0.0)
        return {
            "BASE": np.concatenate((references.turn, references.velocity)),
            "STEERING": references.turn[2],
            "CONTACT_POINTS": np.concatenate((along, across, np.where(free, references.vertex_velocity[:, 2], 0.0))),
        }
