"""The time of a cycle, compiled: how much of it passes for the robot, and how far the loop is overloaded."""

from pathlib import Path

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, exact_part
from solfer.plugins.timing import limits
from solfer.plugins.timing.limits import EARLIEST, JUMP, LATEST, LOST, ROWS

LOAD = BlockLayout(
    "Load",
    period=float,
    window=float,
    ratio_limit=float,
    age_limit=float,
    sums=(float, 2),  # time that has passed, and cycles, both with what is forgotten
    accepted=(int, 1),  # messages of the feedback that measures
    figures=(float, 3),
    is_near=(bool, 1),  # whether a limit is exceeded
)
"""What `Overload` counts."""

TIME = BlockLayout("Time", period=float, state=(float, ROWS), load=int)
"""What `RobotTime` remembers, and the address of a `LOAD`; 0: there is none."""

BEFORE, OWED, STAMP, AHEAD, STILL, LOOKED, FOLLOWS = range(1, ROWS)
_load_at = LOAD.at
_time_at = TIME.at


@exact_part
def _add_load(start, passed, accepted):
    """Count a cycle that begins `passed` after the one before, with so many messages `accepted`; -1: none measures."""
    load = _load_at(start)
    figures = load.figures
    # over time, not in each cycle: measurements that come in bunches let the robot's time pass in bunches
    kept = 1.0 / (1.0 + passed / load.window)
    load.sums[0] = kept * load.sums[0] + passed
    load.sums[1] = kept * load.sums[1] + 1.0
    figures[0] = max(1.0 - load.sums[1] * load.period / load.sums[0], 0.0)
    if accepted >= 0:
        figures[1] = figures[1] + passed if accepted == load.accepted[0] else 0.0
        load.accepted[0] = accepted
    load.is_near[0] = figures[0] / load.ratio_limit > 1.0 or figures[1] / load.age_limit > 1.0


def _add(start, passed, accepted):
    """See `_add_load`."""
    _add_load(start, passed, accepted)


@exact_part
def _follow(state, follows):
    """Follow the stamps, or the clock; where this changes, and after each look, the robot is as far as it is."""
    if follows or state[FOLLOWS]:
        state[AHEAD] = state[LOOKED] = 0.0
    state[FOLLOWS] = follows


@exact_part
def _pass_time(period, state, now, stamp):
    """Return how much time passes for the robot; see `RobotTime`."""
    # whole periods: a cycle may begin anywhere in its own, so what is beyond one is owed until it is whole
    owed = max(0.0, state[OWED] + (now - state[BEFORE]) / period - 1.0)
    rounding = 1e-6  # ratio of a period by which a clock's time is rounded
    left_out = int(owed + rounding)
    state[BEFORE] = now
    state[OWED] = max(0.0, owed - left_out)
    by_clock = (1 + left_out) * period
    before = state[STAMP]
    if stamp != stamp:  # nothing is measured
        stamp = before
    progress = 0.0
    if -JUMP < stamp - before <= 0.0:  # nothing new, or what has been overtaken
        state[STILL] += by_clock
    else:
        state[STAMP] = stamp
        state[STILL] = 0.0
        progress = stamp - before
        if before == 0.0 or abs(progress) >= JUMP:  # a clock that was set has moved on as it should
            state[AHEAD] = 0.0
            progress = by_clock
    state[AHEAD] += by_clock - progress
    state[LOST] = 0.0
    if state[STAMP] == 0.0 or state[STILL] > 0.5:  # a stamp that stays for so long [s] is of no clock
        state[AHEAD] = state[FOLLOWS] = 0.0
    if not state[FOLLOWS]:
        if not -EARLIEST <= state[AHEAD] <= LATEST:
            _follow(state, True)
        return by_clock
    state[LOOKED] += by_clock
    # the clock counts again where the robot was no more than 0.02 s slower or faster within a second
    if state[LOOKED] > 1.0:
        _follow(state, abs(state[AHEAD]) > 0.02)
    passed = max(progress, 0.01 * by_clock)  # never nothing, for many divide by it
    state[LOST] = by_clock - passed
    return passed


def _advance(start, now, stamp, accepted):
    """Return how much time passes for the robot, and count the cycle's load."""
    time = _time_at(start)
    passed = _pass_time(time.period, time.state, now, stamp)
    if time.load:
        _add_load(time.load, passed, accepted)
    return passed


add = cached("void(int64, float64, int64)", _add)
advance = cached("float64(int64, float64, float64, int64)", _advance, sources=[Path(limits.__file__)])
