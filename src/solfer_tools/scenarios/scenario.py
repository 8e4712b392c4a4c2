"""A scenario: the content of a file, with all numbers as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from solfer_tools.scenarios.records import FootprintRecord, ScenarioRecord, Step


@dataclass(frozen=True)
class Scenario:
    """A motion of base and vertices, as a file describes it.

    The file's frame has its x and y where the base begins: x forward. The vertices of the support polygon are seen
    from the base's heading: x and y from the base, z as the file has it.

    Attributes:
        file: Path of the file; empty if there is none.
        record: Begin, tables and speeds.
        pattern: The steps, of which the first is number 1.
        periods: How many periods each step takes.
    """

    file: str
    record: ScenarioRecord
    pattern: tuple[Step, ...]
    periods: tuple[int, ...] = field(default=())

    @property
    def period(self) -> float:
        """Time between two steps of the player [s]."""
        return self.record.dt

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.record.x_cp)

    @property
    def base(self) -> np.ndarray:
        """Where the base begins, shape (4,): x, y, z [m], heading [rad]."""
        return np.array(self.record.base_now)

    @property
    def constant(self) -> np.ndarray:
        """Velocity that is added to the base's until the end, shape (4,) [m/s, rad/s]."""
        return np.array(self.record.base_const_vel)

    @property
    def vertices(self) -> np.ndarray:
        """Where the vertices begin, shape (n, 3) [m]."""
        return _columns(self.record.x_cp, self.record.y_cp, self.record.z_cp)

    def goals(self, step: FootprintRecord) -> np.ndarray:
        """Return where a step moves the vertices, shape (n, 3) [m]."""
        record = self.record
        return _columns(record.x_cp_ref[step.x_cp], record.y_cp_ref[step.y_cp], record.z_cp_ref[step.z_cp])

    @property
    def is_absolute(self) -> bool:
        """Whether the file has the begins of base and vertices; else all of it is relative to where they are."""
        return bool(self.base.any() or self.vertices.any())

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return sum(self.periods) * self.period

    def __repr__(self) -> str:
        return f"Scenario({self.file}: {self.legs} legs, {len(self.pattern)} steps, {self.duration:.2f} s)"


def _columns(x: Sequence[float], y: Sequence[float], z: Sequence[float]) -> np.ndarray:
    return np.array((x, y, z), dtype=float).T.copy()
