"""Makes a plugin of a configuration: the Robot, its pipes and the component (Listing 16 of the paper)."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from solfer.components import Component
from solfer.config import Configuration, FeedbackRecord
from solfer.errors import PipeError, SolferError, raise_all
from solfer.pipes import Controller, Feedback, Inbox, Middleware, StateFeedback, Surroundings, factory
from solfer.pipes.dofs import joint_map
from solfer.plugins.blend import Blend
from solfer.plugins.claim import Claim
from solfer.plugins.inspection import answer_at_once, configuration_service
from solfer.plugins.outputs import Outputs
from solfer.plugins.plugin import Plugin
from solfer.plugins.safety import Gate
from solfer.plugins.sharing import Sharing, measures
from solfer.plugins.watch import Watch
from solfer.robot import Robot, build
from solfer.robot.contact_pipes import contact_pipes


class Generator:
    """Makes one plugin. Most components need no generator of their own: their declarations say what to bind.

    A subclass names its `component` and may extend `init_callbacks` with communication that a declaration cannot
    express.

    Args:
        configuration: The plugin's configuration, merged.
        middleware: The way to the outside.
        sharing: What the plugins of this process have in common; None: it is the only one.
    """

    component: ClassVar[type[Component]] = Component

    def __init__(self, configuration: Configuration, middleware: Middleware, sharing: Sharing | None = None):
        self.configuration, self.middleware = configuration, middleware
        self.inbox = Inbox()
        self._group = sharing.group(configuration) if sharing is not None else None

    def plugin(self) -> Plugin:
        """Build everything; nothing is sent before the plugin's first cycles.

        Raises:
            SolferError: What the configuration asks for cannot be made; all faults of the pipes at once.
        """
        configuration = self.configuration
        robot = self.make_robot()
        component = self.make_component(robot)
        watches, controllers = self.make_pipes(robot, component)
        self.init_callbacks(component)
        self.middleware.serve(component.name, (configuration_service(configuration),), answer_at_once)
        outputs = self.make_outputs(robot, controllers)
        claim = Claim(configuration.module.name, outputs.commanding, self.middleware)
        return Plugin(component, robot, watches, outputs, self.inbox, configuration.rate, self.middleware, claim)

    def make_robot(self) -> Robot:
        """The Robot that the configuration describes."""
        if self._group is None:
            return build(self.configuration, self.middleware)
        robot = build(self.configuration, self.middleware, self._group.first)
        if not self._group.join(self.configuration.module.name, robot):
            self._group = None
        return robot

    def make_component(self, robot: Robot) -> Component:
        """The component on `robot`, with its tags and flags from the configuration."""
        module, tags = self.configuration.module, None
        if self.component.Tags is not None:
            tags = self.configuration.tags(self.component.Tags)
        component = self.component(robot, tags, module.name)
        component.kinematics, component.dynamics = module.kinematics, module.dynamics
        component.modify = module.model_change
        component.set_rate(self.configuration.rate)
        return component

    def make_pipes(
        self, robot: Robot, component: Component
    ) -> tuple[list[Watch], list[tuple[Controller, Gate | None]]]:
        """The pipes in the order of the configuration. In mode `idle` those to the lower level lead nowhere."""
        watches, controllers, errors = [], [], []
        configuration, module = self.configuration, self.configuration.module
        surroundings = Surroundings(robot, self.middleware, configuration.calibrations, configuration.rate,
                                    component.inputs, component.outputs, module.silent, module.mode == "idle")
        for record in self._records(robot):
            try:
                watches.append(Watch.of(self._feedback(record, surroundings), record, configuration.rate))
            except SolferError as error:
                errors.append(error)
        for record in configuration.controllers:
            try:
                pipe = factory.controller(record, surroundings)
            except SolferError as error:
                errors.append(error)
                continue
            gate = Gate(module.name, pipe, robot.lower_limits, robot.upper_limits) if record.lower_level else None
            controllers.append((pipe, gate))
        raise_all([*errors, *self._open_inputs(component)])
        if any(gate for _, gate in controllers):
            self._require_state([watch.feedback for watch in watches])
        return watches, controllers

    def _feedback(self, record: FeedbackRecord, surroundings: Surroundings) -> Feedback:
        if self._group is not None and measures(record):
            return self._group.feedback(record, surroundings)
        return factory.feedback(record, surroundings)

    def make_outputs(self, robot: Robot, controllers: Sequence[tuple[Controller, Gate | None]]) -> Outputs:
        """What becomes of what the component wants; see `make_pipes`."""
        module = self.configuration.module
        pipes = [pipe for pipe, gate in controllers if gate is not None]
        blend = Blend(module.name, pipes, robot, self.configuration.rate, module.blend, self._measured(robot))
        return Outputs(controllers, blend, robot, module.mode == "idle")

    def _measured(self, robot: Robot) -> np.ndarray:
        """Whether the position of each DoF is heard, shape (robot.size,)."""
        measured = np.zeros(robot.size, dtype=bool)
        for record in self.configuration.feedbacks:
            if record.space == "JOINT" and record.function == "state" and record.interface.position:
                measured[joint_map(record.dofs, record.dofs.mapping, robot, record.name).robot_indices] = True
        return measured

    def _records(self, robot: Robot) -> tuple[FeedbackRecord, ...]:
        """Feedbacks of the configuration, then those of contacts: where these are is known when joints and base are."""
        return (*self.configuration.feedbacks, *contact_pipes(self.configuration, robot.contact_records))

    def _open_inputs(self, component: Component) -> list[SolferError]:
        """Faults: inputs that the component cannot work without, and that no pipe of the configuration feeds."""
        heard = {record.name for record in self.configuration.feedbacks if record.space in ("POINT", "POINTS")}
        return [
            PipeError(
                f"no pipe feeds the input '{name}' of plugin '{component.name}'",
                where=self.configuration.module.where("robot"),
                expected=f"a feedback '{name}' of the space POINT or POINTS, quantity {port.quantity}",
            )
            for name, port in component.inputs.items()
            if port.required and name not in heard
        ]

    def _require_state(self, feedbacks: list[Feedback]) -> None:
        """Who commands a robot has to hear something first: what is marked to initialise, else all States.

        Motors are not enough: where the joints are is told on the link side.
        """
        module = self.configuration.module
        motors = {record.name for record in self.configuration.feedbacks if record.function == "motor"}
        states = [each for each in feedbacks if isinstance(each, StateFeedback) and each.name not in motors]
        if not states:
            raise PipeError(
                f"plugin '{module.name}' commands a robot that it does not hear",
                where=module.where("robot"),
                expected="a robot configuration with a feedback",
            )
        if not any(feedback.required for feedback in states):
            for feedback in states:
                feedback.required = True

    def init_callbacks(self, component: Component) -> None:
        """Bind what the component offers to the outside."""
        self.middleware.serve(component.name, component.services(), self.inbox.submit)


def generate(
    configuration: Configuration, middleware: Middleware, generator: type[Generator], sharing: Sharing | None = None
) -> Plugin:
    """The plugin of a configuration, made by `generator` (see `Registry.find`)."""
    return generator(configuration, middleware, sharing).plugin()
