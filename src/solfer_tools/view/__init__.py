"""A live page in the browser: a robot and its plugins, from a scene and from what a middleware offers."""

from solfer.errors import MissingDependency
from solfer.installation import pip_install

try:
    import viser  # noqa: F401
except ModuleNotFoundError as error:
    raise MissingDependency(
        f"the page in the browser needs viser, and there is no module '{error.name}'",
        expected=pip_install("viser", file="requirements-view.txt"),
    ) from error

from solfer_tools.view.page import Page
from solfer_tools.view.playback import Playback
from solfer_tools.view.server import PageServer

__all__ = ["Page", "PageServer", "Playback"]
