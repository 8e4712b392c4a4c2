"""Pace, references and guard of `wheeled_motion` in plain Python, one equation after the other, for comparison."""

import math

import numpy as np
from support.unit.slow_turns import SlowTurns

from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.kernel import find_rates
from solfer.components.wheeled_motion.references import about_z
from solfer.numerics.rotations import quaternion_product

SIDEWAYS, SLOWER, FASTER, RISING, BRAKING, STARTING = 4e-3, 8.0, 1.0, 2.0, 4.0, 3.0
HORIZON, LACK, SWIFT, STRAIGHT, STEERING, RETRY = 0.25, 1e-3, 0.5, 25.0, 0.25, 1.0
ASIDE, WORSE, LEAN, AWAY = 0.5, 1.1, 0.5, 0.02
PATIENCE = 0.55
FAR = 0.2


class SlowPace:
    """The pace, as `PathPace` has it."""

    def __init__(self, tags, period):
        self._speeds, self._step = (tags.base_speed, tags.turn_speed, tags.vertex_speed), tags.acceleration * period
        self._period = period
        self.value = self.most = self.held = self._share = 1.0
        self._speed = 0.0

    def update(self, references, told, heading, is_held, is_first):
        """Compute the pace of this cycle."""
        base, turn, vertex = self._speeds
        self.most = min(
            1.0,
            base / max(base, np.linalg.norm(references.velocity)),
            turn / max(turn, abs(references.turn[2])),
            *(vertex / max(vertex, np.linalg.norm(each)) for each in references.vertex_velocity),
        )
        if not is_first:
            self._follow(told, heading, is_held)
        self.value = self._share * self.most

    def _follow(self, told, heading, is_held):
        _, aims, speeds, measured = told
        across = max(SIDEWAYS, *(speeds * abs(np.sin(aims - measured + heading))))
        self.held = min(max(self.held + (-SLOWER if is_held else FASTER) * self._period, 0.0), 1.0)
        share, fastest = min(SIDEWAYS / across, self.held), max(speeds)
        if fastest > 0.0:
            step, before = self._step / fastest, self._speed / fastest
            share = max(share, min(self._share, before) - BRAKING * step)
            share = min(share, self._share + RISING * step, before + STARTING * step)
        self._share, self._speed = share, share * fastest


class SlowReferences:
    """References after one step."""

    def __init__(self, references, pace, period):
        time = pace * period
        self.position = references.position + time * references.velocity
        self.vertices = references.vertices + time * references.vertex_velocity
        rx, ry, rz = time * references.turn / 2.0
        self.heading = (references.heading + 2.0 * rz + math.pi) % (2.0 * math.pi) - math.pi
        roll, pitch = (math.sin(rx), 0.0, 0.0, math.cos(rx)), (0.0, math.sin(ry), 0.0, math.cos(ry))
        tilt = quaternion_product(quaternion_product(roll, pitch), references.tilt.tolist())
        self.orientation = quaternion_product(about_z(self.heading), tilt)


class SlowPolygon:
    """The support polygon."""

    def __init__(self, vertices, center, least):
        self._vertices, self._center, self._least = vertices, center, least

    def update(self, lifted):
        """Compute the edges, counterclockwise, with the distance of the centre of mass and the normal to the inside."""
        places = {index: self._vertices[index].value[:2] for index in np.flatnonzero(~lifted).tolist()}
        middle, center = np.mean(list(places.values()), axis=0), self._center.value[:2]
        order = sorted(places, key=lambda index: math.atan2(*(places[index] - middle)[::-1]))
        self.edges = []
        for a, b in zip(order, [*order[1:], order[0]], strict=True):
            (x, y), length = places[b] - places[a], np.linalg.norm(places[b] - places[a])
            normal = np.array((-y, x)) / length
            self.edges.append((a, b, normal @ (center - places[a]), normal))
        self.margin = min(margin for _, _, margin, _ in self.edges)

    def share(self, velocity):
        """Return the share of velocities with which the margin does not fall below what is left."""
        share, self.is_held = 1.0, False
        for a, b, margin, normal in self.edges:
            left = margin - self._least
            if left > 0.1:
                continue
            rate = normal @ self._rate(self._vertices[a], self._vertices[b], velocity)
            if left + HORIZON * share * rate < 0.0:
                share, self.is_held = (max(0.0, -left / (HORIZON * rate)) if rate < 0.0 else 1.0), True
        return share

    def _rate(self, first, second, velocity):
        """Return the velocity of the centre of mass, less that of what is beside it on an edge."""
        edge, away = second.value[:2] - first.value[:2], self._center.value[:2] - first.value[:2]
        start, end = first.jacobian[:2] @ velocity, second.jacobian[:2] @ velocity
        return self._center.jacobian[:2] @ velocity - start - (away @ edge) / (edge @ edge) * (end - start)


