"""References that need no program: functions of time, made of their records."""

from solfer.references.build import build_reference, joints_of
from solfer.references.generator import ReferenceGenerator

__all__ = ["ReferenceGenerator", "build_reference", "joints_of"]
