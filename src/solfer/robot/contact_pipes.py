"""Feedbacks that no list names: those of contacts that name a topic in their file."""

from collections.abc import Iterable

from solfer.config import Configuration, Problems
from solfer.config.kinds.contact import ContactFeedbackRecord, ContactTags
from solfer.errors import SolferError
from solfer.model.contacts import ContactRecord, read_contacts
from solfer.robot.description.sources import is_robot_read, require_robot


def contact_pipes(configuration: Configuration, records: Iterable[ContactRecord]) -> tuple[ContactFeedbackRecord, ...]:
    """Make a feedback for each contact that names a topic, if the robot configuration has `contacts: {feedback: true}`.

    Args:
        configuration: One module, merged.
        records: The contacts of its Robot.
    """
    choice = configuration.robot.contacts
    received = records if choice.read and choice.feedback else ()
    return tuple(_pipe(record) for record in received if record.topic is not None)


def contacts_here(configuration: Configuration) -> tuple[ContactRecord, ...]:
    """Read the contacts of a configuration as far as they are known without a master: those in a file.

    Raises:
        SolferError: The file is missing, or does not contain contacts of the robot.
    """
    source = configuration.sources.contacts if configuration.sources else None
    location = source.location if source is not None else None
    robot = configuration.robot
    if location is None or robot is None or not robot.contacts.read or not is_robot_read(configuration):
        return ()
    require_robot(configuration, location)
    return read_contacts(location, robot.name)


def check_contacts(configuration: Configuration, problems: Problems) -> None:
    """Check the file of the contacts, and that it contains all contacts of the pipes.

    Args:
        configuration: One module, merged; parts of it may be missing because of other mistakes.
        problems: Receives the mistakes.
    """
    try:
        records = contacts_here(configuration)
    except SolferError as error:
        mark = configuration.sources.contacts.place()
        problems.put(mark, error.at(str(mark)))
        return
    known = [record.name for record in records]
    for pipe in (*configuration.feedbacks, *configuration.controllers):
        if not isinstance(pipe, ContactTags):
            continue
        if configuration.robot is not None and not configuration.robot.contacts.read:
            problems.add(
                pipe.place("space"),
                f"pipe '{pipe.name}' carries contacts, but the Robot has none",
                "a robot configuration with contacts: {read: true}",
            )
        for name in (pipe.contacts or ()) if known else ():
            if name not in known:
                problems.unknown(pipe.place("names" if pipe.names else "contact"), "contact", name, known)


def _pipe(record: ContactRecord) -> ContactFeedbackRecord:
    made = ContactFeedbackRecord(
        name=record.name, space="CONTACT", interface=record.interface, source=record.topic, message=record.message,
        initialize=record.initialize,
    )  # fmt: skip
    return made.placed_as(record)
