"""Figures and plots of a recording."""

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from solfer.transport.middleware import HealthReport
from solfer_tools.demo.record import MotionRecorder, Trace
from solfer_tools.review import COLORS, FONT_SIZE, draw, dress, legend, new_figure, save, time_plots

Row = tuple[str, str]
"""Name of a quantity, and its figure with unit."""

LAYER = "xbotcore"
"""Name of the report of a real-time layer."""


def joint_error(measured: Trace, desired: Trace, joints: Collection[str]) -> tuple[float, str]:
    """Find the largest difference of a measured position from the one desired at the same time [rad], and its joint.

    Args:
        measured: Measured positions.
        desired: Desired positions.
        joints: Joints to compare.
    """
    times = np.clip(measured.time, desired.time[0], desired.time[-1])
    worst = 0.0
    joint = ""
    for name in (name for name in desired.names if name in joints):
        goal = np.interp(times, desired.time, desired.column(name, "position"))
        after = measured.time >= desired.time[0]
        error = np.abs(measured.column(name, "position") - goal)[after].max(initial=0.0)
        if error > worst:
            worst = float(error)
            joint = name
    return worst, joint


def table(
    recorder: MotionRecorder,
    parts: Mapping[str, Collection[str]],
    reports: Mapping[str, HealthReport],
    plugin: str,
    simulator: str,
) -> list[Row]:
    """Build the closing table of the demonstration.

    Args:
        recorder: The recording; the base is expected to come back to where it started.
        parts: Joints of each part of the robot.
        reports: Health of the nodes.
        plugin: Name of the report of the plugin that commands the robot.
        simulator: Name of the simulator's report.
    """
    measured = recorder.joints("measured")
    desired = recorder.joints("desired")
    errors = {part: joint_error(measured, desired, joints) for part, joints in parts.items()}
    base = recorder.base().values["position"]
    drift = 1e3 * float(np.hypot(*(base[-1, :2] - base[0, :2])))
    turned = float(np.degrees(abs(base[-1, 3] - base[0, 3])))
    driven = float(np.hypot(*np.ptp(base[:, :2], axis=0)))
    rows = [
        *(
            (f"largest joint error, {part}", f"{error:.4f} rad ({joint})")
            for part, (error, joint) in errors.items()
            if joint  # a scheme may command some parts alone
        ),
        ("distance driven", f"{driven:.3f} m"),
        ("base drift, there and back", f"{drift:.1f} mm, {turned:.2f} deg"),
    ]
    for title, name, key in (
        ("real-time factor", simulator, "real-time factor"),
        ("cycle time, median", plugin, "cycle median [ms]"),
        ("cycle time, 99 %", plugin, "cycle p99 [ms]"),
        ("transport a cycle, median", plugin, "transport median [ms]"),
    ):
        value = reports[name].values.get(key) if name in reports else None
        unit = " ms" if key.endswith("[ms]") else ""
        if value is not None or LAYER not in reports:
            rows.append((title, "not reported" if value is None else f"{float(value):.3f}{unit}"))
    if plugin in reports:
        rows += published(reports[plugin].values)
    return rows + layer(reports)


def layer(reports: Mapping[str, HealthReport]) -> list[Row]:
    """List times and counts of a real-time layer, if there is one."""
    if LAYER not in reports:
        return []
    values = reports[LAYER].values
    median, most = (1e-3 * float(values.get(f"cycle {each} [us]", 0.0)) for each in ("median", "p99"))
    counts = ", ".join(f"{values.get(name, 0)} {name}" for name in ("skipped periods", "overruns"))
    return [
        (f"cycle of the layer at {float(values['rate [Hz]']):g} Hz", f"{median:.2f} ms median, {most:.2f} ms 99 %"),
        ("cycles of the layer", f"{values['cycles']}, {counts}"),
    ]


def published(values: Mapping[str, float | str]) -> list[Row]:
    """List the age of the newest message of each feedback, and the counts of the plugin's gate, as far as known."""
    suffix = " age [ms]"
    prefix = "gate: "
    ages = [
        (f"age of {key.removesuffix(suffix)}", f"{float(age):.1f} ms")
        for key, age in values.items()
        if key.endswith(suffix)
    ]
    counts = {key.removeprefix(prefix): int(float(count)) for key, count in values.items() if key.startswith(prefix)}
    listed = ", ".join(f"{count} {kind}" for kind, count in counts.items())
    return [*ages, ("held back by the gate", listed)] if listed else ages


def format_table(rows: list[Row]) -> str:
    """Write rows as aligned text."""
    width = max(len(title) for title, _ in rows)
    return "\n".join(f"  {title:<{width}}  {figure}" for title, figure in rows)


def plot(recorder: MotionRecorder, joints: tuple[str, ...], wheels: tuple[str, ...], path: Path) -> None:
    """Draw the tracking of the joints that are commanded, wheel speeds and the base over time into a PNG."""
    measured = recorder.joints("measured")
    desired = recorder.joints("desired")
    base = recorder.base()
    start = measured.time[0]
    figure = new_figure(10.0, 9.0)
    positions, errors, speeds, place = time_plots(figure, 4, 1)
    times = np.clip(measured.time, desired.time[0], desired.time[-1])
    for number, joint in enumerate(each for each in joints if each in desired.names):
        color = COLORS[number % len(COLORS)]
        values = measured.column(joint, "position")
        goal = desired.column(joint, "position")
        draw(positions, measured.time - start, values, color=color, label=joint)
        draw(positions, desired.time - start, goal, color=color, ls="--", lw=0.8)
        error = 1e3 * (values - np.interp(times, desired.time, goal))
        draw(errors, measured.time - start, error, color=color, label=joint)
    for wheel in wheels:
        draw(speeds, measured.time - start, measured.column(wheel, "velocity"), label=wheel)
    for name in ("x", "y", "z"):
        draw(place, base.time - start, base.column(name, "position"), label=name)
    dress(positions, "joints: measured (solid) and desired (dashed)", "position [rad]")
    dress(errors, "measured minus desired", "error [mrad]")
    dress(speeds, "wheels", "speed [rad/s]")
    dress(place, "floating base in the world", "position [m]")
    for axes in (positions, errors, speeds, place):
        legend(axes)
    figure.supxlabel("time [s]", fontsize=FONT_SIZE)
    save([("demo", figure)], path)
