"""How fast directions turn that are wanted of the vertices of `wheeled_motion`, in plain Python, for comparison."""

import cmath


class SlowTurns:
    """Rates of the directions of vertices, of which opposite ones are the same.

    Args:
        component: The component.
    """

    def __init__(self, component):
        self._component = component
        self.start()

    def start(self):
        """Begin at rest."""
        self._before = [None] * len(self._component.references.lifted)

    def update(self):
        """Return the rates of this cycle [rad/s]; those of vertices that were or are at rest, or lifted, are zero."""
        component, offsets = self._component, self._component._offsets
        references, found = component.references, []
        if not component.tags.gain_across:
            return [0.0] * len(self._before)
        pose = complex(*component._pose.value[:2].tolist())
        tracked = complex(*component._points["base"].value[3:5].tolist())
        center = tracked if component.tags.base == "center_of_mass" else pose
        away, share = cmath.rect(1.0, -offsets.heading), 0.0 if references.waits else references.limits
        for index, lifted in enumerate(references.lifted.tolist()):
            place = complex(*offsets.states[index, :2].tolist()) - away * (center - pose)
            wanted = away * complex(*references.velocity[:2].tolist()) + 1j * references.turn[2] * place
            wanted = share * (wanted + complex(*references.vertex_velocity[index, :2].tolist()))
            before, self._before[index] = self._before[index], wanted or None
            still = lifted or not wanted or before is None
            found.append(0.0 if still else cmath.phase((wanted / before) ** 2) / 2.0 / component.period)
        return found
