"""A page of plots for one plugin: joints measured and desired, their limits and errors, ages, times and logs."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from solfer.recording.model import Channel, Recording
from solfer.recording.requests import EventGroup, grouped
from solfer.recording.selection import span
from solfer_tools.review.canvas import (
    DESIRED_COLOR,
    FIRST_COLOR,
    FONT_SIZE,
    WRONG_COLOR,
    draw,
    dress,
    new_figure,
)
from solfer_tools.review.tracks import Track, tracks_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

PLOT_COLUMNS = 6  # of small plots
BINS = 400  # of the times of a cycle

Limits = Mapping[str, tuple[float, float]]
"""Least and largest position of each joint that has an end."""


def plugin_page(recording: Recording, plugin: str, limits: Limits) -> "Figure":
    """Draw the page of one plugin.

    Args:
        recording: The recording.
        plugin: Name of the plugin.
        limits: Limits of the joints' positions.
    """
    tracks = tracks_of(recording, plugin)
    # [rad, m, rad/s, m/s]; the others are listed
    moving = [track for track in tracks if track.span > 2e-3]
    start, _ = span(recording)
    extras = _extras(recording, plugin)
    rows = -(-len(moving) // PLOT_COLUMNS)
    errors = [track for track in moving if track.desired is not None]
    heights = [0.5 + 1.35 * rows, 1.2 + 0.17 * len(errors), 0.4 + 2.3 * -(-len(extras) // 2)]
    used = [height if part else 0.0 for height, part in zip(heights, (moving, errors, extras), strict=True)]
    figure = new_figure(15.0, 0.9 + sum(used))
    groups = grouped(event for event in recording.events if event.plugin in ("", plugin))
    often = [group.counted(start) for group in groups if group.count > 1]
    still = len(tracks) - len(moving)
    rest = f"; {still} of {len(tracks)} joints are at rest and left out" if still else ""
    figure.suptitle("\n".join((f"{plugin}{rest}", *often)), fontsize=FONT_SIZE + 4)
    parts = [part for part in used if part]
    if not parts:
        return figure
    slots = iter(figure.subfigures(len(parts), 1, height_ratios=parts, squeeze=False)[:, 0])
    if moving:
        _joints(next(slots), moving, limits, start=start)
    if errors:
        _errors(next(slots), errors, start)
    if extras:
        _draw_extras(next(slots), extras, start, groups=groups, plugin=plugin)
    return figure


def _joints(place: "SubFigure", tracks: list[Track], limits: Limits, start: float) -> None:
    """Draw one small plot for each joint, all with the same times."""
    rows = -(-len(tracks) // PLOT_COLUMNS)
    grid = place.subplots(rows, PLOT_COLUMNS, sharex=True, squeeze=False).ravel()
    for axes in grid[len(tracks) :]:
        axes.set_visible(False)
    for index, (axes, track) in enumerate(zip(grid, tracks, strict=False)):
        _joint(axes, track, limits, start=start)
        axes.tick_params(labelbottom=index + PLOT_COLUMNS >= len(tracks))
    place.supxlabel("time [s]", fontsize=FONT_SIZE)
    handles = [
        _line(color=FIRST_COLOR, lw=1.0),
        _line(color=DESIRED_COLOR, lw=2.8),
        _line(color=WRONG_COLOR, lw=1.3, ls=":"),
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
            axes.axhline(limit, color=WRONG_COLOR, lw=1.3, ls=":")
            low = min(low, limit)
            high = max(high, limit)
    axes.set_ylim(low - 0.02 * (high - low), high + 0.02 * (high - low))


def _errors(place: "SubFigure", tracks: list[Track], start: float) -> None:
    """Draw the errors of all joints as colours: forty lines in one plot could not be distinguished.

    Colours are parts of the largest error of the same unit: wheels, of which velocities are compared, hide no joint.
    """
    times = tracks[0].measured.times
    edges = np.linspace(times[0], times[-1], min(BINS, max(2, len(times) // 2)) + 1)
    colours = np.array([1e3 * _largest(track.measured.times, track.error(), edges) for track in tracks])
    units = np.array([track.unit for track in tracks])
    scales = np.array([_scale(colours[units == unit]) for unit in units])
    axes = place.subplots()
    image = axes.imshow(
        colours / scales[:, None], aspect="auto", cmap="RdBu_r", vmin=-1.0, vmax=1.0, interpolation="nearest",
        extent=(edges[0] - start, edges[-1] - start, len(tracks) - 0.5, -0.5),
    )  # fmt: skip
    axes.set_yticks(range(len(tracks)), [_with_worst(track, row) for track, row in zip(tracks, colours, strict=True)])
    title = (
        "desired minus measured, the largest of each moment; behind each joint its largest [mrad, mm; of wheels mrad/s]"
    )
    axes.set_title(title, loc="left", fontsize=FONT_SIZE + 1)
    axes.set_xlabel("time [s]", fontsize=FONT_SIZE)
    axes.tick_params(labelsize=FONT_SIZE - 1)
    bar = place.colorbar(image, ax=axes, pad=0.01, extend="both")
    bar.set_label("part of the largest of this unit", fontsize=FONT_SIZE)
    bar.ax.tick_params(labelsize=FONT_SIZE - 1)


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
    place: "SubFigure", extras: list[tuple[str, list[Channel]]], start: float, groups: list[EventGroup], plugin: str
) -> None:
    grid = place.subplots(-(-len(extras) // 2), 2, sharex=True, squeeze=False).ravel()
    for axes, (title, channels) in zip(grid, extras, strict=False):
        if channels[0].name == f"{plugin}/timing":
            _timing(axes, channels[0], start)
        else:
            lines(axes, title, channels, start=start)
        axes.set_xlabel("time [s]", fontsize=FONT_SIZE)
        for group in groups:
            for time in {group.first.time, group.last}:
                axes.axvline(time - start, color="grey", lw=0.6, ls=":")
    for axes in grid[len(extras) :]:
        axes.set_visible(False)


def _timing(axes: "Axes", channel: Channel, start: float) -> None:
    """Draw the median of each part in each moment, and the longest cycle."""
    count = min(BINS, len(channel.times))
    starts = np.unique(np.arange(count) * len(channel.times) // count)
    groups = np.split(np.maximum(1e6 * channel.values, 0.1), starts[1:])
    times = channel.times[starts] - start
    medians = np.array([np.median(group, axis=0) for group in groups])
    for part, values in zip(channel.columns, medians.T, strict=True):
        axes.plot(times, values, lw=1.0, label=part)
    axes.plot(times, [group.sum(axis=1).max() for group in groups], color="black", lw=0.8, label="longest cycle")
    axes.set_yscale("log")
    dress(axes, "times of the cycle's parts: medians, and the longest cycle", "time [us]")
    _legend(axes)


def lines(axes: "Axes", title: str, channels: list[Channel], start: float) -> None:
    """Draw columns of channels as lines, the liveliest ones if there are too many for a legend."""
    found = [
        (_short(each.name) if column == "age" else column, each, place)
        for each in channels
        for place, column in enumerate(each.columns)
    ]
    most = 12  # with one legend
    if len(found) > most:
        found = sorted(found, key=lambda each: -_span(each[1].values[:, each[2]]))[:most]
        title = f"{title} (those {most} that change most)"
    for name, channel, place in found:
        draw(axes, channel.times - start, channel.values[:, place], lw=1.0, label=name)
    units = dict.fromkeys(unit for each in channels for unit in each.units if unit)
    dress(axes, title, f"[{', '.join(units)}]" if units else "")
    _legend(axes)


def _span(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if finite.size else 0.0


def _short(name: str) -> str:
    """Return the pipe of a channel `<plugin>/feedback/<pipe>/age`."""
    parts = name.split("/")
    return parts[-2] if len(parts) > 2 else name


def _legend(axes: "Axes") -> None:
    axes.legend(fontsize=FONT_SIZE - 1, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
