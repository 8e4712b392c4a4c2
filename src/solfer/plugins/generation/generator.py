"""Makes a plugin from a configuration: the Robot, its pipes and the component (Listing 16 of the paper)."""

import json
import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, ClassVar, cast

import numpy as np

from solfer.components import Component
from solfer.config import Configuration, FeedbackRecord, PipeRecord, Problems
from solfer.errors import ComponentError, PipeError, SolferError, UnknownName, located, raise_all, repeats, singles
from solfer.interfaces.declaration import Declaration, Service
from solfer.pipes import CommandPipe, FeedbackPipe, JointCommandPipe, PipeContext, factory
from solfer.pipes.dofs import joint_map
from solfer.plugins.base_jumps import BaseJumps
from solfer.plugins.feedback_timeout import FeedbackTimeout
from solfer.plugins.generation.config_service import answer_at_once, configuration_service
from solfer.plugins.generation.runners import start_line
from solfer.plugins.joint_claim import JointClaim
from solfer.plugins.measured_guard import MeasuredGuard
from solfer.plugins.outputs.command_gate import CommandGate
from solfer.plugins.outputs.following import JointFollowing
from solfer.plugins.outputs.outputs import Outputs
from solfer.plugins.outputs.start_blend import StartBlend
from solfer.plugins.outputs.start_requests import StartRequests, requests_of
from solfer.plugins.peers import Peer, Peers
from solfer.plugins.plugin import Plugin, PluginParts
from solfer.plugins.requests import RequestNotes
from solfer.plugins.sharing.robots import Sharing
from solfer.plugins.tuning import Tuning
from solfer.recording.log import RunDocuments
from solfer.robot import Robot, build
from solfer.robot.contact_pipes import contact_pipes
from solfer.robot.names import RobotNames, check_tags
from solfer.robot.selection import commanded_dofs
from solfer.transport import Inbox, Middleware
from solfer.transport.declared import Publications, bind
from solfer.transport.endpoints import Reader, Writer
from solfer.transport.messages import GAINS
from solfer.transport.middleware import SEED

_LOG = logging.getLogger(__name__)


