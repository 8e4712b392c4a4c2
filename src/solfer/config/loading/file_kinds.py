"""What a YAML file is that is no main configuration, and which command reads it."""

from solfer.config.yaml.nodes import YamlNode
from solfer.errors import ConfigError

_KINDS = (
    ({"urdf"}, "the bundle of a robot", "`solfer view --robot {file}`, which loads it"),
    ({"plugins", "configuration"}, "a study", "`solfer study {file} --dry`, which checks it"),
    ({"base now"}, "a scenario", "`solfer scenario {file}`, which checks it"),
    *(
        ({key}, "a world", "`rosrun solfer simulator --world {file}`, which loads it")
        for key in ("ground", "grids", "stairs", "boxes")
    ),
    ({"topics"}, "the faults of a transport", "`solfer study` of a study that names it"),
)
"""Keys that a kind of file has at its top, what it is, and what would have been right."""

_OF_ROBOTS = ("actuators", "contacts")
"""Keys below the name of a robot."""


def other_kind(file: str, top: YamlNode) -> ConfigError | None:
    """Make the error of a file that is no main configuration, but of another kind; None: its kind is not known.

    Args:
        file: Path of the file.
        top: All that is in it.
    """
    keys = top.entries()
    kind = next(((what, right) for own, what, right in _KINDS if own <= set(keys)), None)
    parts = (part for below in keys.values() for part in below.entries() if part in _OF_ROBOTS)
    if kind is None and (part := next(parts, None)) is not None:
        kind = f"the file of the {part} of a robot", f"`solfer check` of a main configuration whose '{part}' names it"
    if kind is None and "mwoibn" in keys and _is_laid_over(keys["mwoibn"]):
        kind = "laid over a main configuration", "`solfer check` of the main configuration that names it"
    if kind is None:
        return None
    what, right = kind
    expected = f"a main configuration; {right.format(file=file)}"
    return ConfigError(f"this is no main configuration: it is {what}", where=str(top.head), expected=expected)


def _is_laid_over(root: YamlNode) -> bool:
    """Whether a file has parts of a main configuration, and none of the keys without which it is not whole."""
    modules = root.entries("modules").values()
    parts = [set(each.entries()) for each in modules]
    is_whole = bool({"middleware", "system", "layers"} & set(root.entries())) or any(
        not keys or {"class", "layer", "plugins", "robot", "secondary_file"} & keys for keys in parts
    )
    return not is_whole and (bool(parts) or root.get("robot", "rate") is not None)
