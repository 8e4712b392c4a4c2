"""Compiled steps of joint-space pipes: a message to its State, and a State to its message."""

from pathlib import Path

import numpy as np

from solfer.numerics import kernels
from solfer.numerics.blocks import BlockLayout
from solfer.numerics.checks import joints
from solfer.numerics.compilation import cached, exact_part

TURNS = BlockLayout(
    "Turns",
    count=int,
    size=int,
    known_count=int,
    before=(float, 3, "count"),  # see `unwrap`
    revolutions=(float, "count"),
    added=(float, "count"),
    known=(float, "known_count"),  # what was added before
    known_places=(int, "count"),
    dofs=(int, "count"),
    counts=(float, "size"),  # what is added to DoFs of the Robot
    aligned=(bool, "count"),  # joints that have a first position
    begin=(float, "size"),  # where they begin
    waits=int,  # whether they wait for that until it is measured: one at zero is not
)
"""What joints need that may count within a turn."""

RECEPTION = BlockLayout(
    "Reception",
    rows=int,
    count=int,
    values=(float, "rows", "count"),
    sign=(float, "rows", "count"),
    offset=(float, "rows", "count"),
    position=int,  # row of the positions
    velocity=int,  # that of the velocities; -1: none is received
    turns=int,  # address of a `TURNS`; 0: nothing is added
    leaps=int,  # address of a `LEAPS`; 0: all is accepted
    writes=int,  # whether values go to the State as they are
    dofs=(int, "count"),
    state=(int, "rows"),  # addresses of arrays of the State
)
"""What a message of joints is checked with, and where its numbers go."""

COMMAND = BlockLayout(
    "Command",
    rows=int,
    count=int,
    size=int,
    block=(float, "rows", "count"),
    dofs=(int, "count"),
    state=(int, "rows"),  # addresses of arrays of the State
    lower=(float, "rows", "count"),
    upper=(float, "rows", "count"),
    kept=(float, "rows", "count"),  # what was sent last
    steps=(float, "rows"),  # see `keep`
    sent=(float, "rows", "count"),  # as the receiver gets it; `block` itself where that is the same
    corrects=int,  # whether it is another one
    sign=(float, "rows", "count"),
    shift=(float, "rows", "count"),
    turning=int,  # row of the positions whose turns the receiver does not count; -1: none
    added=(float, "size"),  # turns that the Robot counts more than it
)
"""What is collected from a State, and how it is sent."""

_turns_at = TURNS.at
_reception_at = RECEPTION.at
_command_at = COMMAND.at
_unwrap = exact_part(kernels._unwrap)
_keep_revolutions = exact_part(kernels._keep_revolutions)
_scatter = exact_part(kernels._scatter)
_collect = exact_part(kernels._collect)
_keep = exact_part(kernels._keep)
_inside = exact_part(kernels._inside)


@exact_part
def _is_first(turns, k):
    """Return whether a position is the first one of a joint, which is aligned with it."""
    return not turns.aligned[k] and (not turns.waits or turns.begin[turns.dofs[k]] != 0.0)


@exact_part
def _add_turns(start, position, part):
    """Add turns to positions, and those that align joints whose first position comes."""
    turns = _turns_at(start)
    _unwrap(turns.before, turns.revolutions, turns.added, turns.known, turns.known_places, position, part)
    for k in part:
        if _is_first(turns, k):
            revolution = turns.revolutions[k]
            shift = revolution * np.rint((turns.begin[turns.dofs[k]] - position[k]) / revolution)
            position[k] += shift
            turns.added[k] += shift


@exact_part
def _keep_turns(start, position, part):
    """Let the next message be compared with this one, which fits."""
    turns = _turns_at(start)
    _keep_revolutions(turns.before, turns.added, turns.dofs, turns.counts, position, part)
    for k in part:
        if _is_first(turns, k):
            turns.aligned[k] = True


def _receive(start, numbers, rows, source, places, arrival, stamp):
    """Take the numbers of a message, numbers[rows][:, source], to the columns `places` of the pipe's values.

    Args:
        start: Address of a `RECEPTION`.
        numbers: All numbers of the message, one field below the other.
        rows: Rows of the pipe's fields.
        source: Columns of its joints.
        places: Indices of these joints in the pipe.
        arrival: When the message arrived.
        stamp: When it was true.

    Returns:
        The index, row by row, of the first number that is not finite; or that number of numbers and what `find_leap`
        has found; or -1 if all is well, less the rows of the State that have changed, a bit each.
    """
    block = _reception_at(start)
    count = len(source)
    for row in range(len(rows)):
        for index in range(count):
            number = numbers[rows[row], source[index]]
            if number - number != 0.0:  # infinity and NaN
                return row * count + index
            place = places[index]
            block.values[row, place] = block.sign[row, place] * (number - block.offset[row, place])
    position = block.values[block.position]
    if block.turns:
        _add_turns(block.turns, position, places)
    if block.leaps:
        velocity = block.values[max(block.velocity, 0)][: block.count if block.velocity >= 0 else 0]
        wrong = joints.find_leap(block.leaps, position, velocity, places, arrival, stamp)
        if wrong >= 0:
            return len(rows) * count + wrong
    if block.turns:
        _keep_turns(block.turns, position, places)
    return -1 - _scatter(block.dofs, block.state, block.values, places) if block.writes else -1


def _fill(start):
    """Collect a command from its State; return whether any of it is not finite, or beyond its bounds.

    Args:
        start: Address of a `COMMAND`.
    """
    command = _command_at(start)
    _collect(command.state, command.dofs, command.block)
    for row in range(command.rows):
        if not _inside(command.block[row], command.lower[row], command.upper[row]):
            return True
    return False


def _pack(start):
    """Keep a command that is sent, and make of it what the receiver gets; return the largest step of a joint.

    Args:
        start: Address of a `COMMAND`.
    """
    command = _command_at(start)
    farthest = _keep(command.block, command.kept, command.steps)
    if command.corrects:
        for row in range(command.rows):
            for k in range(command.count):
                value = command.block[row, k]
                if row == command.turning:
                    value -= command.added[command.dofs[k]]
                command.sent[row, k] = command.sign[row, k] * value - command.shift[row, k]
    return farthest


_SOURCES = [Path(kernels.__file__), Path(joints.__file__)]
receive = cached(
    "int64(int64, float64[:, ::1], int64[::1], int64[::1], int64[::1], float64, float64)", _receive, sources=_SOURCES
)
fill = cached("boolean(int64)", _fill, sources=_SOURCES)
pack = cached("float64(int64)", _pack, sources=_SOURCES)
