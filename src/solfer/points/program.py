"""Programs for the kernel: instructions, with the addresses of the arrays that they use."""

import abc
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from solfer.errors import SizeMismatch
from solfer.model.view import RobotView
from solfer.numerics.pointers import address
from solfer.points.compiled.algebra import fold
from solfer.points.compiled.instruction import FOLLOWER, INSTRUCTION, PROGRAM
from solfer.points.compiled.kernel import Operation, run
from solfer.points.compiled.registry import Kernel
from solfer.points.point import Point

NO_NUMBERS = np.zeros(0)
"""Parameters, or an offset, of operations without."""


@dataclass(frozen=True)
class LinkMotion:
    """What an operation computes of the motion of a link.

    Attributes:
        joint: Joint that carries the point.
        parts: Parts of the motion.
        offset: The offset that is written, where the point is dynamic.
    """

    joint: int = 0
    parts: int = 0
    offset: np.ndarray = field(default_factory=lambda: NO_NUMBERS)


class Instruction:
    """One operation of the kernel on a point.

    Args:
        kernel: The operation.
        point: The point that is written.
        operands: Points that are read, at most two.
        numbers: Parameters, float64.
        table: Parameters, int64 or records of `solfer.points.compiled.instruction`.
        motion: Motion of the link of the point; None: none is computed.
        columns: DoFs that the operation runs over; None: those of the point.

    Attributes:
        record: The numbers of an `INSTRUCTION`.
        arrays: Arrays whose addresses the record contains.

    Raises:
        SizeMismatch: The Jacobians of the operands are not as wide as that of the point.
    """

    def __init__(
        self,
        kernel: Kernel,
        point: Point,
        operands: tuple[Point, ...] = (),
        *,
        numbers: np.ndarray = NO_NUMBERS,
        table: np.ndarray = NO_NUMBERS,
        motion: LinkMotion | None = None,
        columns: np.ndarray | None = None,
    ):
        motion = motion or LinkMotion()
        columns = point.written_columns() if columns is None else columns
        _require_fit(point, operands, columns)
        operand_arrays = [array for operand in operands for array in (operand.value, operand.jacobian)]
        self.arrays: list[Any] = [
            *(point.value, point.jacobian, motion.offset, point.flags, columns, numbers, table),
            *operand_arrays,
        ]
        value, jacobian, written, flags, dofs, parameters, rows, *read = map(address, self.arrays)
        first, first_jacobian, second, second_jacobian = (*read, 0, 0, 0, 0)[:4]
        first_size = operands[0].size if operands else 0
        self.record = (
            *(Operation[kernel.name].value, value, jacobian, written, flags, point.size, point.rows),
            *(dofs, len(columns), first, first_jacobian, first_size, second, second_jacobian),
            *(parameters, rows, len(table), motion.joint, motion.parts),
        )


def folded(point: Point, carried: np.ndarray, *instructions: Instruction) -> tuple[Instruction, ...]:
    """Return the instructions of a point, and one that gives the columns of followers to their leaders.

    Args:
        point: The point, of a Robot.
        carried: DoFs whose columns the instructions write.
        *instructions: The computation of the point.
    """
    followers = point.robot.kinematics.tree.followers
    if not len(followers.dofs):
        return instructions
    there = set(carried.tolist())
    table = []
    ratios = []
    for dof, leader, ratio in zip(followers.dofs, followers.leaders, followers.ratios, strict=True):
        if int(dof) in there:
            table.append((dof, leader, int(leader) in there))
            ratios.append(ratio)
            there.add(int(leader))
    if not table:
        return instructions
    return (*instructions, Instruction(fold, point, numbers=np.array(ratios), table=np.array(table, dtype=FOLLOWER)))


