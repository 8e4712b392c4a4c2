"""Records of sources outside of the configuration: files, parameters, and maps of other models."""

from pathlib import Path
from typing import Any, Literal

from pydantic import Field, model_validator

from solfer.config.records.bounds import Name
from solfer.config.records.record import Record
from solfer.config.yaml.files import located


class FileRecord(Record):
    """A file: a path, or `path` (a folder) and `file` to be joined.

    Paths are relative to the file that names them; `package://name/...` and `$(find name)/...` lie in a ROS package.
    """

    path: str = Field(default="", description="folder")
    file: Name = Field(description="file, in the folder if there is one")

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, data: Any) -> Any:
        return {"file": data} if isinstance(data, str) else data

    @property
    def location(self) -> Path:
        """Return the path of the file.

        Raises:
            UnknownName: There is no such ROS package.
        """
        return _joined(self, self.path, self.file)


class TextRecord(Record):
    """A text that lies in a parameter (a word: its name) or in a file (`file`, with `path` or without)."""

    parameter: Name | None = Field(default=None, description="name of the parameter")
    path: str = Field(default="", description="folder")
    file: Name | None = Field(default=None, description="file, in the folder if there is one")

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, data: Any) -> Any:
        return {"parameter": data} if isinstance(data, str) else data

    @property
    def given(self) -> bool:
        """Whether it names anything; a folder alone does not."""
        return self.parameter is not None or self.file is not None

    @property
    def location(self) -> Path | None:
        """Return the path of the file; None for a parameter.

        Raises:
            UnknownName: There is no such ROS package.
        """
        return None if self.file is None else _joined(self, self.path, self.file)

    @model_validator(mode="after")
    def _one_of_both(self) -> "TextRecord":
        if self.parameter is not None and self.file is not None:
            raise ValueError("expected a parameter or a file, got both")
        return self


class SourceRecord(Record):
    """Sources of the robot's descriptions."""

    urdf: TextRecord | None = Field(default=None, description="URDF: links and joints")
    srdf: TextRecord | None = Field(default=None, description="SRDF: groups and named states")
    actuators: TextRecord | None = Field(default=None, description="series elastic actuators")
    contacts: TextRecord | None = Field(default=None, description="contacts")
    config: TextRecord | None = Field(
        default=None,
        description="XBOT: the file of the RT layer, which `rosrun solfer xbot` runs when it is given this file",
    )
    controller: TextRecord | None = Field(
        default=None, description="gains that each start loads into the lower level, a file like `gains.yaml`"
    )


class MappingRecord(Record):
    """A bidirectional map whose outside order is that of a topic or of another model."""

    name: str = Field(description="name of the map")
    loading: Literal["topic", "model"] = Field(description="`topic`: order of a message; `model`: order of a URDF")
    source: str | None = Field(default=None, description="the topic")
    message: str | None = Field(default=None, description="`package/Type` of the topic's message")
    urdf: TextRecord | None = Field(default=None, description="the model: a parameter or a file")

    @model_validator(mode="after")
    def _complete(self) -> "MappingRecord":
        needed = ("source", "message") if self.loading == "topic" else ("urdf",)
        absent = [key for key in needed if getattr(self, key) is None]
        if absent:
            raise ValueError(f"a map with 'loading: {self.loading}' needs the key '{absent[0]}'")
        if self.urdf is not None and not self.urdf.given:
            raise ValueError("'urdf' names neither a parameter nor a file")
        return self


def _joined(record: Record, path: str, file: str) -> Path:
    named = record.where("file")
    folder = located(path, record.folder("path"), record.where("path")) if path else Path(record.folder("file"))
    return located(file, folder, named)
