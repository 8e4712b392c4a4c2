"""The states of a plugin's life, the same on every middleware.

They stand here, and not where plugins do, because they travel: in the statistics of a real-time layer, which are read
without a component.
"""

import enum

SAFE_STOP = "safe stop"
"""How the reason begins for which a layer aborts its plugins where cycles took too long."""


class PluginState(enum.IntEnum):
    """State of a plugin's life.

    CONFIGURED: made from its configuration. INITIALIZED: admitted to a loop, not started yet. STARTING: waits for
    feedback or joints, then blends in from the measured state. RUNNING. STOPPING: the robot is at rest, the joints are
    being released. STOPPED. ABORTED: it failed, was too slow or was aborted by request; the robot holds, and it may be
    started again. FAULT: it could not even hold, or close; it does not run again. CLOSED: its resources are released.
    """

    CONFIGURED = 0
    INITIALIZED = 1
    STARTING = 2
    RUNNING = 3
    STOPPING = 4
    STOPPED = 5
    ABORTED = 6
    FAULT = 7
    CLOSED = 8


ACTIVE = frozenset({PluginState.STARTING, PluginState.RUNNING})
FAILED_STATES = frozenset({PluginState.ABORTED, PluginState.FAULT})
STARTABLE = frozenset({PluginState.CONFIGURED, PluginState.INITIALIZED, PluginState.STOPPED, PluginState.ABORTED})
RESTING_STATES = frozenset(PluginState) - ACTIVE - {PluginState.STOPPING}
