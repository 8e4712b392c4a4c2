"""What is published and logged of margins and workspaces."""

import logging
from collections.abc import Sequence

import numpy as np

from solfer.components.support_shaping.governor import SupportGovernor
from solfer.components.support_shaping.tags import SupportShapingTags
from solfer.interfaces.support import SupportMargins
from solfer.throttle import Throttle

log = logging.getLogger(__name__)


class MarginsReport:
    """Publishes what is left of each limit, and warns where that is little.

    Args:
        name: Name of the component.
        links: Links of the wheels.
        governor: Keeps the limits.
        edges: Edges of the polygon, as it has them before `start`.

    Attributes:
        names: Names of the limits.
        ratio: Ratio of the desired velocities with which the motion goes on, shape (1,); live.
        reaction: Velocity of the polygon under a robot that is pushed: x, y in the world, shape (2,) [m/s]; live.
    """

    def __init__(self, name: str, links: Sequence[str], governor: SupportGovernor, edges: Sequence[tuple[int, int]]):
        self._name = name
        self._links = links
        self._governor = governor
        self._throttle = Throttle(log)
        self.ratio = np.ones(1)
        self.reaction = np.zeros(2)
        self.start(edges)

    def start(self, edges: Sequence[tuple[int, int]]) -> None:
        """Begin with edges of the polygon between wheels."""
        margins = (f"margin {self._links[first]}-{self._links[second]}" for first, second in edges)
        self.names = (*margins, *(f"workspace {link}" for link in self._links))
        self._keys = {name: f"lost {name}" for name in self.names}

    def warn(self, tags: SupportShapingTags) -> None:
        """Log which limits cannot be kept, or are near, as the tags have it."""
        governor = self._governor
        for name, reserve, is_lost in zip(
            self.names, governor.reserves.tolist(), governor.infeasible.tolist(), strict=True
        ):
            if is_lost:
                text = "%s: '%s' cannot be kept, %.3f m are missing: the motion %s"
                does = "holds" if tags.infeasible == "hold" else "slows down"
                self._throttle.warning(self._keys[name], text, self._name, name, -reserve, does)
            elif reserve < tags.warn_below:
                self._throttle.warning(name, "%s: %.3f m are left of '%s'", self._name, reserve, name)
        self.ratio[0] = governor.ratio

    def margins(self) -> SupportMargins:
        """Return what is published of the newest cycle."""
        governor = self._governor
        names = np.array(self.names)
        return SupportMargins(
            self.names,
            tuple(governor.limits.ravel().tolist()),
            tuple(governor.reserves.tolist()),
            active=tuple(names[governor.active].tolist()),
            infeasible=tuple(names[governor.infeasible].tolist()),
            share=governor.ratio,
            reaction=tuple(self.reaction.tolist()),
        )
