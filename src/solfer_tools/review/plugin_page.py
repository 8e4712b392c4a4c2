"""A page of plots for one plugin: joints measured and desired, their limits and errors, ages, times and logs."""

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from solfer.recording.model import Channel, Recording
from solfer.recording.requests import EventGroup, grouped
from solfer.recording.selection import span
from solfer_tools.review.canvas import (
    COLUMN_WIDTH,
    DESIRED_COLOR,
    FIRST_COLOR,
    FONT_SIZE,
    draw,
    dress,
    is_column,
    legend,
    new_figure,
    time_plots,
)
from solfer_tools.review.tracks import Track, tracks_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

BINS = 400  # of the times of a cycle

MOST_LINES = 12
"""Lines of a plot with one legend."""

Limits = Mapping[str, tuple[float, float]]
"""Least and largest position of each joint that has an end."""


def plugin_page(recording: Recording, plugin: str, limits: Limits, column: bool = False) -> "Figure":
    """Draw the page of one plugin.

    Args:
        recording: The recording.
        plugin: Name of the plugin.
        limits: Limits of the joints' positions.
        column: Whether the page is for a paper's column.
    """
    tracks = tracks_of(recording, plugin)
    # [rad, m, rad/s, m/s]; the others are listed
    moving = [track for track in tracks if track.span > 2e-3]
    start, _ = span(recording)
    extras = _extras(recording, plugin)
    across = (2, 1) if column else (6, 2)  # small plots of joints, and the larger ones
    rows = -(-len(moving) // across[0])
    errors = [track for track in moving if track.desired is not None]
    heights = [
        0.5 + 1.35 * rows,
        1.2 + 0.17 * len(errors),
        0.4 + (2.8 if column else 2.3) * -(-len(extras) // across[1]),
    ]
    used = [height if part else 0.0 for height, part in zip(heights, (moving, errors, extras), strict=True)]
    figure = new_figure(COLUMN_WIDTH if column else 15.0, 0.9 + sum(used))
    groups = grouped(event for event in recording.events if event.plugin in ("", plugin))
    often = [group.counted(start) for group in groups if group.count > 1]
    still = len(tracks) - len(moving)
    rest = f"; {still} of {len(tracks)} joints are at rest and left out" if still else ""
    figure.suptitle("\n".join((f"{plugin}{rest}", *often)), fontsize=FONT_SIZE + (0 if column else 4))
    parts = [part for part in used if part]
    if not parts:
        return figure
    slots = iter(figure.subfigures(len(parts), 1, height_ratios=parts, squeeze=False)[:, 0])
    if moving:
        place = next(slots)
        _joints(place, time_plots(place, len(moving), across[0]), moving, limits=limits, start=start)
    if errors:
        _errors(next(slots), errors, start)
    if extras:
        _draw_extras(time_plots(next(slots), len(extras), across[1]), extras, start, groups=groups, plugin=plugin)
    figure.supxlabel("time [s]", fontsize=FONT_SIZE)
    return figure


def _joints(place: "SubFigure", grid: list["Axes"], tracks: list[Track], limits: Limits, start: float) -> None:
    """Draw one small plot for each joint, all with the same times."""
    for axes, track in zip(grid, tracks, strict=True):
        _joint(axes, track, limits, start=start)
    handles = [
        _line(color=FIRST_COLOR, lw=1.0),
        _line(color=DESIRED_COLOR, lw=2.8),
        _line(color="black", lw=1.0, ls=":"),
    ]
    place.legend(
        handles,
        ["measured", "desired", "limit"],
        loc="outside upper right",
        ncols=3,
        fontsize=FONT_SIZE,
        frameon=False,
    )


def _line(**style: Any) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], **style)


def _joint(axes: "Axes", track: Track, limits: Limits, start: float) -> None:
    if track.desired is not None:  # below and wider: both are seen where they are one
        draw(axes, track.desired.times - start, track.desired.values, color=DESIRED_COLOR, lw=2.8)
    draw(axes, track.measured.times - start, track.measured.values, color=FIRST_COLOR, lw=0.9)
    dress(axes, f"{track.joint}  [{track.unit or '-'}]")
    low, high = axes.get_ylim()
    missing = max(0.0, 0.02 - (high - low))  # so that noise does not look like motion
    low = low - 0.5 * missing
    high = high + 0.5 * missing
    for limit in limits.get(track.joint, ()) if track.field == "position" else ():
        if low - 0.3 * (high - low) <= limit <= high + 0.3 * (high - low):  # near enough to matter
            axes.axhline(limit, color="black", lw=1.0, ls=":")
            low = min(low, limit)
            high = max(high, limit)
    axes.set_ylim(low - 0.02 * (high - low), high + 0.02 * (high - low))


