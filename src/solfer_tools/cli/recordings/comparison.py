"""The text of a comparison."""

from collections.abc import Iterator

import numpy as np

from solfer.cli.columns import aligned
from solfer_tools.review import Comparison, JointVerdict


def report(result: Comparison, names: tuple[str, str], limits: bool = False) -> Iterator[str]:
    """Yield the lines of a comparison.

    Args:
        result: What was found out.
        names: The files.
        limits: Whether to list what would have been found.
    """
    span = result.times[-1] - result.times[0]
    yield f"{len(result.joints)} joints compared over {span:.2f} s; clock of {names[1]}: {result.shift:+.4f} s"
    yield from _differences(result)
    if result.hardly_moving:
        yield "hardly move, so that only an offset would have been found: " + ", ".join(result.hardly_moving)
    if limits:
        yield "found would have been, from:"
        yield from aligned(_limits(result), "  ")


def _differences(result: Comparison) -> Iterator[str]:
    if not result.different:
        yield "no joint differs"
        return
    first = result.different[0]
    since = "" if np.isnan(first.since) else f" at {first.since:.3f} s"
    yield f"differs first: {first.joint}{since}: {first.text}"
    head = ("joint", "since [s]", "largest [rad, m]", "how")
    yield from aligned([head, *(_row(each) for each in result.different)], "  ")


def _row(verdict: JointVerdict) -> tuple[str, ...]:
    if np.isnan(verdict.since):
        return verdict.joint, "-", "-", verdict.text
    return verdict.joint, f"{verdict.since:.3f}", f"{verdict.largest:.4f}", verdict.text


def _limits(result: Comparison) -> Iterator[tuple[str, ...]]:
    yield "joint", "gain", "offset [rad, m]", "delay [ms]"
    for verdict in result.verdicts:
        if verdict.limits is not None:
            gain, offset, delay = verdict.limits
            yield verdict.joint, _number(gain, 3), _number(offset, 4), _number(1e3 * delay, 1)


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"
