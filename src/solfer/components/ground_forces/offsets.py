"""What torque sensors show where there is no torque, from the forces that nothing else explains."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from solfer.components.ground_forces import kernel
from solfer.components.ground_forces.tags import OffsetTags
from solfer.components.ground_forces.weighted_forces import PRIOR_INFORMATION, weighed
from solfer.numerics.blocks import MemoryBlock
from solfer.points.contact.contacts import Contact


class TorqueOffsets:
    """Offsets of the torque sensors of the joints that carry a robot.

    What the world seems to do along the DoFs is w = J^T f + E p - e, with any forces f at the contacts J that touch, a
    push p on the base (the first six DoFs, E) and the offsets e of the joints. What is left of w behind the forces
    that explain it best gives e by least squares, beside what is known of each offset before, its deviation. A leg in
    the air gives all of its joints. On legs that carry, three numbers of each leg, and while nothing pushes the base
    the six that it is at rest. What is known fades with time, since offsets drift.

    Args:
        contacts: The contacts, k of them.
        deviations: Deviations of the torques, shape (n,) [N, Nm]; of a base that nothing pushes as `tags` have it.
        tags: The others.
        base: Whether the first six DoFs are those of a floating base.

    Attributes:
        value: The offsets, shape (n,), zero where none is estimated [Nm, N]; live.
        update: update(jacobian, world, lifted, pushed) learns from a cycle. It takes the Jacobian of the contacts,
            shape (3k, n); what the world seems to do along the DoFs by the torques as they are measured, shape (n,);
            which contacts are in the air for sure, shape (k,); and whether something pushes the base.
    """

    def __init__(self, contacts: Sequence[Contact], deviations: np.ndarray, tags: OffsetTags, base: bool):
        rows = 3 * len(contacts)
        size = len(deviations)
        self._tags = tags
        calm = deviations**-2
        pushed = calm.copy()
        if base:
            calm[:6] = tags.push**-2
            pushed[:6] = 0.0
        columns = weighed(contacts, deviations**-2)
        first = int(np.count_nonzero(columns < 6)) if base else 0
        count = len(columns) - first
        self.value = np.zeros(size)
        self._block = MemoryBlock(
            kernel.OFFSETS,
            row_count=rows,
            dofs=size,
            calm=calm,
            pushed=pushed,
            jacobian=np.zeros((rows, size)),
            column_count=len(columns),
            columns=columns,
            first=first,
            diagonal=PRIOR_INFORMATION,
            size=count,
            information=np.zeros((count, count)),
            moments=np.zeros(count),
            offsets=np.zeros(count),
            value=self.value,
            factor=np.zeros((rows, rows)),
            spread=np.zeros((rows, count)),
            needed=np.zeros(rows),
            solved=np.zeros((count, count)),
        )
        self.update = partial(kernel.learn, self._block.address)

    def start(self, period: float) -> None:
        """Begin with cycles of `period` [s]; what is known stays."""
        record = self._block.record
        record["fraction"] = period / self._tags.interval
        record["decay"] = period / self._tags.memory
        record["prior"] = self._tags.deviation**-2
