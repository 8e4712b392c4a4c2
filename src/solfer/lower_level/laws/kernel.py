"""The laws of the drives, compiled, or read from the cache, on import.

All numbers of a law are rows of one table.
"""

from pathlib import Path

from solfer.lower_level.laws import controllers_kernel, springs
from solfer.lower_level.laws.controllers_kernel import controller_at
from solfer.lower_level.laws.springs import REGULARISATION
from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, exact_part, part
from solfer.numerics.lapack import LAPACK, solve_positive

POSITION, VELOCITY, EFFORT, STIFFNESS, DAMPING, TORQUE, UPPER, FASTEST, FORCE, LOSS, RIGHT, BEFORE, OUTSIDE = range(13)
# only of the law with two masses
MOTOR_POSITION, MOTOR_VELOCITY, DRIVE, SPRING, DAMPER, FRICTION, COUPLING, SLOW, COMPLIANCE = range(13, 22)
TENSION, PULLED, TAKEN, LINKS, MOTORS, FREE, INERT = range(22, 29)
ROWS = 29
"""Numbers for each DoF: rows of the table of a law."""

LAW = BlockLayout(
    "Law",
    size=int,
    dposv_address=int,  # of LAPACK's function
    table=(float, ROWS, "size"),
    matrix=(float, "size", "size"),
    elastic=(bool, "size"),  # which DoFs have two masses
    sprung=(bool, "size"),  # which have a spring
)
"""What the laws read and write."""

DRIVES = BlockLayout(
    "DriveNumbers",
    size=int,
    table=(float, ROWS, "size"),  # that of the law
    controller_count=int,
    controller_addresses=(int, "controller_count"),  # addresses of their blocks
    speed_count=int,
    speed_dofs=(int, "speed_count"),
    speed=(float, "speed_count"),
)
"""What the drives read and write."""

_law_at = LAW.at
_drives_at = DRIVES.at


@exact_part
def _pull(table, position, velocity, dt):
    """Write the force of springs and dampers at a position and a velocity, and what a unit of acceleration takes."""
    for k in range(table.shape[1]):
        away = table[POSITION, k] - (velocity[k] * dt + position[k])
        force = table[STIFFNESS, k] * away + table[DAMPING, k] * (table[VELOCITY, k] - velocity[k])
        table[FORCE, k] = force + table[EFFORT, k]
        table[LOSS, k] = table[DAMPING, k] * dt


@part
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


@exact_part
def _damp(table):
    """Take what accelerations cost from the force."""
    for k in range(table.shape[1]):
        table[FORCE, k] -= table[LOSS, k] * table[RIGHT, k]


@exact_part
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


@exact_part
def _stretch(table, elastic, position, velocity):
    """Write the torques of the springs; motors of joints without two masses are where the joints are."""
    for k in range(table.shape[1]):
        if not elastic[k]:
            table[MOTOR_POSITION, k], table[MOTOR_VELOCITY, k] = position[k], velocity[k]
        tension = table[SPRING, k] * (table[MOTOR_POSITION, k] - position[k])
        table[TENSION, k] = tension + table[DAMPER, k] * (table[MOTOR_VELOCITY, k] - velocity[k])


@exact_part
def _soften(table, elastic, dt):
    """Write the law's force, and what it loses for a unit of acceleration: dt D, with two masses dt (D + dt K)."""
    for k in range(table.shape[1]):
        spring = table[STIFFNESS, k] * dt if elastic[k] else 0.0
        softening = table[COMPLIANCE, k] * table[STIFFNESS, k] + 1.0
        table[TAKEN, k] = (spring + table[DAMPING, k]) * dt / softening
        table[PULLED, k] = table[FORCE, k] / softening


@exact_part
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


@exact_part
def _move(table, elastic):
    """Write the accelerations of links and motors, and the force of the law at these."""
    for k in range(table.shape[1]):
        links = motors = table[RIGHT, k]
        table[LINKS, k] = links
        if elastic[k]:
            motors = (table[FREE, k] + table[COUPLING, k] * links) / (table[INERT, k] + table[COUPLING, k])
        table[MOTORS, k] = motors
        table[FORCE, k] = table[DRIVE, k] = table[PULLED, k] - table[TAKEN, k] * motors


@exact_part
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


@exact_part
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


@exact_part
def _accelerate(law, inertia):
    """Solve (M + W) a = r + f, with r, f and the diagonal W in the table, for a, which replaces r + f."""
    table = law.table
    matrix = law.matrix
    size = table.shape[1]
    largest = 0.0
    for k in range(size):
        table[RIGHT, k] = table[FORCE, k] + table[OUTSIDE, k]
        for j in range(size):
            matrix[k, j] = inertia[j, k]
        matrix[k, k] += table[LOSS, k]
        if k == 0 or not matrix[k, k] <= largest:  # NaN stays NaN
            largest = matrix[k, k]
    little = REGULARISATION * largest
    for k in range(size):
        matrix[k, k] += little
    if not solve_positive(law.dposv_address, matrix, table[RIGHT]):  # leave this step to the explicit law
        table[RIGHT, :] = 0.0


@exact_part
def _drive(law, inertia):
    """Write accelerations and torques of the drives; see `TwoMassImpedance`. Returns whether some reach a limit."""
    table = law.table
    _balance(table, law.elastic)
    _accelerate(law, inertia)
    _move(table, law.elastic)
    _limit(table, table[MOTOR_VELOCITY])
    return _clip(table, law.sprung)


def _update_rigid(address, inertia, position, velocity, dt):
    """Write the torques for a step, see `ImplicitImpedance.update`."""
    law = _law_at(address)
    table = law.table
    _feel(table, inertia, velocity, dt)
    _pull(table, position, velocity, dt)
    _accelerate(law, inertia)
    _damp(table)
    _limit(table, velocity)


def _update_two_mass(address, inertia, position, velocity, dt):
    """Write the torques for a step, and move the motors on, see `TwoMassImpedance.update`."""
    law = _law_at(address)
    table = law.table
    _feel(table, inertia, velocity, dt)
    _stretch(table, law.elastic, position, velocity)
    _pull(table, table[MOTOR_POSITION], table[MOTOR_VELOCITY], dt)
    _soften(table, law.elastic, dt)
    if _drive(law, inertia):  # then some drives do not follow their law, and all is different
        _drive(law, inertia)
    _release(table, law.elastic, dt)


def _collect(address, factor):
    """Write what controllers command to the table, springs and feed-forward torques times a factor; and speeds."""
    drives = _drives_at(address)
    table = drives.table
    for each in drives.controller_addresses:
        controller = controller_at(each)
        for k in range(controller.count):
            dof = controller.dofs[k]
            table[VELOCITY, dof] = controller.velocity[k]
            if controller.has_springs:
                table[POSITION, dof] = controller.target[k]
                table[EFFORT, dof] = controller.applied_effort[k] * factor
                table[STIFFNESS, dof] = controller.stiffness[k] * factor
                table[DAMPING, dof] = controller.damping[k]
    for k in range(drives.speed_count):
        drives.speed[k] = table[VELOCITY, drives.speed_dofs[k]]


_SOURCES = [LAPACK, Path(springs.__file__), Path(controllers_kernel.__file__)]
_LAW = "void(int64, float64[:, :], float64[::1], float64[::1], float64)"
update_rigid = cached(_LAW, _update_rigid, sources=_SOURCES)
update_two_mass = cached(_LAW, _update_two_mass, sources=_SOURCES)
collect = cached("void(int64, float64)", _collect, sources=_SOURCES)
