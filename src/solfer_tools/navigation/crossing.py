"""Plans how a robot on steered wheels crosses steps and gaps: where it rolls, and which wheel steps when.

Each wheel keeps its own straight track. Where the heights of a track change too much to be rolled over, the wheel has
to step: it is brought near to the base, the base goes on until the wheel stands before the obstacle, and the wheel
steps behind it. Two wheels of an axle cannot do that at the same place, since the other one has to stand far out for
the balance; so the robot goes obliquely, and one of them comes first.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from solfer.errors import ComponentError
from solfer.numerics.planar_move import turned
from solfer_tools.navigation.terrain import Terrain

SPACING = 0.01
"""Distance between two heights of a track [m]."""


@dataclass(frozen=True)
class CrossingLimits:
    """What wheels can do; the defaults are those of CENTAURO.

    Attributes:
        rolled: Largest change of the height within 5 cm that wheels roll over [m].
        rise: Largest height of a step, up or down [m].
        spread: Largest difference of the heights of two wheels [m].
        gap: Distance of a wheel from an obstacle before it steps [m].
        landing: Distance from it behind [m].
        near: Least distance of other wheels from an obstacle [m].
        front: How far front wheels may be ahead of where they were at the beginning, as seen from the base [m].
        front_down: The same of those that step down: legs of a robot that stands higher do not reach as far [m].
        rear: The same of rear wheels [m].
        wheel: Radius of a wheel [m].
        beside: How far the wheel beside one that steps may be from where it was at the beginning [m].
        across: Range in which wheels at the other end of the robot are then [m].
        clearance: Height of a wheel above an obstacle [m].
        width: Half of the width of a track [m].
        yaw: Largest angle between heading and path [rad].
    """

    rolled: float = 0.02
    rise: float = 0.15
    spread: float = 0.25
    gap: float = 0.1
    landing: float = 0.09
    near: float = 0.1
    front: tuple[float, float] = (-0.2, 0.03)
    front_down: tuple[float, float] = (-0.28, -0.05)
    rear: tuple[float, float] = (-0.03, 0.2)
    wheel: float = 0.08
    beside: float = 0.05
    across: tuple[float, float] = (-0.2, 0.12)
    clearance: float = 0.02
    width: float = 0.03
    yaw: float = 0.56


@dataclass(frozen=True)
class Obstacle:
    """What a wheel cannot roll over.

    Attributes:
        begin, end: Where it is on the track of the wheel [m].
        rise: How much higher the ground is behind it [m].
    """

    begin: float
    end: float
    rise: float


@dataclass(frozen=True)
class Roll:
    """A move of base and wheels on the ground.

    Attributes:
        along: Where the base is at its end, from the beginning of the path [m].
        offsets: How far each wheel is then ahead of where it was at the beginning, as seen from the base [m].
    """

    along: float
    offsets: tuple[float, ...]


@dataclass(frozen=True)
class StepOver:
    """A step of a wheel.

    Attributes:
        wheel: Its index.
        begin: Where it stands before, ahead of where the base began [m].
        end: Where it stands behind [m].
        rise: How much higher that is [m].
    """

    wheel: int
    begin: float
    end: float
    rise: float


@dataclass(frozen=True)
class Crossing:
    """A plan.

    Attributes:
        yaw: Heading of the base, as seen from the path [rad].
        moves: What is done, in order.
    """

    yaw: float
    moves: tuple[Roll | StepOver, ...]


class _Blocked(ComponentError):
    """A path that ends too early.

    Attributes:
        along: How far the base comes [m].
    """

    def __init__(self, along: float, what: str, expected: str):
        super().__init__(what, expected=expected)
        self.along = along


class _Track:
    """The track of a wheel. Places on it are distances ahead of where the base begins.

    Args:
        index: Index of the wheel.
        name: Its name.
        begin: Where the base begins, x and y [m].
        direction: Direction of the path [rad].
        wheel: Where the wheel begins, ahead of the base and to its left, as seen from the path [m].
        is_front: Whether it is a front wheel.

    Attributes:
        index, name: As above.
        nominal: Where the wheel begins [m].
        is_front: As above.
        behind: How far back it may roll [m].
        next: The next obstacle; None: there is none.
    """

    def __init__(
        self,
        index: int,
        name: str,
        begin: tuple[float, float],
        *,
        direction: float,
        wheel: tuple[float, float],
        is_front: bool,
        limits: CrossingLimits,
    ):
        self.index = index
        self.name = name
        self.nominal, self._left = wheel
        self.is_front = is_front
        self._begin = begin
        self._direction = direction
        self._limits = limits
        self.behind = -math.inf
        self._obstacles: Iterator[Obstacle] = iter(())
        self.next: Obstacle | None = None

    def find_obstacles(self, terrain: Terrain, length: float) -> None:
        """Find the obstacles of a path of a length [m]."""
        limits = self._limits
        first = self.nominal - 0.3
        places = np.arange(first, self.nominal + length + 1.0, SPACING)
        sides = [terrain.heights(self._points(places, side)) for side in (0.0, limits.width, -limits.width)]
        obstacles = []
        for begin, end in _merged(
            _rough(np.array(sides), limits.rolled), round((limits.landing + limits.gap) / SPACING)
        ):
            if places[end] < self.nominal:
                continue
            before, behind = np.clip(
                (begin - round(limits.gap / SPACING), end + round(limits.landing / SPACING)), 0, len(places) - 1
            )
            rise = float(sides[0][behind] - sides[0][before])
            obstacles.append(Obstacle(float(places[begin]), float(places[end]), rise))
        self._obstacles = iter(obstacles)
        self.next = next(self._obstacles, None)

    def _points(self, places: np.ndarray, side: float) -> np.ndarray:
        """Return places in the world, some distance to the left of the track [m], x and y, shape (n, 2)."""
        seen = np.column_stack((places, np.full(len(places), self._left + side)))
        cosine, sine = turned(self._direction, 1.0, 0.0)
        return seen @ np.array(((cosine, sine), (-sine, cosine))) + self._begin

    def where(self) -> str:
        """Name the wheel and its next obstacle."""
        assert self.next is not None
        (x, y), *_ = self._points(np.array([self.next.begin]), 0.0).tolist()
        return f"'{self.name}' at x {x:.2f}, y {y:.2f} m"

    def range(self) -> tuple[float, float]:
        """Return the range of its offsets before and behind its next obstacle [m]."""
        assert self.next is not None
        limits = self._limits
        if not self.is_front:
            return limits.rear
        return limits.front_down if self.next.rise < 0.0 else limits.front

    def stand(self) -> float:
        """Return where the base is when the wheel steps over its next obstacle [m]."""
        assert self.next is not None
        return self.next.end + self._limits.landing - self.nominal - self.range()[1]

    @property
    def furthest(self) -> float:
        """How far the wheel may roll [m]."""
        return math.inf if self.next is None else self.next.begin - self._limits.near

    def step(self) -> StepOver:
        """Step over the next obstacle."""
        obstacle = self.next
        assert obstacle is not None
        self.behind = obstacle.end + self._limits.landing
        self.next = next(self._obstacles, None)
        return StepOver(self.index, obstacle.begin - self._limits.gap, self.behind, obstacle.rise)


class CrossingPlanner:
    """Plans a straight path.

    Args:
        terrain: The ground.
        names: Names of the wheels.
        wheels: Where they are seen from the heading of the base, x and y, shape (n, 2) [m].
        limits: What they can do.
    """

    def __init__(self, terrain: Terrain, names: Sequence[str], wheels: np.ndarray, limits: CrossingLimits):
        self._terrain = terrain
        self._names = tuple(names)
        self._wheels = np.array(wheels, dtype=float)
        self._limits = limits

    def plan(self, begin: tuple[float, float], goal: tuple[float, float], heading: float = 0.0) -> Crossing:
        """Plan a path with the least angle between it and the base.

        Args:
            begin: Where the base is, x and y [m].
            goal: Where it goes.
            heading: Its heading [rad].

        Raises:
            ComponentError: The ground cannot be crossed; names the wheel and the place that ends the path which comes
                farthest.
        """
        direction = math.atan2(goal[1] - begin[1], goal[0] - begin[0])
        turn = 0.07  # [rad] between two headings that are tried
        angles = np.arange(turn, self._limits.yaw, turn)
        reason: _Blocked | None = None
        for yaw in (0.0, *np.column_stack((angles, -angles)).ravel().tolist()):
            try:
                self._require_even(begin, heading, math.remainder(direction + yaw - heading, math.tau))
                return Crossing(yaw, tuple(self._moves(begin, goal, yaw)))
            except _Blocked as error:
                if reason is None or error.along > reason.along:
                    reason = error
        assert reason is not None
        raise reason

    def _require_even(self, begin: tuple[float, float], heading: float, turn: float) -> None:
        """Check that wheels stand on even ground, and roll on it while the base turns in place by an angle [rad]."""
        sides = np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
        around = self._limits.wheel * np.array([0.0 * sides, 0.5 * sides, sides])
        for angle in np.linspace(0.0, turn, 2 + int(abs(turn) / 0.02)).tolist():
            for name, wheel in zip(self._names, self._wheels.tolist(), strict=True):
                place = np.add(begin, turned(heading + angle, *wheel))
                heights = self._terrain.heights((place + around).reshape(-1, 2)).reshape(3, 4)
                if not np.abs(np.diff(heights, axis=0)).max() <= self._limits.rolled:
                    what = (
                        f"'{name}' stands on an edge"
                        if angle == 0.0
                        else f"'{name}' comes to an edge as the base turns"
                    )
                    raise _Blocked(-1.0, what, "wheels on even ground")

    def _moves(self, begin: tuple[float, float], goal: tuple[float, float], yaw: float) -> Iterator[Roll | StepOver]:
        """Plan the moves with a heading as seen from the path [rad]."""
        length = math.dist(begin, goal)
        direction = math.atan2(goal[1] - begin[1], goal[0] - begin[0])
        tracks = []
        for index, (name, wheel) in enumerate(zip(self._names, self._wheels.tolist(), strict=True)):
            track = _Track(
                index,
                name,
                begin,
                direction=direction,
                wheel=turned(yaw, *wheel),
                is_front=wheel[0] > 0.0,
                limits=self._limits,
            )
            track.find_obstacles(self._terrain, length)
            tracks.append(track)
        state = Roll(0.0, (0.0,) * len(tracks))
        while True:
            steps = [track for track in tracks if self._has_to_step(track, length)]
            stepping = min(steps, key=_Track.stand, default=None)
            base = length if stepping is None else stepping.stand()
            rolls = list(self._rolls(tracks, state, base, stepping))
            yield from rolls
            state = rolls[-1] if rolls else state
            if stepping is None:
                return
            step = stepping.step()
            yield step
            offsets = list(state.offsets)
            offsets[step.wheel] = step.end - base - stepping.nominal
            state = Roll(base, tuple(offsets))

    def _has_to_step(self, track: _Track, length: float) -> bool:
        return track.next is not None and track.next.begin - self._limits.near < length + track.nominal

    def _require_step(self, track: _Track, base: float) -> None:
        """Check that a wheel can step over its next obstacle."""
        limits = self._limits
        obstacle = track.next
        assert obstacle is not None
        length = obstacle.end - obstacle.begin + limits.gap + limits.landing
        nearest, furthest = track.range()
        longest = furthest - nearest
        if length > longest + 1e-6:
            raise _Blocked(base, f"{track.where()} has to step by {length:.2f} m", f"up to {longest:.2f} m")
        if not abs(obstacle.rise) <= limits.rise:
            raise _Blocked(base, f"{track.where()} has to step {obstacle.rise:.2f} m up", f"up to {limits.rise:.2f} m")

    def _rolls(self, tracks: Sequence[_Track], state: Roll, base: float, stepping: _Track | None) -> Iterator[Roll]:
        """Let the base roll to a place; one wheel stands before its obstacle then, others nearly as at the beginning.

        Wheels that go back do so before the base moves, if they may: they lag behind what is desired of them, and would
        come too near to what is ahead. One that has just stepped stays while the base goes on.
        """
        if stepping is not None:
            if base < state.along - 1e-6:
                raise _Blocked(state.along, f"{stepping.where()} has to step while another one does", "a wider ground")
            self._require_step(stepping, base)
        offsets = [self._offset(track, base, stepping) for track in tracks]
        early = [
            after if after < before and state.along + track.nominal + after >= track.behind else before
            for track, before, after in zip(tracks, state.offsets, offsets, strict=True)
        ]
        for track, offset in zip(tracks, early, strict=True):
            if base + track.nominal + offset > track.furthest + 1e-6 and track is not stepping:
                what = f"'{track.name}' comes too near to {track.where()}"
                raise _Blocked(state.along, what, "a ground with more room between its edges")
        for roll in (Roll(state.along, tuple(early)), Roll(base, tuple(offsets))):
            if np.abs(np.subtract((roll.along, *roll.offsets), (state.along, *state.offsets))).max() > 1e-3:
                state = roll
                yield roll

    def _offset(self, track: _Track, base: float, stepping: _Track | None) -> float:
        """Return the offset of a wheel when the base is at a place and one wheel steps [m]."""
        limits = self._limits
        if track is stepping and track.next is not None:
            return track.next.begin - limits.gap - base - track.nominal
        place = base + track.nominal
        offset = min(max(place, track.behind), track.furthest) - place
        if stepping is not None:
            is_beside = track.is_front == stepping.is_front
            least, most = (-limits.beside, limits.beside) if is_beside else limits.across
            if not least <= offset <= most:
                what = f"'{track.name}' stands {offset:.2f} m from its place while {stepping.where()} steps"
                raise _Blocked(base, what, f"{least:.2f} to {most:.2f} m")
        return offset


def _rough(heights: np.ndarray, rolled: float) -> np.ndarray:
    """Find where ground cannot be rolled on.

    Args:
        heights: Heights of lines side by side, shape (k, n) [m].
        rolled: Largest change within 5 cm, and between lines [m].

    Returns:
        Shape (n,).
    """
    window = 5
    with np.errstate(invalid="ignore"):  # beside a hole: infinity less infinity
        is_steep = ~(np.abs(heights[:, window:] - heights[:, :-window]) <= rolled)
        is_rough = ~(np.ptp(heights, axis=0) <= rolled)
    for line in is_steep:
        edges = np.flatnonzero(np.diff(np.concatenate(([0], line.astype(int), [0]))))
        for begin, end in edges.reshape(-1, 2).tolist():
            # a single edge is in the last interval of the first window that has it, and in the first of the last one
            ends = sorted((begin + window - 1, end))
            is_rough[ends[0] : ends[1] + 1] = True
    return is_rough


def _merged(is_rough: np.ndarray, room: int) -> list[tuple[int, int]]:
    """Return first and last index of each rough part; parts with less room between them are one."""
    merged: list[tuple[int, int]] = []
    for index in np.flatnonzero(is_rough).tolist():
        if merged and index - merged[-1][1] < room:
            merged[-1] = merged[-1][0], index
        else:
            merged.append((index, index))
    return merged
