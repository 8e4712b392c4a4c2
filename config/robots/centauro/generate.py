#!/usr/bin/env python3
"""Write CENTAURO's URDF, SRDF, contacts, actuators and gains from parameters.yaml.

Run it after a change of parameters.yaml; with --check it only checks whether the files fit.
"""

import argparse
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import yaml
from generator.srdf import make_srdf
from generator.tables import make_actuators, make_contacts, make_gains
from generator.urdf import make_urdf

HERE = Path(__file__).resolve().parent
HEADER = "written by generate.py from parameters.yaml"


def main() -> int:
    """Write the files, or compare them; 0 on success, 1 if files differ, 2 if parameters.yaml is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--limits", choices=("wide", "cautious"), default="wide", help="limits of the legs")
    parser.add_argument(
        "--right-shoulder",
        choices=("paper", "mirrored"),
        default="paper",
        help="the paper's robot is not symmetric at the right shoulder",
    )
    parser.add_argument("--gains", choices=("simulation", "hardware"), default="simulation", help="joint impedance")
    parser.add_argument("--output", type=Path, default=HERE, metavar="DIR", help="default: beside this script")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file in DIR differs")
    options = parser.parse_args()
    try:
        files = make_files(options)
    except (ValueError, KeyError, TypeError) as error:
        print(f"parameters.yaml: {type(error).__name__}: {error}", file=sys.stderr)
        return 2
    return check(options.output, files) if options.check else write(options.output, files)


def make_files(options: argparse.Namespace) -> dict[str, str]:
    """Return the text of every file, by file name."""
    parameters = yaml.safe_load((HERE / "parameters.yaml").read_text(encoding="utf-8"))
    return {
        "centauro.urdf": xml_text(make_urdf(parameters, options.limits, options.right_shoulder)),
        "centauro.srdf": xml_text(make_srdf(parameters)),
        "contacts.yaml": yaml_text(make_contacts(parameters)),
        "actuators.yaml": yaml_text(make_actuators(parameters)),
        "gains.yaml": yaml_text(make_gains(parameters, options.gains)),
    }


def xml_text(element: ElementTree.Element) -> str:
    """Indent a document and put the header above it as a comment."""
    ElementTree.indent(element)
    body = ElementTree.tostring(element, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n<!-- {HEADER} -->\n{body}\n'


def yaml_text(document: dict[str, Any]) -> str:
    """Write a YAML document with short rows and the header as a comment."""
    return f"# {HEADER}\n" + yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=110)


def write(folder: Path, files: dict[str, str]) -> int:
    """Write all files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name).write_text(content, encoding="utf-8")
    return 0


def check(folder: Path, files: dict[str, str]) -> int:
    """Name the files that are missing or differ."""
    stale = [
        name
        for name, content in files.items()
        if not (folder / name).is_file() or (folder / name).read_text(encoding="utf-8") != content
    ]
    for name in stale:
        print(f"{folder / name} differs from what generate.py would write", file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
