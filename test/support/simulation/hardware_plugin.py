"""What several tests of hardware plugin share."""

from support.integration.world import CONFIG, ROBOT, World

from solfer.simulation.mock_hardware.mock_hardware import MockHardware


def mocked(middleware):
    """Make CENTAURO behind the wiring of its hardware."""
    mock = MockHardware.from_file(ROBOT / "hardware" / "mock.yaml", middleware)
    return mock.simulation, mock


class HardwareWorld(World):
    """The hardware in memory."""

    def offer(self, middleware):
        return mocked(middleware)


def configuration(tmp_path, system, calibration=lambda text: text):
    """Write the shipped configuration for a system; `calibration` may change the text of hardware.yaml."""
    folder = tmp_path / "config"
    (folder / "support").mkdir(parents=True)
    (folder / "robots").symlink_to(CONFIG / "robots")
    for path in (CONFIG / "support").iterdir():
        text = path.read_text()
        (folder / "support" / path.name).write_text(calibration(text) if path.name == "hardware.yaml" else text)
    text = (CONFIG / "centauro.yaml").read_text()
    changed = text.replace("system: SM", f"system: {system}")
    assert len(changed.splitlines()) == len(text.splitlines())
    (folder / "centauro.yaml").write_text(changed)
    return folder / "centauro.yaml"
