"""Configuration: YAML that remembers its places, strict merging, and records.

`read` reads any YAML file of ours into a record, `load` one module of a main configuration, `load_shared` a shared
plugin, and `check` reports all that is wrong with a main configuration.
"""

from solfer.config.calibration import CalibrationRecord, JointCalibrationRecord
from solfer.config.check import Report, check
from solfer.config.configuration import Configuration, Part
from solfer.config.layering import module_names
from solfer.config.load import load
from solfer.config.modules import ModuleRecord, RobotRecord
from solfer.config.naming import NameOf
from solfer.config.pipes import ControllerRecord, DofsRecord, FeedbackRecord, FilterRecord, InterfaceRecord, PipeRecord
from solfer.config.problems import Notice, Problems
from solfer.config.record import Record, read
from solfer.config.shared import SharedConfiguration, SharedPlugin, load_shared
from solfer.config.sources import FileRecord, MappingRecord, SourceRecord, TextRecord

__all__ = [
    "CalibrationRecord",
    "Configuration",
    "ControllerRecord",
    "DofsRecord",
    "FeedbackRecord",
    "FileRecord",
    "FilterRecord",
    "InterfaceRecord",
    "JointCalibrationRecord",
    "MappingRecord",
    "ModuleRecord",
    "NameOf",
    "Notice",
    "Part",
    "PipeRecord",
    "Problems",
    "Record",
    "Report",
    "RobotRecord",
    "SharedConfiguration",
    "SharedPlugin",
    "SourceRecord",
    "TextRecord",
    "check",
    "load",
    "load_shared",
    "module_names",
    "read",
]
