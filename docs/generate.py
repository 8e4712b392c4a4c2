#!/usr/bin/env python3
"""Writes what is made from the records of the configuration: tables in the documentation, and the JSON Schema.

Run it after a change of a record: `./run exec docs/generate.py`.
"""

import json
from pathlib import Path

from solfer.config.reference.schema import schema
from solfer.config.reference.tables import live, reference
from solfer.lower_level.records import GainsRecord
from solfer.model.actuators import ActuatorsRecord
from solfer.model.contacts import ContactsRecord
from solfer.plugins import Registry
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.mock_hardware.records import HardwareRecord
from solfer.simulation.world.records import WorldRecord

REPOSITORY = Path(__file__).resolve().parent.parent
LIVE = REPOSITORY / "docs/how-to/live_parameters.md"
PAGE, SCHEMA = REPOSITORY / "docs/reference/configuration.md", REPOSITORY / "config/schema/solfer.schema.json"
FILES = (
    ("Robot's bundle (`config/robots/centauro/robot.yaml`)", BundleRecord),
    ("Actuators of a robot (`actuators.yaml`), below the robot's name", ActuatorsRecord),
    ("Contacts of a robot (`contacts.yaml`), below the robot's name", ContactsRecord),
    ("Gains of a robot (`gains.yaml`), below the robot's name", GainsRecord),
    ("Mock of a robot's hardware (`hardware/mock.yaml`)", HardwareRecord),
    ("World (`config/worlds/*.yaml`)", WorldRecord),
)
BEGIN = "<!-- From here on docs/generate.py writes this page. -->"


def texts() -> dict[Path, str]:
    """Return what the files have to hold."""
    tags = Registry().tags()
    names: dict[type, str] = {}
    for name in sorted(tags, key=lambda name: (not name.islower(), name)):
        names.setdefault(tags[name], name)  # a component has one section; the original's names for it have capitals
    components = {name: record for record, name in names.items()}
    return {
        PAGE: f"{_written(PAGE)}{reference(components, FILES)}",
        LIVE: f"{_written(LIVE)}{live(components)}",
        SCHEMA: json.dumps(schema(tags), indent=1, ensure_ascii=False) + "\n",
    }


def _written(page: Path) -> str:
    """Return the part of a page that is not made here."""
    written, begin, _ = page.read_text().partition(BEGIN)
    return f"{written}{begin}\n\n"


if __name__ == "__main__":
    for path, text in texts().items():
        path.write_text(text)
