"""Makes pipes that carry the wrenches of the Robot's contacts."""

from solfer.config.contacts import ContactControllerRecord, ContactFeedbackRecord, ContactTags
from solfer.errors import PipeError, SolferError
from solfer.pipes.contact import ContactController, ContactFeedback
from solfer.pipes.messages import POINTS
from solfer.pipes.surroundings import Surroundings, message_of
from solfer.points.contacts import Contact

WRENCH = "geometry_msgs/WrenchStamped"
"""Message of a single contact."""


def feedback(record: ContactFeedbackRecord, surroundings: Surroundings) -> ContactFeedback:
    """Wrenches from a topic to contacts of the Robot; see `factory.feedback`."""
    contacts, names = _contacts(record, surroundings)
    # a pipe that names no contacts takes those of its Robot, whatever is told about other parts of it
    known = None if record.names is None else surroundings.robot.contacts.names
    return ContactFeedback(
        record.name,
        surroundings.middleware.reader(record.source, _message(record)),
        surroundings.robot,
        contacts,
        record.interface == "fixed",
        names,
        record.initialize,
        known,
    )


def controller(record: ContactControllerRecord, surroundings: Surroundings) -> ContactController:
    """Wrenches of contacts of the Robot to a topic; see `factory.controller`."""
    contacts, names = _contacts(record, surroundings)
    writer = surroundings.writer(record.sink, _message(record))
    return ContactController(record.name, writer, surroundings.robot, contacts, record.interface == "fixed", names)


def _message(record: ContactTags) -> str:
    message, what = (POINTS, "wrenches of contacts") if record.space == "CONTACTS" else (WRENCH, "wrench of a contact")
    return message_of(record, message, (message,), what)


def _contacts(record: ContactTags, surroundings: Surroundings) -> tuple[tuple[Contact, ...], tuple[str, ...] | None]:
    """The contacts that a pipe is about, and their names for a message of several."""
    found = surroundings.robot.contacts
    if not found.names:
        raise PipeError(f"pipe '{record.name}' is about contacts, and the Robot has none", where=record.where("space"),
                        expected="a robot configuration with contacts: {read: true}")
    names = found.names if record.contacts is None else record.contacts
    key = "names" if record.space == "CONTACTS" else "contact"
    try:
        return tuple(found[name] for name in names), names if record.space == "CONTACTS" else None
    except SolferError as error:
        raise error.at(record.where(key)) from None