class SlowGuard:
    """What holds motions."""

    def __init__(self, component):
        rows, self._legs, self._turning = component._rows, component._legs, component._turning
        wheels = [wheel.end_frame for wheel in component._wheels]
        kinds = (("CAMBER", "camber", "rad", LEAN), ("CASTER", "caster", "rad", LEAN))
        self._watched = [
            (f"{what} of '{wheel}'", unit, most, rows[task].start + index)
            for task, what, unit, most in (*kinds, ("CONTACT_POINTS", "vertex", "m", AWAY))
            for index, wheel in enumerate(wheels)
        ]
        self._way, self.why, self._worst, self._age = np.zeros(rows["CASTER"].stop), "", 0.0, 0.0

    def update(self, polygon, errors, forward, pace, velocity, period):
        """Return whether the motion is held."""
        size = float(np.linalg.norm(forward))
        if size == 0.0:
            return False
        is_other = forward @ self._way < ASIDE * size
        why, amount = self._reason(polygon, errors, pace * size, velocity)
        if why and amount > (WORSE * self._worst if self.why and is_other else 0.0):
            self.why, self._worst, self._age, self._way = why, amount, 0.0, forward / size
            return True
        if not self.why:
            return False
        self._age += period
        if self._age > RETRY and not why:
            self.why, self._worst, self._age = "", 0.0, 0.0
        return bool(self.why) and not is_other

    def _reason(self, polygon, errors, speed, velocity):
        why, worst = "", 1.0
        if polygon.is_held:
            why = f"the centre of mass is {polygon.margin:.3f} m inside the support polygon"
        for what, unit, most, row in self._watched:
            error = abs(errors[row])
            if error > worst * most:
                why, worst = f"{what} is {error:.2f} {unit} off", error / most
        if why:
            return why, worst
        swift = {name: abs(velocity[dof]) for name, dof in self._legs.items()}
        name = max(swift, key=swift.__getitem__)
        if swift[name] > max(SWIFT, STRAIGHT * speed, STEERING * max(abs(velocity[self._turning]))):
            return f"joint '{name}' is near a singularity", 1.0
        return "", 0.0


