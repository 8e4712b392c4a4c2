"""The plan of a plugin: what each of its control cycles does, in its order."""

from collections.abc import Iterator
from contextlib import closing

from solfer.cli.plugins import generator_of
from solfer.config import Configuration
from solfer.errors import ConfigError
from solfer.interfaces.declaration import Declaration, TopicOut, full_name
from solfer.pipes import CommandPipe, FeedbackPipe, JointCommandPipe
from solfer.pipes.state_feedback_pipe import StateFeedbackPipe
from solfer.plugins import Plugin
from solfer.plugins.feedback_timeout import FeedbackTimeout
from solfer.plugins.generation.dry_run import DryMiddleware
from solfer.robot import robot_files

Row = tuple[str, ...]
"""Stage, name, topic, what is carried, and what else is done with it."""


def plan_of(configuration: Configuration) -> list[Row]:
    """List the steps of a cycle of a plugin, which is made without a connection.

    Raises:
        SolferError: The robot is not known, or a part of the plugin cannot be made.
        SolferErrors: Several of these.
    """
    files = robot_files(configuration)
    if files is None:
        where = configuration.module.where("robot")
        raise ConfigError("its robot is not known", where=where, expected="`robot.name`, or files")
    outside = DryMiddleware(configuration, files)
    generation = generator_of(configuration)(outside.configuration, outside)
    with closing(generation.plugin()) as plugin:
        return [*_steps(plugin), *_published(plugin, generation.declarations(plugin.component))]


def _steps(plugin: Plugin) -> Iterator[Row]:
    """Yield what is read, computed and sent."""
    component = plugin.component
    for watch in plugin.watches:
        yield "read", watch.feedback.name, watch.feedback.reader.topic, _received(watch.feedback), _watched(watch)
    computed = ["kinematics"] * component.kinematics
    if component.dynamics:
        computed.append("dynamics")
    robot = plugin.robot
    yield "robot", ", ".join(computed) or "nothing", "", f"{robot.size} DoFs", "for all Points that are subscribed"
    yield "component", type(component).__name__, "", "update, send", ""
    for pipe, gate in plugin.outputs.controllers:
        checks = "finite" if gate is None else "blended in at a start, limited, finite, claimed"
        yield "write", pipe.name, pipe.writer.topic, _sent(pipe), checks


def _published(plugin: Plugin, declarations: tuple[Declaration, ...]) -> Iterator[Row]:
    """Yield what the component publishes besides its pipes."""
    for each in declarations:
        if isinstance(each, TopicOut):
            rate = "after each cycle" if each.rate is None else f"{each.rate:g} Hz, in cycles of its own"
            yield "publish", each.name, full_name(plugin.name, each.name), each.interface, rate


def _received(pipe: FeedbackPipe) -> str:
    if not isinstance(pipe, StateFeedbackPipe):
        return "an input of the component"
    state = "measured" if pipe.measures else "desired"
    count = len(pipe.state_fields[0].dofs)
    return f"{state} {', '.join(each.interface for each in pipe.state_fields)} of {count} DoFs"


def _watched(watch: FeedbackTimeout) -> str:
    pipe = watch.feedback
    every = "every message, " if isinstance(pipe, StateFeedbackPipe) and pipe.history is not None else ""
    required = "required, " if pipe.required else ""
    return f"{every}{required}{watch.action} after {watch.timeout:g} s"


def _sent(pipe: CommandPipe) -> str:
    if isinstance(pipe, JointCommandPipe):
        return f"{', '.join(field for field, _ in pipe.fields)} of {len(pipe.dofs)} DoFs"
    return type(pipe.sent).__name__.removesuffix("Message").lower()
