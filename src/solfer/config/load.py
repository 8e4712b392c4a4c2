"""Loading one module of a main configuration."""

import logging
import os

from solfer.config.configuration import Configuration
from solfer.config.layering import Layers
from solfer.config.problems import Problems
from solfer.config.reading import Reading
from solfer.config.search import Folders

_LOG = logging.getLogger(__name__)


def load(
    file: str | os.PathLike,
    module: str,
    *,
    class_name: str | None = None,
    system: str | None = None,
    search_paths: Folders = (),
    middleware: str | None = None,
    layer: str | None = None,
) -> Configuration:
    """Load a module: merge its files, resolve sets, merge pipes with the middleware's part, and check all that is used.

    Args:
        file: The main configuration.
        module: Name of the plugin configuration.
        class_name: Component to load instead of the one that the configuration's `class` names.
        system: `SM` or `HW` instead of what the file says.
        search_paths: Folders where files are looked for that are not where the configuration says.
        middleware: `ROS` or `XBOT` instead of what the file says.
        layer: `RT` or `NRT` instead of what the module says.

    Raises:
        ConfigError: A file is missing or not YAML, or a value does not fit.
        UnknownName: A key, module, set, pipe or robot configuration that does not exist.
        SolferErrors: Several of these; all mistakes are reported at once.
    """
    problems = Problems()
    tree = Layers(file, problems, system, search_paths, middleware).tree(module, problems, layer=layer)
    configuration = Reading(tree, problems).configuration(os.fspath(file), module, class_name)
    problems.log(_LOG)
    problems.raise_if_any()
    return configuration
