"""Several plugins in one loop on the virtual clock of the memory middleware."""

from types import SimpleNamespace

from support.unit.joint_pipes import RATE, make_robot

from solfer.components import Component
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Plugin, PluginParts, PluginSet
from solfer.plugins.life.plugin_set import NOTHING
from solfer.plugins.outputs.outputs import Outputs
from solfer.plugins.outputs.start_blend import StartBlend
from solfer.plugins.timing.loop import PluginLoop
from solfer.transport import Inbox

PERIOD = 1.0 / RATE


class Counted(Component):
    """Counts its steps, takes a given time, and fails at a given step."""

    def __init__(self, robot, name, several):
        super().__init__(robot, name=name)
        self._several, self._fails = several, ("", 0)
        self.inits = self.updates = self.resets = self.stops = 0
        self.lasts = 0.0  # [s]

    def fail_in(self, step, after):
        """Fail once in a step, when so many updates were made."""
        self._fails = step, after

    def _reach(self, step):
        if self._fails[0] == step and self.updates >= self._fails[1]:
            self._fails = "", 0
            raise RuntimeError(f"{self.name} fails in {step}")

    def init(self):
        self._reach("init")
        self.inits += 1

    def update(self):
        self._reach("update")
        self.updates += 1
        self._several.order.append(self.name)
        self._several.worked += round(1e9 * self.lasts)

    def send(self):
        self._reach("send")

    def reset(self):
        self.resets += 1

    def stop(self):
        self._reach("stop")
        self.stops += 1


class Several:
    """Plugins that need no feedback, in one loop of the node `shared`.

    Args:
        names: Names of the plugins.
        commanding: The joint that a plugin commands the velocity of, by its name.
        budget, requires: As in `PluginSet`.

    Attributes:
        order: Names of the components, one for each update.
        answers: Answers to what `at` calls.
        worked: Time of all components so far [ns].
    """

    def __init__(self, names=("one", "two", "three"), commanding=None, budget=None, requires=NOTHING):
        self.bus, self.order, self.answers, self.worked = Bus(), [], [], 0
        self._middleware, self._calls, self._round = MemoryMiddleware(self.bus, "shared"), {}, 0
        self.components = [Counted(make_robot(), name, self) for name in names]
        self.plugins = [
            self._plugin(component, (commanding or {}).get(component.name)) for component in self.components
        ]
        self.set = PluginSet(self.plugins, budget, nanoseconds=self._nanoseconds, polls=[self._poll], requires=requires)

    def at(self, cycle, service, **fields):
        """Call a service at the beginning of a cycle."""
        self._calls[cycle] = service, fields

    def ask(self, service, **fields):
        """Call a service now."""
        return self.bus.call(service, **fields)

    def run(self, cycles):
        """Run the loop for so many cycles, or until it ends by itself."""
        self.bus.every((cycles - 0.5) * PERIOD, self._end)
        PluginLoop(self.set, self._middleware).run()
        self.answers = [answer.result() for answer in self.answers]

    def _end(self):
        self.bus.ended = self.bus.time > 0.0

    def _nanoseconds(self):
        return round(1e9 * self.bus.time) + self.worked

    def _poll(self):
        if self._round in self._calls:
            service, fields = self._calls[self._round]
            self.answers.append(self.ask(service, **fields))
        self._round += 1

    def _plugin(self, component, joint):
        robot = component.model
        outputs = Outputs([], StartBlend(component.name, (), robot, RATE), robot, 1.0 / RATE)
        if joint is not None:
            outputs.commanding = (
                SimpleNamespace(controller="wheels", fields=[("velocity", None)], sent=SimpleNamespace(names=(joint,))),
            )
        return Plugin(PluginParts(component, robot, (), outputs, Inbox(), RATE, self._middleware))
