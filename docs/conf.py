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


def escape_bars(_app: Any, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Let |x| be a norm, and no substitution of reStructuredText."""
    lines[:] = [line.replace("|", r"\|") for line in lines]


def setup(app: Any) -> None:
    """Register what changes docstrings; see Sphinx."""
    app.connect("autodoc-process-docstring", escape_bars)
