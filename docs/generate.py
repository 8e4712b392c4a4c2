#!/usr/bin/env python3
"""Writes what is made from the records of the configuration: the tables in configuration.md, and the JSON Schema.

Run it after a change of a record: `./run exec docs/generate.py`.
"""

import json
from pathlib import Path

from solfer.config.reference import reference
from solfer.config.schema import schema
from solfer.plugins import Registry

REPOSITORY = Path(__file__).resolve().parent.parent
PAGE, SCHEMA = REPOSITORY / "docs/configuration.md", REPOSITORY / "config/schema/solfer.schema.json"
BEGIN = "<!-- From here on docs/generate.py writes this page. -->"


def texts() -> dict[Path, str]:
    """What the files have to hold."""
    tags = Registry().tags()
    written, begin, _ = PAGE.read_text().partition(BEGIN)
    return {
        PAGE: f"{written}{begin}\n\n{reference(tags)}",
        SCHEMA: json.dumps(schema(tags), indent=1, ensure_ascii=False) + "\n",
    }


if __name__ == "__main__":
    for path, text in texts().items():
        path.write_text(text)
