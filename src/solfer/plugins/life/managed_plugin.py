"""A plugin and its life, the same on every middleware."""

from collections.abc import Callable, Sequence

from solfer.errors import ComponentError, described, located
from solfer.plugins.plugin import Plugin
from solfer.transport.health import Health
from solfer.transport.plugin_state import ACTIVE, FAILED_STATES, RESTING_STATES, PluginState


class ManagedPlugin:
    """A plugin and its life. None of its methods raises: any exception of the plugin ends its run.

    Requests to end the process come by a signal, which raises nothing here (`process.ProcessEnd`, rospy): a
    SystemExit or a KeyboardInterrupt is a component's own.

    Args:
        plugin: The plugin.
        blend: Shortest time in which its commands blend in at each start [s]; None: that of its configuration.

    Attributes:
        state: State of its life.
        reason: Why it is in this state, where that is not plain; else empty.
        failure: What ended its run; None: it did not fail, or was started again, or was aborted by request.
        starts, aborts: How often it was started and aborted.
        changed: Called after each change of state or reason.
    """

    def __init__(self, plugin: Plugin, blend: float | None = None):
        self.plugin = plugin
        self.state = PluginState.CONFIGURED
        self.reason = ""
        self.failure: BaseException | None = None
        self.starts = self.aborts = 0
        self.changed: Callable[[ManagedPlugin], None] = lambda _: None
        self._before: tuple[ManagedPlugin, ...] = ()
        if blend is not None:
            plugin.blend_in(blend)

    @property
    def name(self) -> str:
        """Name of the plugin."""
        return self.plugin.name

    @property
    def active(self) -> bool:
        """Whether it starts or runs."""
        return self.state in ACTIVE

    @property
    def at_rest(self) -> bool:
        """Whether it sends no commands."""
        return self.state in RESTING_STATES

    @property
    def explanation(self) -> str:
        """State and reason."""
        return f"{self.state.name}: {self.reason}" if self.reason else self.state.name

    def health(self) -> tuple[Health, str]:
        """Return the health since the last call, and one sentence."""
        return (Health.ERROR, self.explanation) if self.state in FAILED_STATES else self.plugin.health()

    def initialize(self) -> None:
        """Get ready to be started; sends nothing."""
        self._try(self.plugin.stop, PluginState.INITIALIZED)

    def start(self, after: Sequence["ManagedPlugin"] = ()) -> None:
        """Start as soon as the plugins of `after` are at rest; one that is new starts with what it has received."""
        new = self.state is PluginState.CONFIGURED
        self.starts += 1
        self.failure = None
        self._before = tuple(after)
        self._go(PluginState.STARTING)
        if not (self._before or new):
            self._try(self.plugin.restart, PluginState.STARTING)

    def stop(self, reason: str = "") -> None:
        """Bring the robot to rest, and release the joints; `reason`: why, without a request."""
        self._before = ()
        self._try(self.plugin.stop, PluginState.STOPPING, reason)

    def abort(self, reason: str, failure: BaseException | None = None) -> None:
        """Hold at once, without calling the component; `failure`: what its run failed with, None: it is a request."""
        self.aborts += 1
        self._before = ()
        self.failure = failure
        try:
            self.plugin.abort()
        except BaseException as error:
            self.failure = failure or error
            self._go(PluginState.FAULT, f"{reason}; and it cannot hold: {described(error)}")
        else:
            self._go(PluginState.ABORTED, reason)

    def close(self) -> None:
        """Stop if it is active, then release its resources."""
        if self.active:
            self.stop()
        try:
            self.plugin.close()
        except BaseException as error:
            self.failure = self.failure or error
            self._go(PluginState.FAULT, f"it cannot be closed: {located(error)}")
        else:
            if self.state not in FAILED_STATES:
                self._go(PluginState.CLOSED)

    def cycle(self) -> None:
        """Run one control cycle; a plugin that does not run only answers calls."""
        if self._before:
            if not all(other.at_rest for other in self._before):
                return
            self._before = ()
            self._try(self.plugin.restart, PluginState.STARTING)
        try:
            self.plugin.cycle()
        except BaseException as error:
            self.abort(located(error), error)
        else:
            self.follow()

    def follow(self) -> None:
        """Follow what the plugin has become in its newest cycle."""
        if self.state is RUNNING:
            if self.plugin.life is not RUNNING:
                self._go(STARTING, self.plugin.health()[1])
            elif self.reason != self.plugin.overload.reason:
                self._go(RUNNING, self.plugin.overload.reason)
        elif self.state is STARTING:
            if self.plugin.running and not self.plugin.outputs.blending:
                self._go(RUNNING)
        elif self.state is STOPPING and self.plugin.released:
            self._go(PluginState.STOPPED, self.reason)

    def too_slow(self, reason: str) -> None:
        """Abort since it exceeds its budget."""
        self.abort(reason, ComponentError(reason, expected="a component that keeps its share of the period"))

    def _try(self, step: Callable[[], None], state: PluginState, reason: str = "") -> None:
        """Run a step to another state; abort if it fails."""
        try:
            step()
        except BaseException as error:
            self.abort(located(error), error)
        else:
            self._go(state, reason)

    def _go(self, state: PluginState, reason: str = "") -> None:
        if state is not self.state or reason != self.reason:
            self.state = state
            self.reason = reason
            self.changed(self)


# module globals: the lookup in the control cycle is several times as fast as on the class
STARTING = PluginState.STARTING
RUNNING = PluginState.RUNNING
STOPPING = PluginState.STOPPING
