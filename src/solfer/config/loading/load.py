"""Loading one module of a main configuration."""

import logging
import os

from solfer.config.loading.configuration import Configuration
from solfer.config.loading.layering import Layers, ModulePlacement
from solfer.config.loading.reading import Reading
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import Folders

_LOG = logging.getLogger(__name__)


def load(  # noqa: PLR0913 for users: what replaces values of the file, by its name
    file: str | os.PathLike,
    module: str,
    *,
    class_name: str | None = None,
    system: str | None = None,
    search_paths: Folders = (),
    middleware: str | None = None,
    layer: str | None = None,
    shared: YamlNode | None = None,
    over: YamlNode | None = None,
) -> Configuration:
    """Load a module: merge its files, resolve sets, merge pipes with the middleware's part, and check all that is used.

    Args:
        file: The main configuration, also one that was read before.
        module: Name of the plugin configuration.
        class_name: Component to load instead of the configuration's `class`.
        system: `SM` or `HW` instead of the file's `system`.
        search_paths: Folders to search for files that are not where the configuration expects them.
        middleware: Name of a middleware instead of the file's `middleware`.
        layer: `RT` or `NRT` instead of the module's `layer`.
        shared: The shared plugin that lists the module; its layer counts, and its mode if that is `idle`.
        over: What is laid over all files in the end; None: nothing.

    Raises:
        ConfigError: A file is missing or not YAML, or a value does not fit.
        UnknownName: A key, module, set, pipe or robot configuration does not exist.
        SolferErrors: Several of these; all mistakes are reported at once.
    """
    problems = Problems()
    tree = Layers(file, problems, system, folders=search_paths, middleware=middleware, over=over).tree(
        module, problems, ModulePlacement(layer, shared)
    )
    configuration = Reading(tree, problems).configuration(os.fspath(file), module, class_name)
    problems.log(_LOG)
    problems.raise_if_any()
    return configuration
