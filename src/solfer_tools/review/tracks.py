"""What a plugin measured and desired of each joint."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from solfer.numerics.rotations import whole_revolutions
from solfer.recording.model import JOINTS_KIND, Channel, Recording
from solfer_tools.review.motion import continuous_joints


@dataclass(frozen=True)
class Series:
    """One column over time: times, shape (T,) [s], and values, shape (T,)."""

    times: np.ndarray
    values: np.ndarray

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return what held at some times: the newest value before; NaN before the first."""
        rows = np.searchsorted(self.times, times + 1e-9, "right") - 1
        return np.where(rows >= 0, self.values[np.maximum(rows, 0)], np.nan)


@dataclass(frozen=True)
class Track:
    """A joint.

    Attributes:
        joint: Its name.
        field: 'position', or 'velocity' of a joint that only a velocity is desired of.
        unit: Unit of both.
        measured: What was measured.
        desired: What was sent, or what the component desired if it sends nothing; None: neither.
    """

    joint: str
    field: str
    unit: str
    measured: Series
    desired: Series | None

    @property
    def span(self) -> float:
        """Range of all that was measured and desired."""
        values = [self.measured.values, *([] if self.desired is None else [self.desired.values])]
        finite = np.concatenate(values)
        finite = finite[np.isfinite(finite)]
        return float(np.ptp(finite)) if finite.size else 0.0

    def error(self) -> np.ndarray:
        """Return what is desired minus what is measured, at the times of what is measured, shape (T,)."""
        if self.desired is None:
            return np.full(len(self.measured.times), np.nan)
        return self.desired.at(self.measured.times) - self.measured.values


def tracks_of(recording: Recording, plugin: str) -> list[Track]:
    """Find the tracks of a plugin, in the order in which its joints were measured."""
    measured = {
        field: _columns(recording, plugin, ("measured", "feedback"), field=field) for field in ("position", "velocity")
    }
    sent = {field: _columns(recording, plugin, ("command",), field=field) for field in measured}
    if not any(sent.values()):
        sent = {field: _columns(recording, plugin, ("wanted",), field=field) for field in measured}
    tracks = []
    continuous = continuous_joints(recording)
    for joint, (unit, series) in measured["position"].items():
        turns = joint not in sent["position"] and joint in sent["velocity"] and joint in measured["velocity"]
        field = "velocity" if turns else "position"
        unit, series = measured[field][joint] if turns else (unit, series)
        desired = sent[field].get(joint, ("", None))[1]
        if desired is not None and field == "position" and joint in continuous:
            desired = _nearest(desired, series)
        tracks.append(Track(joint, field, unit, measured=series, desired=desired))
    return tracks


def _nearest(sent: Series, measured: Series) -> Series:
    """Return what was sent, in the count of a driver, on the turns of what was measured."""
    errors = np.nan_to_num(sent.values - measured.at(sent.times))
    return Series(sent.times, sent.values - whole_revolutions(errors, np.array(math.tau)))


def _columns(recording: Recording, plugin: str, parts: tuple[str, ...], field: str) -> dict[str, tuple[str, Series]]:
    """Return unit and numbers of each joint of the channels `<plugin>/<part>/.../<field>`; the first one counts."""
    found: dict[str, tuple[str, Series]] = {}
    for part in parts:
        for channel in _channels(recording, f"{plugin}/{part}/", field):
            for place, (joint, unit) in enumerate(zip(channel.columns, channel.units, strict=True)):
                found.setdefault(joint, (unit, Series(channel.times, channel.values[:, place])))
    return found


def _channels(recording: Recording, prefix: str, field: str) -> Iterator[Channel]:
    for name, channel in recording.channels.items():
        ours = name.startswith(prefix) and name.endswith(f"/{field}")
        if ours and channel.kind == JOINTS_KIND and len(channel.times):
            yield channel
