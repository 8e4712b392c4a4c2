"""Configuration: YAML that remembers its places, strict merging, and records.

`read` reads any YAML file of this project into a record, `load` one module of a main configuration, `load_shared` a
shared plugin, and `check` reports all that is wrong with a main configuration.
"""

from solfer.config.loading.check import CheckReport, check
from solfer.config.loading.configuration import Configuration, Part
from solfer.config.loading.layers import module_names
from solfer.config.loading.listed_plugins import SharedPlugin
from solfer.config.loading.load import load
from solfer.config.loading.shared import SharedConfiguration, load_shared
from solfer.config.records.calibration import CalibrationRecord, JointCalibrationRecord
from solfer.config.records.live import LIVE
from solfer.config.records.modules import ModuleRecord, RobotRecord
from solfer.config.records.pipes import (
    AnyPipeRecord,
    ControllerRecord,
    DofsRecord,
    FeedbackRecord,
    FilterRecord,
    InterfaceRecord,
    PipeRecord,
)
from solfer.config.records.record import Record, read
from solfer.config.records.robot_names import ComparedWith, NameOf
from solfer.config.records.sources import FileRecord, MappingRecord, SourceRecord, TextRecord
from solfer.config.yaml.files import opened
from solfer.config.yaml.problems import Notice, Problems

__all__ = [
    "AnyPipeRecord",
    "CalibrationRecord",
    "ComparedWith",
    "Configuration",
    "ControllerRecord",
    "DofsRecord",
    "FeedbackRecord",
    "FileRecord",
    "FilterRecord",
    "InterfaceRecord",
    "JointCalibrationRecord",
    "LIVE",
    "MappingRecord",
    "ModuleRecord",
    "NameOf",
    "Notice",
    "Part",
    "PipeRecord",
    "Problems",
    "Record",
    "CheckReport",
    "RobotRecord",
    "SharedConfiguration",
    "SharedPlugin",
    "SourceRecord",
    "TextRecord",
    "check",
    "load",
    "load_shared",
    "module_names",
    "opened",
    "read",
]
