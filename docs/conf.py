"""How Sphinx builds these pages; `./run docs` runs it."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

project = "solfer"
version = release = ElementTree.parse(Path(__file__).parents[2] / "package.xml").findtext("version", "")
html_title = f"solfer {version}"
html_theme = "furo"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
]
templates_path = ["_templates"]
exclude_patterns = ["generate.py"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
autodoc_default_options = {"ignore-module-all": True}
autodoc_member_order = "bysource"
autodoc_typehints = "description"
copybutton_prompt_text = "$ "
napoleon_use_ivar = True  # an attribute of a dataclass is described once
suppress_warnings = ["ref.python"]  # names in backquotes that several classes have

REDIRECT = """<!DOCTYPE html>
<meta charset="utf-8">
<meta http-equiv="refresh" content="1; url={address}">
<script>location.replace("{address}" + location.hash)</script>
<a href="{address}">This page has moved.</a>
"""

moved = {
    "bring_your_robot": "tutorials/bring_your_robot",
    "figures": "tutorials/figures",
    "first_component": "tutorials/first_component",
    "gallery": "tutorials/gallery",
    "catkin_workspace": "how-to/catkin_workspace",
    "hardware": "how-to/hardware",
    "live_parameters": "how-to/live_parameters",
    "recording": "how-to/recording",
    "ros_tools": "how-to/ros_tools",
    "rviz": "how-to/rviz",
    "security": "how-to/security",
    "shared_control": "how-to/shared_control",
    "shared_robot": "how-to/shared_robot",
    "studies": "how-to/studies",
    "trajectories": "how-to/trajectories",
    "troubleshooting": "how-to/troubleshooting",
    "upgrading": "how-to/upgrading",
    "view": "how-to/view",
    "api": "reference/api",
    "commands": "reference/commands",
    "compensation": "reference/compensation",
    "configuration": "reference/configuration",
    "dependencies": "reference/dependencies",
    "dynamics": "reference/dynamics",
    "ground_forces": "reference/ground_forces",
    "inverse_dynamics": "reference/inverse_dynamics",
    "inverse_kinematics": "reference/inverse_kinematics",
    "logs": "reference/logs",
    "lower_level": "reference/lower_level",
    "navigation": "reference/navigation",
    "odometry": "reference/odometry",
    "pipes": "reference/pipes",
    "points": "reference/points",
    "support_shaping": "reference/support_shaping",
    "tasks": "reference/tasks",
    "wheeled_motion": "reference/wheeled_motion",
    "architecture": "explanation/architecture",
    "faults": "explanation/faults",
    "real_time": "explanation/real_time",
    "shared_plugin": "explanation/shared_plugin",
    "transport_faults": "explanation/transport_faults",
    "robots_tried": "measurements/robots_tried",
}
"""Pages by their address until version 0.1: their present one."""


def escape_bars(_app: Any, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Let |x| be a norm, and no substitution of reStructuredText."""
    lines[:] = [line.replace("|", r"\|") for line in lines]


def write_redirects(app: Any, exception: Exception | None) -> None:
    """Write a page at each former address that leads to the present one, with the heading that was asked for."""
    if exception is None and app.builder.format == "html":
        for former, page in moved.items():
            text = REDIRECT.format(address=app.builder.get_relative_uri(former, page))
            (Path(app.outdir) / f"{former}.html").write_text(text, encoding="utf-8")


def setup(app: Any) -> None:
    """Register what changes docstrings and what adds pages; see Sphinx."""
    app.connect("autodoc-process-docstring", escape_bars)
    app.connect("build-finished", write_redirects)
