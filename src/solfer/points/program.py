"""Programs for the kernel: operations, with the addresses of the arrays that they use."""

import abc
from collections.abc import Iterable
from typing import Any

import numpy as np

from solfer.errors import SizeMismatch
from solfer.model.view import RobotView
from solfer.points.compiled import layout
from solfer.points.compiled.kernel import run
from solfer.points.point import Arrangement, Point

NOTHING = np.zeros(0)


class Instruction:
    """One row of a program: the computation of a point.

    Args:
        operation: Operation of `solfer.points.compiled.layout`.
        point: The point that is written.
        operands: Points that are read, at most two.
        numbers: Parameters, float64.
        table: Parameters, int64.
        joint: Joint that carries the point.
        count: Number that replaces the size of the first operand.
        columns: DoFs that the operation runs over; None: those of the point.

    Attributes:
        row: The numbers of the row.
        arrays: Arrays whose addresses the row contains.

    Raises:
        SizeMismatch: The Jacobians of the operands are not as wide as that of the point.
    """

    def __init__(
        self,
        operation: int,
        point: Point,
        operands: tuple[Point, ...] = (),
        numbers: np.ndarray = NOTHING,
        table: np.ndarray = NOTHING,
        joint: int = 0,
        count: int = 0,
        columns: np.ndarray | None = None,
    ):
        columns = point.written_columns() if columns is None else columns
        _require_fit(point, operands, columns)
        self.row = np.zeros(layout.WIDTH, dtype=np.int64)
        self.arrays: list[Any] = [point.value, point.jacobian, point.flags, numbers, table, columns]
        for operand, place in zip(operands, (layout.FIRST, layout.SECOND), strict=False):
            self.row[place], self.row[place + 1] = address(operand.value), address(operand.jacobian)
            self.arrays += [operand.value, operand.jacobian]
        for place, array in (
            (layout.VALUE, point.value),
            (layout.JACOBIAN, point.jacobian),
            (layout.NUMBERS, numbers),
            (layout.TABLE, table),
            (layout.COLUMNS, columns),
            (layout.FLAGS, point.flags),
        ):
            self.row[place] = address(array)
        self.row[layout.OPERATION], self.row[layout.JOINT] = operation, joint
        self.row[layout.SIZE], self.row[layout.ROWS], self.row[layout.COUNT] = point.size, point.rows, len(columns)
        self.row[layout.SIZE_OF_FIRST] = operands[0].size if operands else count


def folded(point: Point, carried: np.ndarray, *instructions: Instruction) -> tuple[Instruction, ...]:
    """Return the instructions of a point, and one that gives the columns of followers to their leaders.

    Args:
        point: The point, of a Robot.
        carried: DoFs whose columns the instructions write.
        *instructions: The computation of the point.
    """
    followers, there = point.robot.kinematics.tree.followers, set(carried.tolist())
    table, ratios = [], []
    for dof, leader, ratio in zip(followers.dofs, followers.leaders, followers.ratios, strict=True):
        if int(dof) in there:
            table.append((dof, leader, int(leader) in there))
            ratios.append(ratio)
            there.add(int(leader))
    if not table:
        return instructions
    rows, shares = np.array(table, dtype=np.int64), np.array(ratios)
    return (*instructions, Instruction(layout.FOLD, point, numbers=shares, table=rows, count=len(rows)))


class Program:
    """Instructions that one call of the kernel executes.

    Args:
        robot: The Robot of the points, None if they have none.
        instructions: The instructions, in order.
        dofs: Columns of all Jacobians.
    """

    def __init__(self, robot: RobotView | None, instructions: Iterable[Instruction], dofs: int):
        header, instructions = np.zeros(layout.WIDTH, dtype=np.int64), list(instructions)
        header[layout.DOFS] = dofs
        self._arrays: list[Any] = [one.arrays for one in instructions]
        if robot is not None:
            # the arrays are Pinocchio's, and live as long as the kinematics; a State keeps its own
            tree = robot.kinematics.tree
            header[layout.JOINT_JACOBIAN], header[layout.PLACEMENTS] = address(tree.jacobian), address(tree.placements)
            header[layout.VELOCITY] = address(tree.velocity)
            header[layout.ACCELERATION] = address(robot.state.acceleration)
            self._arrays += [robot.kinematics, robot.state]
        self._rows = np.vstack([header, *(one.row for one in instructions)])

    def __call__(self, jacobian: bool) -> None:
        """Compute all values, and all Jacobians if `jacobian`."""
        run(self._rows, jacobian)


class CompiledPoint(Point, abc.ABC):
    """A point that the kernel computes."""

    _program: Program
    _version = -1
    _operands: tuple[Point, ...] = ()

    @property
    def is_plain(self) -> bool:
        """Return whether no subclass computes it in another way."""
        own = type(self)
        return (
            own.update is CompiledPoint.update
            and own.compute is CompiledPoint.compute
            and own.compute_jacobian is CompiledPoint.compute_jacobian
        )

    def compute(self) -> None:
        """Write the value."""
        self.update(jacobian=False)

    def compute_jacobian(self) -> None:
        """Write the value and the Jacobian."""
        self.update()

    def update(self, jacobian: bool = True) -> None:
        """Compute the value, and the Jacobian if `jacobian`, at the state of the last update of the Robot."""
        if self._version != Arrangement.version:
            self._program = Program(self.robot, self.instructions(), self.cols)
            self._version = Arrangement.version
        self._program(jacobian)

    @abc.abstractmethod
    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""


def _require_fit(point: Point, operands: tuple[Point, ...], columns: np.ndarray) -> None:
    """Check sizes, since the kernel checks no bounds."""
    for operand in operands:
        if operand.cols not in (0, point.cols):
            raise SizeMismatch(f"{point} has a Jacobian of {point.cols} columns, {operand} one of {operand.cols}")
    if len(columns) and columns[-1] >= point.cols:
        raise SizeMismatch(f"{point} has a Jacobian of {point.cols} columns, DoF {columns[-1]} moves it")


def address(array: np.ndarray) -> int:
    """Return the address of an array's memory; 0 if it has no entries."""
    return array.ctypes.data if array.size else 0