class WatchedWheels(WheeledMotion):
    """The component, whose pace, references and guard are computed slowly, too; `pairs` are both of this cycle."""

    def init(self):
        """See `WheeledMotion.init`."""
        super().init()
        tags = self.tags
        self.slow_pace, self.slow_guard = SlowPace(tags, self.period), SlowGuard(self)
        self.slow_polygon = SlowPolygon(self._offsets.vertices, self._points["base"].center, tags.support_margin)
        self.slow_held, self.pairs, self.reasons = False, [], set()
        self.slow_turns = SlowTurns(self)

    def _stay(self):
        """See `WheeledMotion._stay`."""
        super()._stay()
        self.slow_turns.start()

    def update(self):
        """Compute one cycle."""
        references, stack, offsets = self.references, self.stack, self._offsets
        self._follow_message()
        self._lifting.update()
        slow = self.slow_pace
        slow.update(references, self._steering.told, offsets.heading, self.slow_held, self._is_first)
        expected = SlowReferences(references, slow.value, self.period)
        self._pace.advance(True, self._is_first, self._is_held, self.passed)
        self.pairs += [(references.pace, slow.value), (references.limits, slow.most), (self._pace.held, slow.held)]
        names = ("position", "vertices", "heading", "orientation")
        self.pairs += [(np.copy(getattr(references, name)), getattr(expected, name)) for name in names]
        stack.update_jacobian()
        self.turns = self.slow_turns.update()
        self._steer()
        self._find_errors()
        find_rates(self._memory.address, True, True)
        self._compare_rates()
        self._bounds.update(self._position)
        self._descent.update(stack.jacobian, stack.velocity, self._damping, self._bounds)
        self._compare_held()
        self._integrate()
        self._is_first = False

    def _follow_message(self):
        drive, references = self.drive, self.references
        state, velocity, turn = drive._state.copy(), references.velocity.copy(), float(references.turn[2])
        self._take_over()
        if not drive.is_active:
            return
        turned = self._offsets.heading if math.isnan(state[6]) else state[6]
        seen = np.exp(-1j * turned) * complex(*velocity[:2])
        wanted, rate = (complex(*state[:2]), state[3]) if state[5] + self.period <= PATIENCE else (0.0, 0.0)
        most, most_turn = self.tags.acceleration * self.period, self.tags.turn_acceleration * self.period
        seen += (wanted - seen) * min(1.0, most / max(abs(wanted - seen), 1e-12))
        told = np.exp(1j * self._offsets.heading) * seen
        self.pairs += [(references.velocity[:2].copy(), (told.real, told.imag))]
        self.pairs += [(float(references.turn[2]), turn + min(max(rate - turn, -most_turn), most_turn))]

    def _compare_rates(self):
        rates, tags, pace = self._gain * self._error, self.tags, self.references.pace
        for name, most in (("BASE", tags.base_speed), ("CONTACT_POINTS", tags.vertex_speed)):
            rates[self._rows[name]] = np.clip(rates[self._rows[name]], -most, most)
        self.pairs += [(self._rates.away.copy(), rates)]
        wanted, steering = rates + pace * self._rates.forward, self._rows["STEERING"]
        near = abs(self._error[steering]) < FAR - 1e-9
        most, turned = FAR * self._gain[steering], wanted[steering] + self.turns
        rows, with_base = self.stack.jacobian[steering], pace * self.references.turn[2]
        for index, dof in enumerate(self._turning):
            rate = np.clip(turned, -most, most)[index] if near[index] else wanted[steering][index]
            ends = (self._bounds.lower_position[dof], self._bounds.upper_position[dof]) - self._position[dof]
            ends = sorted(with_base + rows[index, dof] * ends / self.period)
            wanted[steering.start + index] = np.clip(rate, *ends)
        self.pairs += [(self.stack.velocity.copy(), wanted)]

    def _compare_held(self):
        descent, polygon, pace = self._descent, self.slow_polygon, self.references.pace
        polygon.update(self.references.lifted)
        share = polygon.share(descent.velocity)
        velocity = share * descent.velocity
        driven = np.r_[self._rows["BASE"], self._rows["CONTACT_POINTS"]]
        away, forward = self._rates.away[driven], self._rates.forward[driven]
        is_bound = (descent.last >= 0 or share < 1.0) and away @ forward > LACK * np.linalg.norm(forward)
        given = self._error, self._rates.forward, pace, velocity, self.period
        self.slow_held = bool(self.slow_guard.update(polygon, *given) or is_bound)
        self._hold_back()
        self.pairs += [(descent.velocity.copy(), velocity), (self._guard.margin, polygon.margin)]
        self.pairs += [(self._is_held, self.slow_held), (self._guard.why == self.slow_guard.why, True)]
        self.reasons.add(self._guard.why.rpartition(" is ")[2])