class Generator:
    """Makes one plugin. Most components need no generator of their own: their declarations name the services to bind.

    A subclass names its `component`, may add `declarations` that the component does not have, and may extend
    `init_callbacks` with communication that a declaration cannot express.

    Args:
        configuration: The plugin's configuration, merged.
        middleware: The middleware of its pipes and services.
        sharing: Robots that the plugins of this process share; None: it is the only one.
    """

    component: ClassVar[type[Component]] = Component
    known: ClassVar[bool] = True
    """Whether the component is known; if not, it is not made, nor are pipes to its ports."""

    def __init__(self, configuration: Configuration, middleware: Middleware, sharing: Sharing | None = None):
        self.configuration = configuration
        self.middleware = middleware
        self.inbox = Inbox()
        self.publications = Publications()
        self.requests = RequestNotes()
        self.tuning: Tuning | None = None
        self.faults: list[SolferError] = []
        self._shared = sharing.robot(configuration) if sharing is not None else None

    def plugin(self) -> Plugin:
        """Build everything; nothing is sent before the plugin's first cycles.

        Raises:
            SolferError: A part of the configured plugin cannot be made.
            SolferErrors: Several of these: all that can be found at once.
        """
        plugin = self.attempt()
        raise_all(self.faults)
        return cast(Plugin, plugin)

    def check(self, whole: bool = True) -> list[SolferError]:
        """Build everything as `attempt` does, release it, and return the faults."""
        plugin = self.attempt(whole)
        if plugin is not None:
            plugin.close()
        return self.faults

    def attempt(self, whole: bool = True) -> Plugin | None:
        """Build everything as far as possible; what cannot be made is noted in `faults`, and then there is no plugin.

        Args:
            whole: Whether the configuration has all its pipes; if not, none is missed.
        """
        robot = self._noted(self.make_robot)
        if robot is None:
            self._noted(self.read_tags)
            return None
        component = self._noted(lambda: self.make_component(robot)) if self.known else None
        pipes = self._noted(lambda: self.make_pipes(robot, component, whole))
        if component is None:
            return None
        self._noted(lambda: self.init_callbacks(component), self.configuration.module.where())
        return None if self.faults else self._noted(lambda: self._assembled(robot, component, *pipes))

    def _noted(self, step: Callable[[], Any], where: str = "") -> Any:
        """Run a step; note its errors, at the place `where` if they have none, and then return None."""
        try:
            return step()
        except SolferError as error:
            error.at(where)
            self.faults += [each for each in singles([error]) if not repeats(each, self.faults)]
        return None

    def _assembled(
        self,
        robot: Robot,
        component: Component,
        watches: list[FeedbackTimeout],
        controllers: list[tuple[CommandPipe, CommandGate | None]],
    ) -> Plugin:
        """Put the parts together."""
        configuration = self.configuration
        self.middleware.serve(component.name, (configuration_service(configuration),), answer_at_once)
        outputs = self.make_outputs(robot, controllers)
        claim = self.make_claim(robot, watches, outputs)
        peers = Peers(configuration.module.name, self._peers(watches, controllers), self.middleware)
        self.requests.requested = peers.note_request
        parts = PluginParts(
            component,
            robot,
            watches,
            outputs=outputs,
            inbox=self.inbox,
            rate=configuration.rate,
            middleware=self.middleware,
            claim=claim,
            peers=peers,
            stall=configuration.module.stall,
            limits=configuration.module.overload,
            jumps=self._jumps(robot, component),
            guard=self._guard(robot),
            publications=self.publications,
            documents=partial(self._documents, robot),
            requests=self.requests,
            tuning=self.tuning,
        )
        return Plugin(parts)

    def _documents(self, robot: Robot) -> RunDocuments:
        """Return the configuration, the description of the robot, the tags, and the seed of a simulated robot."""
        configuration = self.configuration
        files = {"configuration.yaml": configuration.text(), "robot.urdf": robot.description.text}
        if robot.semantics.text:
            files["robot.srdf"] = robot.semantics.text
        texts = {f"{configuration.module.name}/tags": json.dumps(configuration.own_tags())}
        with suppress(UnknownName):  # a robot of hardware has none
            texts["seed"] = str(self.middleware.parameter(SEED))
        return RunDocuments(files, texts)

    def _jumps(self, robot: Robot, component: Component) -> BaseJumps | None:
        """Make what finds jumps of the base; None: the component has no references in the world."""
        module = self.configuration.module
        is_fixed = robot.kinematics.base is None or type(component).move_world is Component.move_world
        return None if is_fixed else BaseJumps(module.name, robot, module.base_jump)

    def _guard(self, robot: Robot) -> MeasuredGuard | None:
        """Make what keeps a failure of the component away from others; None: none of those that share may write."""
        guarded = self._shared is not None and self._shared.guarded
        return MeasuredGuard(self.configuration.module.name, robot) if guarded else None

    def make_robot(self) -> Robot:
        """Build the Robot that the configuration describes."""
        shared = self._shared
        robot = build(self.configuration, self.middleware, shared.first if shared else None, faults=self.faults)
        if shared is not None and shared.first is None:
            shared.first = robot
        return robot

    def make_component(self, robot: Robot) -> Component:
        """Make the component on `robot`, with its tags and flags from the configuration."""
        module = self.configuration.module
        tags = self.read_tags()
        if tags is not None:
            problems = Problems()
            check_tags(tags, RobotNames.of_robot(robot), problems)
            problems.raise_if_any()
        component = self._guarded(lambda: self.component(robot, tags, module.name), "be made")
        component.kinematics = module.kinematics
        component.dynamics = module.dynamics
        component.modify = module.model_change
        component.set_rate(self.configuration.rate)
        return component

    def read_tags(self) -> Any:
        """Read the component's own tags; None if it has none, or is not known."""
        record_of_tags = self.component.Tags
        return self.configuration.tags(record_of_tags) if self.known and record_of_tags is not None else None

    def make_pipes(
        self, robot: Robot, component: Component | None, whole: bool = True
    ) -> tuple[list[FeedbackTimeout], list[tuple[CommandPipe, CommandGate | None]]]:
        """Make the pipes in the order of the configuration; in mode `idle` those to the lower level send nothing.

        Args:
            robot: The Robot.
            component: Has the ports of pipes that carry Robot Points; None: pipes of that kind are left out.
            whole: Whether to require pipes that the plugin cannot do without.
        """
        watches: list[FeedbackTimeout] = []
        controllers: list[tuple[CommandPipe, CommandGate | None]] = []
        errors: list[SolferError] = []
        configuration = self.configuration
        module = self.configuration.module
        gains = [gain for gain in GAINS if gain in robot.command]  # the component's own: pipes add theirs below
        context = PipeContext(
            robot,
            self.middleware,
            configuration.calibrations,
            rate=configuration.rate,
            inputs=component.inputs if component else {},
            outputs=component.outputs if component else {},
            silent=module.silent,
            idle=module.mode == "idle",
            component=module.name,
        )
        for feedback in self._records(robot):
            if component is None and feedback.content.port:
                continue
            try:
                pipe_in = self._feedback(feedback, context)
                watches.append(FeedbackTimeout.from_record(pipe_in, feedback, configuration.rate))
            except SolferError as error:
                errors.append(error.at(feedback.where("source")))
        for record in configuration.controllers:
            if component is None and record.content.port:
                continue
            try:
                pipe = factory.controller(record, context)
                if self._shared is not None:
                    self._shared.command(record, module.name, pipe, self.middleware.now)
            except SolferError as error:
                errors.append(error.at(record.where("sink")))
                continue
            gate = None
            if record.lower_level and self._drives(robot, cast(JointCommandPipe, pipe)):
                gate = CommandGate(
                    module.name, cast(JointCommandPipe, pipe), robot.lower_limits, upper=robot.upper_limits
                )
            controllers.append((pipe, gate))
        feedbacks = [watch.feedback for watch in watches]
        if whole:
            errors += self._open_inputs(component) if component else ()
            errors += self._unsent(gains)
            errors += self._without_base() if component is not None and component.needs_base() else ()
            if component is not None:
                errors += self._without_effort(robot, component.efforts, [pipe for pipe, _ in controllers])
            if len(feedbacks) == len(self._records(robot)) and any(gate for _, gate in controllers):
                errors += self._require_state(robot, feedbacks)
        errors += self._shared_topics(robot, feedbacks, [pipe for pipe, _ in controllers])
        raise_all(errors)
        return watches, controllers

    @staticmethod
    def _drives(robot: Robot, pipe: JointCommandPipe) -> bool:
        """Return whether a pipe commands a drive; the floating base alone has none."""
        return bool(np.isin(pipe.dofs, robot.actuated).any())

    def _peers(
        self, watches: Sequence[FeedbackTimeout], controllers: Sequence[tuple[CommandPipe, CommandGate | None]]
    ) -> list[Peer]:
        """List the peers of the pipes; those of required feedbacks and of pipes to the lower level are needed.

        Topics that a plugin of a real-time layer publishes to the outside are left out: the bridge subscribes them.
        """
        records = {record.name: record for record in self.configuration.controllers}
        peers = [Peer(watch.feedback, watch.where, watch.feedback.required) for watch in watches]
        for pipe, gate in controllers:
            record = records[pipe.name]
            if record.layer != "NRT":
                peers.append(Peer(pipe, record.where("sink"), gate is not None))
        return peers

    def _feedback(self, record: FeedbackRecord, context: PipeContext) -> FeedbackPipe:
        if self._shared is not None and not record.of_plugins:
            return self._shared.feedback(record, self.configuration, context)
        return factory.feedback(record, context)

    def make_outputs(self, robot: Robot, controllers: Sequence[tuple[CommandPipe, CommandGate | None]]) -> Outputs:
        """Make the outputs of the component's commands from its `controllers`; see `make_pipes`."""
        module = self.configuration.module
        pipes = [cast(JointCommandPipe, pipe) for pipe, gate in controllers if gate is not None]
        measured = {each: self._measured(robot, each) for each in ("position", "velocity", "effort")}
        blend = StartBlend(
            module.name,
            pipes,
            robot,
            rate=self.configuration.rate,
            shortest=module.blend,
            measured=measured["position"],
            efforts=measured["effort"],
        )
        period = 1.0 / self.configuration.rate
        if module.mode == "idle":
            return Outputs(controllers, blend, robot, period=period, idle=True)
        commanding = [record for record in self.configuration.controllers if record.lower_level]
        requests = tuple(requests_of(commanding, self.configuration.sources.controller))
        return Outputs(
            controllers,
            blend,
            robot,
            period=period,
            requests=StartRequests(module.name, self.middleware, requests),
            following=JointFollowing(module.name, pipes, robot, measured=measured),
        )

    def make_claim(self, robot: Robot, watches: Sequence[FeedbackTimeout], outputs: Outputs) -> JointClaim:
        """Make the claim on the joints that the plugin commands, with the topics of other plugins that it follows."""
        of_others = {record.name for record in self._records(robot) if record.of_plugins}
        follows = [watch.feedback.reader.topic for watch in watches if watch.feedback.name in of_others]
        publishes = [pipe.writer.topic for pipe, gate in outputs.controllers if gate is None]
        measured = self._measured(robot, "position")
        return JointClaim(
            self.configuration.module.name,
            outputs.commanding,
            self.middleware,
            follows=follows,
            publishes=publishes,
            position=lambda: np.where(measured, robot.state.position, np.nan),
        )

    def _measured(self, robot: Robot, interface: str) -> np.ndarray:
        """Find the DoFs with a received `interface` of the measured State, as flags of shape (robot.size,)."""
        measured = np.zeros(robot.size, dtype=bool)
        for record in self.configuration.feedbacks:
            if record.measures_joints and getattr(record.interface, interface):
                measured[joint_map(record.dofs, record.dofs.mapping, robot, pipe=record.name).robot_indices] = True
        return measured

    def _records(self, robot: Robot) -> tuple[FeedbackRecord, ...]:
        """List the feedbacks of the configuration, then those of contacts, which need the state of joints and base."""
        return (*self.configuration.feedbacks, *contact_pipes(self.configuration, robot.contact_records))

    def _open_inputs(self, component: Component) -> list[SolferError]:
        """Return an error for each required input of the component that no pipe of the configuration feeds."""
        received = {record.name for record in self.configuration.feedbacks if record.content.port}
        return [
            PipeError(
                f"no pipe feeds the input '{name}' of plugin '{component.name}'",
                where=self.configuration.module.where("robot"),
                expected=f"a feedback '{name}' of the space POINT or POINTS, quantity {port.quantity}",
            )
            for name, port in component.inputs.items()
            if port.required and name not in received
        ]

    def _without_base(self) -> list[SolferError]:
        """Return an error if no feedback measures the floating base: it would count as upright and at rest."""
        feedbacks = [each for each in self.configuration.feedbacks if each.measures]
        if any(each.content.body or each.dofs.chain == "base" for each in feedbacks):
            return []
        module = self.configuration.module
        what = f"plugin '{module.name}' needs its floating base, and no feedback measures it"
        return [PipeError(what, where=module.where("robot"), expected="a robot with a feedback of its base, or an IMU")]

    def _unsent(self, gains: Sequence[str]) -> list[SolferError]:
        """Return an error for each gain that the component commands and no pipe carries."""
        carried = {
            name for record in self.configuration.controllers if record.content.joints for name in record.carried
        }
        module = self.configuration.module
        return [
            PipeError(
                f"plugin '{module.name}' commands the {gain} of joints, and no controller carries it",
                where=module.where("controller"),
                expected=f"a controller with `interface: {{{gain}: true}}`",
            )
            for gain in gains
            if gain not in carried
        ]

    def _without_effort(self, robot: Robot, efforts: np.ndarray, pipes: Sequence[CommandPipe]) -> list[SolferError]:
        """Return an error if the component commands the effort of DoFs, shape (m,), that no pipe carries.

        A plugin without any pipe commands nothing: it computes alone.
        """
        carried = [pipe.dofs for pipe in pipes if isinstance(pipe, JointCommandPipe) and "effort" in pipe.message.rows]
        missing = np.setdiff1d(efforts, np.concatenate(carried) if carried else ())
        if not len(missing) or not pipes:
            return []
        more = f" and of {len(missing) - 1} more" if len(missing) > 1 else ""
        module = self.configuration.module
        return [
            PipeError(
                f"plugin '{module.name}' commands the effort of '{robot.dofs[missing[0]]}'{more}, "
                "and no controller carries it",
                where=module.where("controller"),
                expected="a controller with `interface: {effort: true}`, or joints without a drive",
            )
        ]

    def _shared_topics(
        self, robot: Robot, feedbacks: Sequence[FeedbackPipe], commands: Sequence[CommandPipe]
    ) -> list[SolferError]:
        """Return an error for each topic that two pipes publish, or that two pipes expect other messages on."""
        records: dict[str, PipeRecord] = {record.name: record for record in self._records(robot)}
        ends: list[tuple[Reader | Writer, str, str, bool]]
        ends = [(pipe.reader, records[pipe.name].where("source"), pipe.name, False) for pipe in feedbacks]
        records |= {record.name: record for record in self.configuration.controllers}
        ends += [(pipe.writer, records[pipe.name].where("sink"), pipe.name, True) for pipe in commands]
        errors: list[SolferError] = []
        first: dict[str, tuple[str, str, bool]] = {}
        for end, where, name, sends in ends:
            topic = end.topic.lstrip("/")
            other, carries, sent = first.setdefault(topic, (name, end.carries, sends))
            if sends and sent and other != name:
                what = f"the pipes '{other}' and '{name}' both publish the topic '{topic}'"
                errors.append(PipeError(what, where=where, expected="a topic for each of them"))
            elif "" not in (carries, end.carries) and carries != end.carries:
                what = f"the pipe '{name}' expects {end.carries} on the topic '{topic}', '{other}' expects {carries}"
                errors.append(PipeError(what, where=where, expected="one message on each topic"))
        return errors

    def _require_state(self, robot: Robot, feedbacks: list[FeedbackPipe]) -> list[SolferError]:
        """Require a State before the plugin commands: the feedbacks marked to initialise, else all States.

        Those of joints that are commanded are required in any case: a joint that is not measured would be driven from
        zero. Motors are not enough: only the link side measures where the joints are.
        """
        module = self.configuration.module
        joints_or_base = (each for each in self.configuration.feedbacks if each.content.measures)
        link_side = {record.name for record in joints_or_base if record.function != "motor"}
        states = [each for each in feedbacks if each.name in link_side]
        if not states:
            what = f"plugin '{module.name}' commands a robot but receives no state of it"
            return [PipeError(what, where=module.where("robot"), expected="a robot configuration with a feedback")]
        if not any(feedback.required for feedback in states):
            for feedback in states:
                feedback.required = True
        return self._unmeasured(robot, {each.name: each for each in states})

    def _unmeasured(self, robot: Robot, states: dict[str, FeedbackPipe]) -> list[SolferError]:
        """Require the feedbacks of commanded joints; return an error for each pipe that commands others, too."""
        errors: list[SolferError] = []
        records = [] if self.configuration.module.mode == "idle" else self.configuration.controllers
        for record in records:
            missing = commanded_dofs(record, robot)
            for feedback in self.configuration.feedbacks:
                if feedback.measures_joints and (feedback.interface.position or record.carried == ("velocity",)):
                    mapped = joint_map(feedback.dofs, feedback.dofs.mapping, robot, pipe=feedback.name).robot_indices
                    if np.isin(missing, mapped).any():
                        states[feedback.name].require(missing)
                    missing = np.setdiff1d(missing, mapped)
            if len(missing):
                names = ", ".join(robot.dofs[dof] for dof in missing)
                what = f"the pipe '{record.name}' commands joints that no feedback measures: {names}"
                expected = "a feedback of their position, other `dofs`, or `open_loop: true` in a pipe of their own"
                errors.append(PipeError(what, where=record.where("dofs"), expected=expected))
        return errors

    def init_callbacks(self, component: Component) -> None:
        """Bind what the component declares to the middleware: services, topics, actions and parameters, live or not."""
        component.clock = self.middleware.stamp_time
        declared = tuple(self.requests.noted(each) for each in self.declarations(component))
        self.publications = bind(
            component.name, declared, self.middleware, inbox=self.inbox, rate=self.configuration.rate
        )
        tuning = self._guarded(lambda: Tuning(component, component.live_parameters()), "list its live parameters")
        self.tuning = tuning
        setting = cast(Service, self.requests.noted(tuning.setting()))
        first = self.middleware.first_values(component.name)
        if first:
            self.requests.enabled = True  # a replay repeats it
            tuning.begin(setting, first)
            self.requests.enabled = False
        self.middleware.serve(component.name, (setting,), self.inbox.submit_one_by_one)
        self.middleware.serve(component.name, (tuning.getting(),), answer_at_once)

    def declarations(self, component: Component) -> tuple[Declaration, ...]:
        """List what the component declares; a subclass may add declarations of its own."""
        return (
            *self._guarded(lambda: tuple(component.services()), "list its services"),
            *self._guarded(lambda: tuple(component.topics()), "list its topics"),
            *self._guarded(lambda: tuple(component.actions()), "list its actions"),
            *self._guarded(lambda: tuple(component.parameters()), "list its parameters"),
        )

    def _guarded(self, step: Callable[[], Any], what: str) -> Any:
        """Run a step of the component, and return its result.

        Raises:
            SolferError: The component raised it, or failed in another way; nothing was sent.
        """
        try:
            return step()
        except SolferError:
            raise
        except BaseException as error:
            module = self.configuration.module
            name = self.component.__name__
            raise ComponentError(
                f"the component {name} of '{module.name}' cannot {what}: {located(error)}",
                where=module.where(),
                expected="a component without mistakes in its own code",
            ) from error


class UnknownComponent(Generator):
    """Generates all of a plugin but its component, which is not there, or cannot be used."""

    known = False


def generate(
    configuration: Configuration, middleware: Middleware, generator: type[Generator], sharing: Sharing | None = None
) -> Plugin:
    """Make the plugin of a configuration with a `generator` (see `Registry.find`)."""
    plugin = generator(configuration, middleware, sharing).plugin()
    log_start(configuration, plugin)
    return plugin


def log_start(configuration: Configuration, plugin: Plugin) -> None:
    """Log what starts, in one line, and warnings of the component's own tags."""
    problems = Problems()
    if plugin.component.Tags is not None:
        configuration.read_tags(plugin.component.Tags, problems)
    problems.log(_LOG)
    _LOG.info("%s", start_line(configuration, type(plugin.component).__name__))
