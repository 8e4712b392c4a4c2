"""A dry run of plugins that run in one process: of a shared plugin, or of an RT layer."""

from collections.abc import Callable, Collection, Sequence

from solfer.config import Configuration, SharedPlugin
from solfer.errors import SolferError
from solfer.plugins.generation.dry_run import DryMiddleware, known_without_robot
from solfer.plugins.generation.generator import Generator
from solfer.plugins.shared.shared_plugin import SharedGenerator
from solfer.robot.shipped import RobotFiles


def dry_run_together(
    listed: Sequence[SharedPlugin],
    generators: Sequence[type[Generator]],
    files_of: Callable[[Configuration], RobotFiles],
    whole: bool,
    start: Collection[str] | None = None,
) -> list[SolferError]:
    """Generate plugins on shared Robots and with their shared space as far as possible, and return all errors.

    Args:
        listed: The plugins, in the order of their cycles.
        generators: Their generators, or `UnknownComponent`.
        files_of: Returns the files of the robot of one of them.
        whole: Whether all are free of mistakes so far; if not, what needs their missing parts is left out.
        start: Names of those that start by themselves; None: all.
    """

    def known(configuration: Configuration) -> Configuration:
        return known_without_robot(configuration, files_of(configuration), whole)

    def outside(configuration: Configuration) -> DryMiddleware:
        return DryMiddleware(known(configuration), files_of(configuration))

    generation = SharedGenerator(listed, generators, outside, known=known)
    for plugin in generation.attempt(whole, start):
        if plugin is not None:
            plugin.close()
    return generation.faults