class Program:
    """Updates points in their order: compiled ones together by one call of the kernel, others by their own `update`.

    It grows by instructions at its end. When an array has moved that it names, it is made again.

    Attributes:
        steps: What to call, each with whether Jacobians are computed.
        is_current: Whether the steps are those of all points; otherwise `complete` comes first.
    """

    def __init__(self) -> None:
        self.steps: list[Callable[[bool], object]] = []
        self.is_current = False
        self._is_expired = False
        self._blocks: list[_Block] = []
        self._count, self._watched = 0, set[int]()

    def expire(self) -> None:
        """Take it that an array has moved: all is made again by the next `complete`."""
        self.is_current = False
        self._is_expired = True

    def reopen(self) -> None:
        """Take it that there are more points: `complete` appends them."""
        self.is_current = False

    def complete(self, points: Sequence[Point], robot: RobotView | None, dofs: int) -> None:
        """Append what is missing of the points.

        Args:
            points: All points in their order, with those that it has already.
            robot: Their Robot, None if they have none.
            dofs: Columns of all Jacobians.
        """
        self._restart()
        for point in points[self._count :]:
            if isinstance(point, CompiledPoint) and point.is_plain:
                self._compile(point, robot, dofs)
            else:
                self.steps.append(point.update)
            self._count += 1
        self.is_current = not self._is_expired

    def complete_alone(self, point: "CompiledPoint") -> None:
        """Make the program of a point's own instructions."""
        self._restart()
        self._compile(point, point.robot, point.cols)
        self.is_current = not self._is_expired

    def _restart(self) -> None:
        if self._is_expired:
            self._is_expired = False
            self._count = 0
            self.steps = []
            self._blocks = []
            self._watched = set()

    def _compile(self, point: "CompiledPoint", robot: RobotView | None, dofs: int) -> None:
        instructions = point.instructions()
        self._watch(point)
        if not instructions:
            return
        if not self.steps or not self._blocks or self.steps[-1] is not self._blocks[-1].step:
            self._blocks.append(_Block(robot, dofs))
            self.steps.append(self._blocks[-1].step)
        for one in instructions:
            self._blocks[-1].append(one)

    def _watch(self, point: Point) -> None:
        """Expire when an array moves that the instructions of a point name, or one that these depend on."""
        pending = [point]
        while pending:
            one = pending.pop()
            if id(one) in self._watched:
                continue
            self._watched.add(id(one))
            for layout in one.layouts:
                if id(layout) not in self._watched:
                    self._watched.add(id(layout))
                    layout.add_reader(self)
            pending += one.parts


class _Block:
    """Instructions that one call of the kernel executes.

    Attributes:
        step: Executes them; its argument is whether Jacobians are computed. It needs the block to be kept.
    """

    def __init__(self, robot: RobotView | None, dofs: int):
        self._header = np.zeros(1, dtype=PROGRAM)
        self._instructions = np.zeros(4, dtype=INSTRUCTION)
        self._header["dofs"], self._header["instructions"], self._count = dofs, address(self._instructions), 0
        self._arrays: list[Any] = []
        if robot is not None:
            # the arrays are Pinocchio's, and live as long as the kinematics; a State keeps its own
            tree = robot.kinematics.tree
            self._header["joints"], self._header["placements"] = address(tree.jacobian), address(tree.placements)
            self._header["velocity"] = address(tree.velocity)
            self._header["acceleration"] = address(robot.state.acceleration)
            self._arrays += [robot.kinematics, robot.state]
        self.step = partial(run, address(self._header))

    def append(self, instruction: Instruction) -> None:
        """Append an instruction."""
        if self._count == len(self._instructions):
            self._instructions = np.concatenate((self._instructions, np.zeros_like(self._instructions)))
            self._header["instructions"] = address(self._instructions)
        self._instructions[self._count] = instruction.record
        self._arrays.append(instruction.arrays)
        self._count += 1
        self._header["count"] = self._count


class CompiledPoint(Point, abc.ABC):
    """A point that the kernel computes."""

    _program: Program | None = None

    @property
    def is_plain(self) -> bool:
        """Return whether no subclass computes it differently."""
        own = type(self)
        return (
            own.update is CompiledPoint.update
            and own.compute is CompiledPoint.compute
            and own.compute_jacobian is CompiledPoint.compute_jacobian
        )

    @property
    def written_offset(self) -> np.ndarray:
        """The offset that its instructions write, where it is a dynamic point."""
        return NO_NUMBERS

    def compute(self) -> None:
        """Write the value."""
        self.update(jacobian=False)

    def compute_jacobian(self) -> None:
        """Write the value and the Jacobian."""
        self.update()

    def update(self, jacobian: bool = True) -> None:
        """Compute the value, and the Jacobian if `jacobian`, at the state of the last update of the Robot."""
        program = self._program
        if program is None or not program.is_current:
            program = self._program = program or Program()
            program.complete_alone(self)
        for step in program.steps:
            step(jacobian)

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