def _errors(place: "SubFigure", tracks: list[Track], start: float) -> None:
    """Draw the errors of all joints as colours: forty lines in one plot could not be distinguished.

    Joints of a kind have one scale, so that the steered wheels of a robot do not hide its arms.
    """
    kinds = [_kind(track) for track in tracks]
    places = {kind: index for index, kind in enumerate(dict.fromkeys(kinds))}
    order = sorted(range(len(tracks)), key=lambda row: places[kinds[row]])
    tracks = [tracks[row] for row in order]
    of_kind = np.array([places[kinds[row]] for row in order])
    times = tracks[0].measured.times
    edges = np.linspace(times[0], times[-1], min(BINS, max(2, len(times) // 2)) + 1)
    errors = np.array([1e3 * _largest(track.measured.times, track.error(), edges) for track in tracks])
    scales = np.array([_scale(errors[of_kind == kind]) for kind in range(len(places))])
    axes = place.subplots()
    image = axes.imshow(
        errors / scales[of_kind, None], aspect="auto", cmap="RdBu_r", vmin=-1.0, vmax=1.0, interpolation="nearest",
        extent=(edges[0] - start, edges[-1] - start, len(tracks) - 0.5, -0.5),
    )  # fmt: skip
    axes.set_yticks(range(len(tracks)), [_with_worst(track, row) for track, row in zip(tracks, errors, strict=True)])
    place.suptitle("desired minus measured; behind each joint its largest", fontsize=FONT_SIZE)
    axes.tick_params(labelsize=FONT_SIZE)
    right = axes.secondary_yaxis("right")
    middles = [float(np.flatnonzero(of_kind == kind).mean()) for kind in places.values()]
    units = [unit for _, unit in places]
    right.set_yticks(
        middles, [f"\N{PLUS-MINUS SIGN}{scale:.3g} {_milli(unit)}" for scale, unit in zip(scales, units, strict=True)]
    )
    right.tick_params(labelsize=FONT_SIZE, length=0)
    for border in np.flatnonzero(np.diff(of_kind)):
        axes.axhline(border + 0.5, color="grey", lw=0.6)
    bar = place.colorbar(image, ax=axes, location="bottom", aspect=20 if is_column(place) else 80, extend="both")
    bar.set_label("part of the scale on the right", fontsize=FONT_SIZE)
    bar.ax.tick_params(labelsize=FONT_SIZE)


def _milli(unit: str) -> str:
    return f"m{unit}" if unit else "1e-3"


def _kind(track: Track) -> tuple[str, str]:
    """Return what joints with one scale have in common: the name without numbers, and the unit."""
    return re.sub(r"\d+", "", track.joint), track.unit


def _scale(errors: np.ndarray) -> float:
    """Return what nearly all errors are below, above zero."""
    return max(1e-9, float(np.nanpercentile(np.abs(errors), 99.5))) if np.isfinite(errors).any() else 1.0


def _with_worst(track: Track, row: np.ndarray) -> str:
    return f"{track.joint}  {np.nanmax(np.abs(row)):.1f}" if np.isfinite(row).any() else track.joint


def _largest(times: np.ndarray, values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the value with the largest size between each two edges; NaN where there is none."""
    bins = np.clip(np.searchsorted(edges, times, "right") - 1, 0, len(edges) - 2)
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0)
    order = np.lexsort((sizes, bins))
    last = np.flatnonzero(np.diff(bins[order], append=-1))
    found = np.full(len(edges) - 1, np.nan)
    found[bins[order][last]] = values[order][last]
    return found


def _extras(recording: Recording, plugin: str) -> list[tuple[str, list[Channel]]]:
    """Return the other plots: a title, and the channels in it."""
    filled = [each for each in recording.filled if each.columns]
    channels = [each for each in filled if each.name.startswith(f"{plugin}/")]
    timing = [each for each in channels if each.name == f"{plugin}/timing"]
    ages = [each for each in channels if each.name.endswith("/age")]
    gates = [each for each in channels if each.name == f"{plugin}/gate" and np.ptp(each.values) > 0.0]
    logs = [each for each in channels if each.name.startswith(f"{plugin}/log/")]
    plots = [("times of the cycle's parts", timing), ("age of the newest message", ages)]
    plots += [("values that the gate held back", gates), *((each.name.split("/", 1)[1], [each]) for each in logs)]
    return [(title, found) for title, found in plots if found]


def _draw_extras(
    grid: list["Axes"], extras: list[tuple[str, list[Channel]]], start: float, groups: list[EventGroup], plugin: str
) -> None:
    for axes, (title, channels) in zip(grid, extras, strict=True):
        if channels[0].name == f"{plugin}/timing":
            _timing(axes, channels[0], start)
        else:
            lines(axes, title, channels, start=start)
        for group in groups:
            for time in {group.first.time, group.last}:
                axes.axvline(time - start, color="grey", lw=0.6, ls=":")


def _timing(axes: "Axes", channel: Channel, start: float) -> None:
    """Draw the median of each part in each moment, and the longest cycle."""
    count = min(BINS, len(channel.times))
    starts = np.unique(np.arange(count) * len(channel.times) // count)
    groups = np.split(np.maximum(1e6 * channel.values, 0.1), starts[1:])
    times = channel.times[starts] - start
    medians = np.array([np.median(group, axis=0) for group in groups])
    for part, values in zip(channel.columns, medians.T, strict=True):
        draw(axes, times, values, lw=1.0, label=part)
    longest = np.array([group.sum(axis=1).max() for group in groups])
    draw(axes, times, longest, color="black", lw=0.8, label="longest cycle")
    axes.set_yscale("log")
    dress(axes, "parts of the cycle: medians", "time [us]")
    legend(axes)


def lines(axes: "Axes", title: str, channels: list[Channel], start: float) -> None:
    """Draw columns of channels as lines, the liveliest ones if there are too many for a legend."""
    found = [
        (_short(each.name) if column == "age" else column, each, place)
        for each in channels
        for place, column in enumerate(each.columns)
    ]
    if len(found) > MOST_LINES:
        found = sorted(found, key=lambda each: -_span(each[1].values[:, each[2]]))[:MOST_LINES]
        title = f"{title}, the {MOST_LINES} that change most"
    for name, channel, place in found:
        draw(axes, channel.times - start, channel.values[:, place], lw=1.0, label=name)
    units = dict.fromkeys(unit for each in channels for unit in each.units if unit)
    dress(axes, title, f"[{', '.join(units)}]" if units else "")
    legend(axes)


def _span(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if finite.size else 0.0


def _short(name: str) -> str:
    """Return the pipe of a channel `<plugin>/feedback/<pipe>/age`."""
    parts = name.split("/")
    return parts[-2] if len(parts) > 2 else name
