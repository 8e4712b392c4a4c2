"""What a scenario does, step by step."""

from collections.abc import Iterator

import numpy as np

from solfer_tools.scenarios import Player, Scenario


class ScenarioTrace:
    """A scenario, played to its end.

    Args:
        scenario: The scenario.

    Attributes:
        scenario: The scenario.
        base: Base with the constant velocity, at the begin and at the end of each period, shape (T + 1, 4) [m, rad].
        vertices: Vertices seen from the base, shape (T + 1, n, 3) [m].
    """

    def __init__(self, scenario: Scenario):
        player = Player(scenario)
        self.scenario = scenario
        base = [scenario.base]
        vertices = [scenario.vertices]
        while player.step():
            base.append(base[-1] + player.base_velocity * scenario.period)
            vertices.append(player.vertices.copy())
        self.base = np.array(base)
        self.vertices = np.array(vertices)

    @property
    def times(self) -> np.ndarray:
        """Begin, and the end of each period, shape (T + 1,) [s]."""
        return np.arange(len(self.base)) * self.scenario.period

    @property
    def distance(self) -> np.ndarray:
        """Path length of the base on the ground, shape (T + 1,) [m]."""
        steps = np.linalg.norm(np.diff(self.base[:, :2], axis=0), axis=1)
        return np.concatenate(([0.0], np.cumsum(steps)))

    def rows(self) -> Iterator[tuple[str, ...]]:
        """Yield the head, and a row for each step: what it is, where the base is at its end, and how far all moves."""
        yield ("step", "verb", "begin s", "takes s", "x m", "y m", "z m", "heading rad", "way m", "vertices m")
        begin = 0
        distance = self.distance
        for number, (step, count) in enumerate(zip(self.scenario.pattern, self.scenario.periods, strict=True), 1):
            end = begin + count
            moved = np.linalg.norm(self.vertices[end] - self.vertices[begin], axis=1).max()
            numbers = (*self.base[end], distance[end] - distance[begin], moved)
            times = (begin * self.scenario.period, count * self.scenario.period)
            yield (str(number), step.type, *(f"{each:.2f}" for each in times), *(f"{each:.3f}" for each in numbers))
            begin = end

    def summary(self) -> str:
        """Sum it up in one line."""
        scenario = self.scenario
        kind = "absolute" if scenario.is_absolute else "relative"
        return (
            f"{len(scenario.pattern)} steps, {scenario.duration:.2f} s, {self.distance[-1]:.3f} m; "
            f"{scenario.legs} legs, {kind}, period {scenario.period:g} s"
        )
