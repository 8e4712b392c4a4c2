"""Loops over the DoFs of the laws, compiled, or read from the cache, on import.

All numbers of a law are rows of one table, so that a call has few arguments.
"""

from solfer.numerics.compilation import REORDERED, cached

POSITION, VELOCITY, EFFORT, STIFFNESS, DAMPING, TORQUE, UPPER, FASTEST, FORCE, LOSS, RIGHT, BEFORE, OUTSIDE = range(13)
# only of the law with two masses
MOTOR_POSITION, MOTOR_VELOCITY, DRIVE, SPRING, DAMPER, FRICTION, COUPLING, SLOW, COMPLIANCE = range(13, 22)
TENSION, PULLED, TAKEN, LINKS, MOTORS, FREE, INERT = range(22, 29)
ROWS = 29
"""Numbers for each DoF: rows of the table of a law."""

_TABLE = "float64[:, ::1]"
_NUMBERS = "float64[::1]"
_FLAGS = "boolean[::1]"


def _pull(table, position, velocity, dt):
    """Write the force of springs and dampers at a position and a velocity, and what a unit of acceleration takes."""
    for k in range(table.shape[1]):
        away = table[POSITION, k] - (velocity[k] * dt + position[k])
        force = table[STIFFNESS, k] * away + table[DAMPING, k] * (table[VELOCITY, k] - velocity[k])
        table[FORCE, k] = force + table[EFFORT, k]
        table[LOSS, k] = table[DAMPING, k] * dt


def _feel(table, inertia, velocity, dt):
    """Write the force that was there in the last step beside the torque, M dv/dt - tau, and the new BEFORE."""
    size = table.shape[1]
    for j in range(size):
        table[RIGHT, j] = (velocity[j] - table[BEFORE, j]) / dt
        table[BEFORE, j] = velocity[j]
    for k in range(size):
        outside = -table[TORQUE, k]
        for j in range(size):
            outside += inertia[j, k] * table[RIGHT, j]  # symmetric, and Pinocchio's columns are contiguous
        table[OUTSIDE, k] = outside


def _damp(table, acceleration):
    """Take what accelerations cost from the force."""
    for k in range(table.shape[1]):
        table[FORCE, k] -= table[LOSS, k] * acceleration[k]


def _limit(table, velocity):
    """Write the force, within the limits of the drives at a velocity, to the torque; NaN stays NaN."""
    for k in range(table.shape[1]):
        torque = table[FORCE, k]
        upper = table[UPPER, k]
        fastest = table[FASTEST, k]
        torque = upper if torque > upper else -upper if torque < -upper else torque
        if (velocity[k] >= fastest and torque > 0.0) or (velocity[k] <= -fastest and torque < 0.0):
            torque = 0.0
        table[TORQUE, k] = torque


def _stretch(table, elastic, position, velocity):
    """Write the torques of the springs; motors of joints without two masses are where the joints are."""
    for k in range(table.shape[1]):
        if not elastic[k]:
            table[MOTOR_POSITION, k], table[MOTOR_VELOCITY, k] = position[k], velocity[k]
        tension = table[SPRING, k] * (table[MOTOR_POSITION, k] - position[k])
        table[TENSION, k] = tension + table[DAMPER, k] * (table[MOTOR_VELOCITY, k] - velocity[k])


def _soften(table, elastic, dt):
    """Write the law's force, and what it loses for a unit of acceleration: dt D, with two masses dt (D + dt K)."""
    for k in range(table.shape[1]):
        spring = table[STIFFNESS, k] * dt if elastic[k] else 0.0
        softening = table[COMPLIANCE, k] * table[STIFFNESS, k] + 1.0
        table[TAKEN, k] = (spring + table[DAMPING, k]) * dt / softening
        table[PULLED, k] = table[FORCE, k] / softening


def _balance(table, elastic):
    """Write force and diagonal of the linear system for the links' accelerations; see `TwoMassImpedance._solve`."""
    for k in range(table.shape[1]):
        free = table[PULLED, k] - table[FRICTION, k] * table[MOTOR_VELOCITY, k] - table[TENSION, k]
        inert = table[SLOW, k] + table[TAKEN, k]
        ratio = table[COUPLING, k] / (inert + table[COUPLING, k]) if elastic[k] else 1.0
        table[FREE, k] = free
        table[INERT, k] = inert
        table[FORCE, k] = ratio * free + table[TENSION, k]
        table[LOSS, k] = ratio * inert


def _move(table, elastic, acceleration):
    """Write the accelerations of links and motors, and the force of the law at these."""
    for k in range(table.shape[1]):
        links = motors = acceleration[k]
        table[LINKS, k] = links
        if elastic[k]:
            motors = (table[FREE, k] + table[COUPLING, k] * links) / (table[INERT, k] + table[COUPLING, k])
        table[MOTORS, k] = motors
        table[FORCE, k] = table[DRIVE, k] = table[PULLED, k] - table[TAKEN, k] * motors


def _clip(table, sprung):
    """Let drives behind a spring that reach a limit be constant; returns whether there are any."""
    some = False
    for k in range(table.shape[1]):
        clipped = sprung[k] and table[TORQUE, k] != table[DRIVE, k]
        table[DRIVE, k] = table[TORQUE, k]
        if clipped:
            table[PULLED, k] = table[DRIVE, k]
            table[TAKEN, k] = 0.0
            some = True
    return some


def _release(table, elastic, dt):
    """Write the springs' torques with what the drives have left, and move the motors on."""
    for k in range(table.shape[1]):
        free = table[DRIVE, k] - table[FRICTION, k] * table[MOTOR_VELOCITY, k] - table[TENSION, k]
        motors = table[MOTORS, k]
        coupling = table[COUPLING, k]
        slow = table[SLOW, k]
        if elastic[k]:
            motors = (free + coupling * table[LINKS, k]) / (slow + coupling)
            table[MOTORS, k] = motors
            table[TORQUE, k] = coupling * (motors - table[LINKS, k]) + table[TENSION, k]
        else:  # what friction takes
            table[TORQUE, k] = free - slow * motors
        table[MOTOR_VELOCITY, k] += motors * dt
        table[MOTOR_POSITION, k] += table[MOTOR_VELOCITY, k] * dt


pull = cached(f"void({_TABLE}, {_NUMBERS}, {_NUMBERS}, float64)", _pull)
feel = cached(f"void({_TABLE}, float64[:, :], {_NUMBERS}, float64)", _feel, fastmath=REORDERED)
damp = cached(f"void({_TABLE}, {_NUMBERS})", _damp)
limit = cached(f"void({_TABLE}, {_NUMBERS})", _limit)
stretch = cached(f"void({_TABLE}, {_FLAGS}, {_NUMBERS}, {_NUMBERS})", _stretch)
soften = cached(f"void({_TABLE}, {_FLAGS}, float64)", _soften)
balance = cached(f"void({_TABLE}, {_FLAGS})", _balance)
move = cached(f"void({_TABLE}, {_FLAGS}, {_NUMBERS})", _move)
clip = cached(f"boolean({_TABLE}, {_FLAGS})", _clip)
release = cached(f"void({_TABLE}, {_FLAGS}, float64)", _release)
