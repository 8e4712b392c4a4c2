"""The table of the kinds of pipes: the only place for what depends on a kind, with the records that it builds on."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from solfer.config.kinds.table import KINDS as RECORDS
from solfer.config.records.pipes import HOMES, KindRecords
from solfer.pipes.command_pipe import CommandPipe
from solfer.pipes.context import PipeContext
from solfer.pipes.feedback_pipe import FeedbackPipe


@dataclass(frozen=True)
class PipeKind:
    """A kind of pipe.

    Attributes:
        space: Its name in a configuration.
        records: Records of its pipes, with what they carry, their messages, and their description.
        feedback: Makes a pipe that a plugin receives, from its record.
        controller: Makes a pipe that a plugin sends to, from its record.
    """

    space: str
    records: KindRecords
    feedback: Callable[[Any, PipeContext], FeedbackPipe]
    controller: Callable[[Any, PipeContext], CommandPipe]

    @classmethod
    def of(cls, space: str, home: str) -> "PipeKind":
        """Collect what belongs to a kind from its home."""
        factory = import_module(f"solfer.pipes.{home}.factory")
        return cls(space, RECORDS[space], factory.feedback, controller=factory.controller)


PIPE_KINDS = {space: PipeKind.of(space, home) for space, home in HOMES.items()}
"""Each kind, by its `space`."""
