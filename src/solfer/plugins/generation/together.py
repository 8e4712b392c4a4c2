"""Makes the plugins of a shared plugin (Listing 17 of the paper): on shared Robots, with a shared space."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from solfer.config import Configuration
from solfer.config.loading.listed_plugins import SharedPlugin
from solfer.config.records.modules import SharedRecord
from solfer.errors import SolferError, raise_all, repeats, singles
from solfer.pipes import CommandPipe
from solfer.plugins.generation.generator import Generator, log_start
from solfer.plugins.generation.registry import Registry
from solfer.plugins.life.budget import BudgetRules
from solfer.plugins.life.switchboard import find_conflicts
from solfer.plugins.plugin import Plugin
from solfer.plugins.sharing.ends import check_ends, publications
from solfer.plugins.sharing.member import SpaceMember
from solfer.plugins.sharing.robots import Sharing
from solfer.plugins.sharing.space import SharedSpace, SharedTopic
from solfer.transport import Middleware


@dataclass(frozen=True)
class Members:
    """The plugins of a shared plugin, or of an RT layer, ready to run in one loop.

    Attributes:
        plugins: In the order of their cycles.
        requires: Names of the others that one needs, by its own name.
        sharing: Their Robots; the loop calls `sharing.turns.next` before each cycle.
        spaces: What they publish, by the name of their shared plugin.
    """

    plugins: tuple[Plugin, ...]
    requires: dict[str, tuple[str, ...]]
    sharing: Sharing
    spaces: dict[str, SharedSpace]


class SharedGenerator:
    """Makes the plugins of a list as far as possible; what cannot be made is noted in `faults`.

    Args:
        listed: The plugins with their configurations, in the order of their cycles.
        generators: Their generators.
        middleware_of: Returns the middleware that carries what one of them exchanges with everybody else.
        known: Returns a configuration without what is not known of it; in a dry run that is what the robot knows.

    Attributes:
        faults: Mistakes so far.
        sharing: Their Robots.
        spaces: The shared space of each shared plugin; one with mistakes is missing.
    """

    def __init__(
        self,
        listed: Sequence[SharedPlugin],
        generators: Sequence[type[Generator]],
        middleware_of: Callable[[Configuration], Middleware],
        known: Callable[[Configuration], Configuration] = lambda configuration: configuration,
    ):
        self.faults: list[SolferError] = []
        self._listed = listed
        self._generators = generators
        self._known = known
        self._outside = [middleware_of(each.configuration) for each in listed]
        self.spaces = self._make_spaces()
        self.sharing = Sharing([each.configuration for each in listed], [each.group for each in listed])

    def check(self, whole: bool = True, start: Collection[str] | None = None) -> list[SolferError]:
        """Make all of them as `attempt` does, release them, and return the faults."""
        for plugin in self.attempt(whole, start):
            if plugin is not None:
                plugin.close()
        return self.faults

    def attempt(self, whole: bool = True, start: Collection[str] | None = None) -> list[Plugin | None]:
        """Make all of them in their order; None for one that cannot be made.

        Args:
            whole: Whether the configurations have all their pipes; if not, none is missed.
            start: Names of those that start by themselves; None: all.
        """
        plugins: list[Plugin | None] = []
        for each, generator, outside in zip(self._listed, self._generators, self._outside, strict=True):
            outlet = outside
            if each.group in self.spaces:
                outlet = SpaceMember(each.name, self.spaces[each.group], outside)  # type: ignore[abstract]
            generation = generator(self._known(each.configuration), outlet, self.sharing)
            plugins.append(generation.attempt(whole))
            self._note(error.at(each.where) for error in generation.faults)
        self._check_ends(plugins)
        claims = [
            (each.name, plugin.outputs.claims, each.where)
            for each, plugin in zip(self._listed, plugins, strict=True)
            if plugin is not None and (start is None or each.name in start)
        ]
        expected = (
            "one of them alone, or one that publishes to the other, such as `shared: {controller: [lower_body]}` in "
            "the configuration of one that a shared plugin lists"
        )
        self._note(find_conflicts(claims, expected))
        return plugins

    def _make_spaces(self) -> dict[str, SharedSpace]:
        topics: dict[str, list[SharedTopic]] = {}
        spaces: dict[str, SharedSpace] = {}
        for each, middleware in zip(self._listed, self._outside, strict=True):
            if each.group:
                found = topics.setdefault(each.group, [])
                with self._noting():
                    found += publications(each.configuration, middleware.resolve)
        for group, published in topics.items():
            with self._noting():
                spaces[group] = SharedSpace(published)
        return spaces

    def _check_ends(self, plugins: Sequence[Plugin | None]) -> None:
        """Check the ends of those that could be made."""
        feedbacks = []
        commands = list[CommandPipe]()
        for each, plugin in zip(self._listed, plugins, strict=True):
            if plugin is not None:
                places = {record.name: record.where("source") for record in each.configuration.feedbacks}
                feedbacks += [(pipe, places.get(pipe.name, "")) for pipe in plugin.feedbacks]
                commands += [pipe for pipe, _ in plugin.outputs.controllers]
        with self._noting():
            check_ends(feedbacks, commands)

    @contextmanager
    def _noting(self) -> Iterator[None]:
        """Note the errors of a step."""
        try:
            yield
        except SolferError as error:
            self._note(singles([error]))

    def _note(self, errors: Iterable[SolferError]) -> None:
        self.faults += [each for each in errors if not repeats(each, self.faults)]


def budget_of(record: SharedRecord) -> BudgetRules | None:
    """Return how long the components of a shared plugin may take; None: as long as they like."""
    return None if record.budget is None else BudgetRules(record.budget, record.overruns, record.grace)


def find_generator(listed: SharedPlugin, registry: Registry) -> type[Generator]:
    """Find the generator of a plugin of a list.

    Raises:
        SolferError: See `Registry.find`; at the `class` of its configuration, or else in the list.
    """
    configuration = listed.configuration
    name = configuration.name
    class_name = configuration.module.class_
    where = listed.where if class_name is None else configuration.where("modules", name, "class")
    return registry.find(listed.plugin, class_name, where)


def generate_shared(
    listed: Sequence[SharedPlugin],
    middleware_of: Callable[[Configuration], Middleware],
    registry: Registry,
    start: Collection[str] | None = None,
) -> Members:
    """Make the plugins of a list. Nothing is sent before their first cycles.

    Those that a shared plugin lists exchange messages in its shared space; the others by the middleware alone.

    Args:
        listed: The plugins with their configurations, in the order of their cycles.
        middleware_of: Returns the middleware that carries what one of them exchanges with everybody else.
        registry: Finds their components.
        start: Names of those that start by themselves; None: all.

    Raises:
        SolferError: A plugin cannot be made, two publish one topic, two ends of a topic do not fit each other, or two
            that start together command the same number of a joint.
        SolferErrors: Several of these: all that can be found at once.
    """
    generators = [find_generator(each, registry) for each in listed]
    generation = SharedGenerator(listed, generators, middleware_of)
    raise_all(generation.faults)
    made = generation.attempt(start=start)
    raise_all(generation.faults)
    plugins = tuple(plugin for plugin in made if plugin is not None)
    for each, plugin in zip(listed, plugins, strict=True):
        log_start(each.configuration, plugin)
    return Members(plugins, {each.name: each.requires for each in listed}, generation.sharing, spaces=generation.spaces)
