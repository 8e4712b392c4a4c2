"""Starts, stops and aborts the plugins of a loop: checked first, then done at one cycle boundary, all or nothing."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import partial
from itertools import combinations

from solfer.errors import ClaimRefused, MiddlewareError, UnknownName
from solfer.interfaces.declaration import Service
from solfer.plugins.life.managed_plugin import ManagedPlugin
from solfer.plugins.outputs.outputs import Claim
from solfer.transport import Middleware
from solfer.transport.lower_level import Answer, answered_service
from solfer.transport.middleware import SWITCH, SWITCH_ONE, TRIGGER, Flag, NoFields, Submit, SwitchRequest
from solfer.transport.plugin_state import STARTABLE, PluginState


@dataclass(frozen=True)
class Switch:
    """Plugins to start and to stop at one boundary."""

    start: tuple[ManagedPlugin, ...]
    stop: tuple[ManagedPlugin, ...]


class Switchboard:
    """Switches the plugins.

    Args:
        plugins: The plugins, in the order of the loop.
        admit: Raises a MiddlewareError while no plugin may start, such as after an emergency stop.
    """

    def __init__(self, plugins: Sequence[ManagedPlugin], admit: Callable[[], None] = lambda: None):
        self._plugins: Mapping[str, ManagedPlugin] = {plugin.name: plugin for plugin in plugins}
        self._admit = admit

    def plan(self, start: Sequence[str] = (), stop: Sequence[str] = ()) -> Switch:
        """Plan a switch, and check that it can be done at present.

        Raises:
            UnknownName: There is no plugin of that name.
            MiddlewareError: One is to start and to stop, cannot be started, or does not run; or none may start.
            ClaimRefused: Two plugins would command the same joint.
        """
        switch = Switch(self._named(start), self._named(stop))
        self._check(switch)
        return switch

    def commit(self, switch: Switch) -> None:
        """Do a planned switch, between two cycles; nothing at all if it cannot be done any more.

        Raises:
            MiddlewareError, ClaimRefused: As `plan`.
        """
        self._check(switch)
        for plugin in switch.stop:
            plugin.stop()
        for plugin in switch.start:
            plugin.start(after=switch.stop)

    def serve(self, middleware: Middleware, owner: str, submit: Submit) -> None:
        """Offer the services of the loop as `<owner>/<service>`, and those of each plugin.

        `submit` runs them between two cycles.

        Raises:
            MiddlewareError: A plugin has the name of the owner, so that two services would have one name.
        """
        if owner in self._plugins:
            raise MiddlewareError(f"'{owner}' is a plugin and the node that runs it", expected="two names")
        middleware.serve(
            owner,
            [
                *(self._switch_one(f"{name}_switch", plugin) for name, plugin in self._plugins.items()),
                answered_service(
                    "switch",
                    SWITCH,
                    SwitchRequest,
                    work=self.commit,
                    prepare=lambda request: self.plan(request.start, request.stop),
                ),
                Service("get_plugin_list", TRIGGER, NoFields, reply=Answer, handler=self._list),
            ],
            submit,
        )
        for name, plugin in self._plugins.items():
            middleware.serve(
                name,
                [
                    self._switch_one("switch", plugin),
                    Service("state", TRIGGER, NoFields, reply=Answer, handler=partial(_explain, plugin)),
                    answered_service("abort", TRIGGER, NoFields, work=partial(_abort, plugin)),
                ],
                submit,
            )

    def _switch_one(self, name: str, plugin: ManagedPlugin) -> Service:
        def prepare(request: Flag) -> Switch:
            return self.plan(start=[plugin.name]) if request.data else self.plan(stop=[plugin.name])

        return answered_service(name, SWITCH_ONE, Flag, work=self.commit, prepare=prepare)

    def _list(self, _: NoFields) -> Answer:
        return Answer(message="\n".join(f"{name}: {plugin.explanation}" for name, plugin in self._plugins.items()))

    def _named(self, names: Sequence[str]) -> tuple[ManagedPlugin, ...]:
        for name in names:
            if name not in self._plugins:
                raise UnknownName("plugin", name, self._plugins)
        return tuple(self._plugins[name] for name in dict.fromkeys(names))

    def _check(self, switch: Switch) -> None:
        for plugin in switch.stop:
            if plugin in switch.start:
                raise MiddlewareError(f"'{plugin.name}' is to start and to stop", expected="one of the two")
            if not plugin.active:
                raise MiddlewareError(
                    f"'{plugin.name}' does not run: {plugin.explanation}", expected="a plugin that runs"
                )
        for plugin in switch.start:
            if plugin.state not in STARTABLE:
                raise MiddlewareError(
                    f"'{plugin.name}' cannot be started: {plugin.explanation}", expected="a plugin that is stopped"
                )
        if switch.start:
            self._admit()
            claims = [  # of those that are active after the switch, or not at rest yet
                (plugin.name, plugin.plugin.outputs.claims, "")
                for plugin in self._plugins.values()
                if plugin in switch.start or not (plugin.at_rest or plugin in switch.stop)
            ]
            for conflict in find_conflicts(claims, "one of them stopped in the same switch"):
                raise conflict


def _explain(plugin: ManagedPlugin, _: NoFields) -> Answer:
    return Answer(message=plugin.explanation)


def _abort(plugin: ManagedPlugin, _: NoFields) -> None:
    if not plugin.active and plugin.state is not PluginState.STOPPING:
        raise MiddlewareError(f"'{plugin.name}' does not run: {plugin.explanation}", expected="a plugin that runs")
    plugin.abort("by service")


def find_conflicts(claims: Iterable[tuple[str, Set[Claim], str]], expected: str) -> Iterator[ClaimRefused]:
    """Yield an error for each two plugins that command the same number of a joint.

    Args:
        claims: Name of each plugin, what it commands, and its place in a file, if it has one.
        expected: What the user can do about it.
    """
    for (one, first, _), (other, second, where) in combinations(claims, 2):
        common = first & second
        if common:
            controller, field, joint = min(common)
            yield ClaimRefused(
                f"'{one}' and '{other}' both command the {field} of joint '{joint}' ({len(common)} numbers in common)",
                where=where or f"controller '{controller}'",
                expected=expected,
            )
