"""The ends of the shared space: publishers, and whether those that receive from them can use it."""

from collections.abc import Callable, Iterable, Iterator, Sequence

from solfer.config import Configuration, FeedbackRecord, SharedPlugin
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


def early_readers(
    listed: Sequence[SharedPlugin], resolve: Callable[[str], str]
) -> Iterator[tuple[SharedPlugin, FeedbackRecord, str]]:
    """Yield plugins of shared plugins that read what a later one of the list publishes, and might come behind it.

    Where two need each other, directly or by others, one of them comes first in any order. References may be those of
    the cycle before, as in Listing 17 of the paper.

    Args:
        listed: The plugins, in the order of their cycles.
        resolve: See `Middleware.resolve`.

    Yields:
        The plugin that reads, its pipe, and the name of the one that publishes.
    """
    publisher = {
        (each.group, topic.topic): each.name for each in listed for topic in publications(each.configuration, resolve)
    }
    sources: dict[str, list[tuple[FeedbackRecord, str]]] = {each.name: [] for each in listed}
    for each in listed:
        for record in each.configuration.feedbacks if each.group else ():
            source = publisher.get((each.group, resolve(record.source or "")), each.name)
            if source != each.name and record.function != "reference":
                sources[each.name].append((record, source))
    done = set[str]()
    for each in listed:
        done.add(each.name)
        for record, source in sources[each.name]:
            if source not in done and each.name not in _needed(source, sources):
                yield each, record, source


def _needed(name: str, sources: dict[str, list[tuple[FeedbackRecord, str]]]) -> set[str]:
    """Return the names of all that a plugin reads from, directly or by others."""
    found = [name]
    for one in found:  # grows while it is walked
        found += [source for _, source in sources[one] if source not in found]
    return set(found)


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
