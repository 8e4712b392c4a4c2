"""Fig. 3 of the paper on the desired State instead of the measured one."""

from pathlib import Path

from support.integration.world import CONFIG

LINE = "robot: online          #"


def write_offline(folder: Path) -> Path:
    """Write the shipped configuration with one other tag of `gravity_compensation`; return the file."""
    for name in ("support", "robots"):
        (folder / name).symlink_to(CONFIG / name)
    text = (CONFIG / "centauro.yaml").read_text()
    assert text.count(LINE) == 1
    file = folder / "centauro.yaml"
    file.write_text(text.replace(LINE, LINE.replace("online", "offline")))
    return file
