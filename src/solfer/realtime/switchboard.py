"""Starts, stops and aborts plugins of the RT layer: checked first, then done at one cycle boundary, all or nothing."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations

from solfer.components.declaration import Service
from solfer.errors import ClaimRefused, MiddlewareError, UnknownName
from solfer.lower_level.server.services import SwitchRequest
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.lifecycle import STARTABLE, ManagedPlugin, PluginState
from solfer.transport import Middleware
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import Flag, NoFields, Submit

EXECUTOR = "xbotcore"
"""Owner of the services of the whole RT layer."""

SET_BOOL, TRIGGER, SWITCH = "std_srvs/SetBool", "std_srvs/Trigger", "solfer/SwitchControllers"


@dataclass(frozen=True)
class Switch:
    """Plugins to start and to stop at one boundary."""

    start: tuple[ManagedPlugin, ...]
    stop: tuple[ManagedPlugin, ...]


class Switchboard:
    """Switches the plugins.

    Args:
        plugins: The plugins, in the order of the executor.
        estop: The emergency stop; while it is tripped no plugin starts.
    """

    def __init__(self, plugins: Sequence[ManagedPlugin], estop: EmergencyStopLatch):
        self._plugins: Mapping[str, ManagedPlugin] = {plugin.name: plugin for plugin in plugins}
        self._estop = estop

    def plan(self, start: Sequence[str] = (), stop: Sequence[str] = ()) -> Switch:
        """Plan a switch, and check that it can be done at present.

        Raises:
            UnknownName: There is no plugin of that name.
            MiddlewareError: One is to start and to stop, cannot be started, or does not run; or the emergency stop is
                tripped.
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

    def clear(self) -> None:
        """Release the emergency stop; no plugin starts by itself.

        Raises:
            MiddlewareError: A plugin is not at rest.
        """
        moving = [plugin.name for plugin in self._plugins.values() if not plugin.at_rest]
        if moving:
            raise MiddlewareError(
                f"the emergency stop stays: {', '.join(moving)} not at rest", expected="all plugins stopped or aborted"
            )
        self._estop.clear()

    def serve(self, middleware: Middleware, submit: Submit) -> None:
        """Offer the services; `submit` runs them between two cycles."""
        middleware.serve(
            EXECUTOR,
            [
                *(self._switch_one(f"{name}_switch", plugin) for name, plugin in self._plugins.items()),
                Service(
                    "switch",
                    SWITCH,
                    SwitchRequest,
                    Answer,
                    self._done(self.commit),
                    prepare=lambda request: self.plan(request.start, request.stop),
                ),
                Service("get_plugin_list", TRIGGER, NoFields, Answer, self._list),
                Service("estop", TRIGGER, NoFields, Answer, self._done(lambda _: self._estop.trip("by service"))),
                Service("estop_clear", TRIGGER, NoFields, Answer, self._done(lambda _: self.clear())),
            ],
            submit,
        )
        for name, plugin in self._plugins.items():
            middleware.serve(
                name,
                [
                    self._switch_one("switch", plugin),
                    Service("state", TRIGGER, NoFields, Answer, partial(_tell, plugin)),
                    Service("abort", TRIGGER, NoFields, Answer, self._done(lambda _, of=plugin: _abort(of))),
                ],
                submit,
            )

    def _switch_one(self, name: str, plugin: ManagedPlugin) -> Service:
        def prepare(request: Flag) -> Switch:
            return self.plan(start=[plugin.name]) if request.data else self.plan(stop=[plugin.name])

        return Service(name, SET_BOOL, Flag, Answer, self._done(self.commit), prepare=prepare)

    def _list(self, _: NoFields) -> Answer:
        return Answer(message="\n".join(f"{name}: {state_of(plugin)}" for name, plugin in self._plugins.items()))

    @staticmethod
    def _done(work: Callable[..., None]) -> Callable[..., Answer]:
        def answer(request: object) -> Answer:
            work(request)
            return Answer()

        return answer

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
                    f"'{plugin.name}' does not run: {state_of(plugin)}", expected="a plugin that runs"
                )
        for plugin in switch.start:
            if plugin.state not in STARTABLE:
                raise MiddlewareError(
                    f"'{plugin.name}' cannot be started: {state_of(plugin)}", expected="a plugin that is stopped"
                )
        if switch.start and self._estop:
            raise MiddlewareError(
                f"the emergency stop is tripped: {self._estop.reason}",
                expected=f"`solfer rt estop --clear`, or the service {EXECUTOR}/estop_clear, first",
            )
        self._check_claims(switch)

    def _check_claims(self, switch: Switch) -> None:
        """Check that no joint would be commanded by two plugins that are active, or not at rest yet."""
        if not switch.start:
            return
        others = [
            plugin
            for plugin in self._plugins.values()
            if plugin in switch.start or not (plugin.at_rest or plugin in switch.stop)
        ]
        for one, other in combinations(others, 2):
            common = one.claims & other.claims
            if common:
                controller, field, joint = min(common)
                raise ClaimRefused(
                    f"'{one.name}' and '{other.name}' both command the {field} of joint '{joint}' "
                    f"({len(common)} numbers in common)",
                    where=f"controller '{controller}'",
                    expected="one of them stopped in the same switch",
                )


def state_of(plugin: ManagedPlugin) -> str:
    """Return state and reason of a plugin."""
    return f"{plugin.state.name}: {plugin.reason}" if plugin.reason else plugin.state.name


def _tell(plugin: ManagedPlugin, _: NoFields) -> Answer:
    return Answer(message=state_of(plugin))


def _abort(plugin: ManagedPlugin) -> None:
    if not plugin.active and plugin.state is not PluginState.STOPPING:
        raise MiddlewareError(f"'{plugin.name}' does not run: {state_of(plugin)}", expected="a plugin that runs")
    plugin.abort("by service")
