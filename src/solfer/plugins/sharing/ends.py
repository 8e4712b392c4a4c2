"""The ends of the shared space: publishers, and whether those that receive from them can use it."""

from collections.abc import Callable, Iterable, Sequence

from solfer.config import Configuration
from solfer.errors import SolferError, raise_all
from solfer.pipes import CommandPipe, FeedbackPipe
from solfer.plugins.sharing.space import SharedTopic, SpaceChannel
from solfer.transport.messages import canonical


def publications(configuration: Configuration, resolve: Callable[[str], str]) -> list[SharedTopic]:
    """List the pipes of a plugin that publish to other plugins: all but those to the lower level.

    Args:
        configuration: The plugin's configuration.
        resolve: See `Middleware.resolve`.
    """
    module = configuration.module
    found = list[SharedTopic]()
    if module.silent:
        return []
    for record in configuration.controllers:
        if record.sink is not None and not record.lower_level:
            where = record.where("sink")
            message = canonical(record.travels_as, record.where("message"))
            found.append(SharedTopic(module.name, resolve(record.sink), message, where=where))
    return found


def check_ends(feedbacks: Iterable[tuple[FeedbackPipe, str]], commands: Sequence[CommandPipe]) -> None:
    """Check that each pipe that receives from the shared space can use what is sent there.

    Args:
        feedbacks: Pipes of all components that receive, each with the place of its topic in the configuration.
        commands: Pipes of all components that publish.

    Raises:
        SolferError: Two ends do not fit, with the places of both; SolferErrors: several do not.
    """
    senders = {id(channel): pipe for pipe in commands if (channel := getattr(pipe.writer, "channel", None)) is not None}
    errors: list[SolferError] = []
    for pipe, where in feedbacks:
        channel = getattr(pipe.reader, "channel", None)
        if not isinstance(channel, SpaceChannel) or channel.message is None:
            continue
        sender = senders.get(id(channel))
        try:
            pipe.check_fit(channel.message, "" if sender is None else sender.quantity)
        except SolferError as error:
            topic = channel.publication
            sent = ", ".join(filter(None, (topic.topic, topic.where)))
            error.what = f"feedback '{pipe.name}' does not fit what '{topic.component}' sends ({sent}): {error.what}"
            errors.append(error.at(where))
    raise_all(errors)
