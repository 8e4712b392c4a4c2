"""Calibrations: names, signs and zeros of the hardware's joints.

They belong into the file of a system, so that `system` switches them together with everything else.
"""

from collections.abc import Iterable
from typing import Literal

from pydantic import Field

from solfer.config.loading.library import named_records
from solfer.config.records.bounds import COORDINATE
from solfer.config.records.pipes import AnyPipeRecord, ControllerRecord, FeedbackRecord
from solfer.config.records.record import Record
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.problems import Problems


class JointCalibrationRecord(Record):
    """One joint: `robot position = sign * (hardware position - offset)`."""

    name: str | None = Field(default=None, min_length=1, description="the hardware's name (default: the robot's)")
    sign: Literal[1, -1] = Field(default=1, description="1, or -1 where the hardware counts the other way round")
    offset: float = Field(default=0.0, **COORDINATE, description="reading of the hardware at the robot's zero [rad, m]")


class CalibrationRecord(Record):
    """Joints of one kind of encoder, by the robot's names."""

    name: str = Field(description="name of the calibration")
    joints: dict[str, JointCalibrationRecord] = Field(description="the joints, by the robot's names")

    def hardware(self, joint: str) -> str:
        """Return the hardware's name of one of the `joints`."""
        return self.joints[joint].name or joint

    def robot(self, names: Iterable[str]) -> tuple[str, ...]:
        """Return the robot's names of joints that the hardware calls `names`; unknown ones are left out."""
        known = {self.hardware(joint): joint for joint in self.joints}
        return tuple(known[name] for name in names if name in known)


def read_calibrations(
    tree: YamlNode, pipes: Iterable[AnyPipeRecord], problems: Problems
) -> dict[str, CalibrationRecord]:
    """Read all calibrations; those that `pipes` name have to exist, and belong to the hardware's pipes."""
    section = tree.get("calibration")
    calibrations = named_records(section, CalibrationRecord, problems)
    for calibration in calibrations.values():
        _check_names(calibration, problems)
    known = [name for name, _ in section.items()] if section else []
    pipes = tuple(pipes)
    for pipe in pipes:
        if pipe.calibration is None:
            continue
        if pipe.calibration not in known:
            problems.unknown(pipe.place("calibration"), "calibration", pipe.calibration, known)
        what = _not_hardware(pipe)
        if what:
            problems.add(pipe.place("calibration"), f"the pipe '{pipe.name}' {what}", "no calibration here")
    _check_all_or_none(pipes, problems)
    return calibrations


def _check_all_or_none(pipes: tuple[AnyPipeRecord, ...], problems: Problems) -> None:
    """Check that a plugin that commands calibrated joints receives them calibrated, and vice versa."""
    commands = [pipe for pipe in pipes if isinstance(pipe, ControllerRecord) and pipe.lower_level]
    received = [pipe for pipe in pipes if isinstance(pipe, FeedbackRecord) and not _not_hardware(pipe)]
    receives_calibrated = any(pipe.calibration for pipe in received)
    if receives_calibrated or any(pipe.calibration for pipe in commands):
        faulty = [pipe for pipe in commands if not pipe.calibration] + ([] if receives_calibrated else received)
        for pipe in faulty:
            what = f"the pipe '{pipe.name}' has no calibration, but others to and from the hardware have one"
            problems.add(pipe.place(), what, "the key 'calibration' in all of them, or in none")


def _check_names(calibration: CalibrationRecord, problems: Problems) -> None:
    owners: dict[str, str] = {}
    for joint, record in calibration.joints.items():
        name = calibration.hardware(joint)
        owner = owners.setdefault(name, joint)
        if owner != joint:
            what = f"the hardware's joint '{name}' stands for '{owner}' and for '{joint}'"
            problems.add(record.place("name"), what, "a name of its own for each joint")


def _not_hardware(pipe: AnyPipeRecord) -> str:
    """Return why the other end of a pipe is not the robot's hardware; empty if it is."""
    if not pipe.content.joints:
        return "carries no joints"
    if isinstance(pipe, ControllerRecord):
        return "" if pipe.lower_level else "goes to other plugins"
    return "" if pipe.function in ("state", "motor") else "carries references of other plugins"
