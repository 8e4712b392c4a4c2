"""Whether the ground can have the forces that are computed: it does not pull, and friction has an end.

Together they carry the robot: M g + sum f_k = M a, and a mean acceleration a of half of g over a second is a change of
5 m/s. Contacts that carry much less, or more, have efforts that are wrong, or the robot hangs or lies.
"""

import logging
from collections.abc import Sequence

import numpy as np

from solfer.components.diagnostics import Entry, Status, Statuses
from solfer.throttle import Throttle

logger = logging.getLogger(__name__)


class ContactChecks:
    """Reports forces of contacts that the ground cannot have, in the mean of many cycles.

    Args:
        names: Names of the contacts k.
        normals: Their normals, world axes, shape (k, 3).
        sums: Sums of the forces since the last report, world axes, shape (k, 3) [N]; live, a report sets them to zero.
        friction: Coefficient of friction of the ground; None: not known.
        weight: Weight of the robot, world axes, shape (3,) [N]; None: contacts do not carry it.

    Attributes:
        friction: As above; may be set.
        count: Cycles whose forces are in the sums.
    """

    def __init__(
        self,
        names: Sequence[str],
        normals: np.ndarray,
        sums: np.ndarray,
        friction: float | None,
        weight: np.ndarray | None = None,
    ):
        self._names = tuple(names)
        self._normals = normals
        self.friction = friction
        self._weight = weight
        self._throttle = Throttle(logger, interval=10.0)
        self._sums = sums
        self.count = 0

    def start(self) -> None:
        """Begin without forces."""
        self._sums[:] = 0.0
        self.count = 0

    def report(self, owner: str) -> Statuses:
        """Return what each contact does in the mean since the last report; `owner` is the name of the component."""
        means = self._sums / max(self.count, 1)
        along = np.sum(means * self._normals, axis=1)
        across = np.linalg.norm(means - along[:, None] * self._normals, axis=1)
        wrong = []
        entries = []
        for name, normal, tangential in zip(self._names, along.tolist(), across.tolist(), strict=True):
            text, finding = self._evaluate(normal, tangential)
            entries.append(Entry(name, text))
            wrong += [f"'{name}' {finding}"] if finding else []
        load = self._evaluate_load(means)
        if load:
            wrong.insert(0, load)
            self._throttle.warning("load", "%s: %s", owner, load)
        summary = "; ".join(wrong) or "all contacts push within the friction of the ground"
        self.start()
        status = Status(int(bool(wrong)), f"{owner}: contacts", summary, hardware_id=owner, values=tuple(entries))
        return Statuses(status=(status,))

    def _evaluate_load(self, means: np.ndarray) -> str:
        """Return what is wrong with the load that the contacts carry together; empty if nothing is."""
        weight = self._weight
        if weight is None or not self.count:
            return ""
        ratio = -float(means.sum(axis=0) @ weight) / float(weight @ weight)
        if 0.5 <= ratio <= 2.0:
            return ""
        return f"contacts carry {ratio:.2g} of the robot's weight by the joints' efforts: wrong, or it is lifted"

    def _evaluate(self, normal: float, tangential: float) -> tuple[str, str]:
        """Return what a contact does, and what is wrong with that, empty if nothing is; forces in [N]."""
        noise = 5.0  # [N]
        if normal < -noise:
            return f"pulls with {-normal:.1f} N", "pulls, which the ground cannot do"
        if normal <= noise:
            return "does not press", ""
        ratio = tangential / normal
        text = f"presses with {normal:.1f} N, {ratio:.2f} of that along the ground"
        if self.friction is None or ratio <= self.friction:
            return text, ""
        return text, f"needs a friction of {ratio:.2f}, the ground has {self.friction:g}"
