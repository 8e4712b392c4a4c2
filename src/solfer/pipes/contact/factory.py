"""Makes pipes that carry the wrenches of the Robot's contacts."""

from solfer.config.kinds.contact import ContactControllerRecord, ContactFeedbackRecord
from solfer.errors import PipeError, SolferError
from solfer.pipes.contact.pipes import ContactCommandPipe, ContactFeedbackPipe
from solfer.pipes.context import PipeContext, message_of
from solfer.points.contact.contacts import Contact


def feedback(record: ContactFeedbackRecord, context: PipeContext) -> ContactFeedbackPipe:
    """Make a pipe from a topic to the wrenches of the Robot's contacts; see `factory.feedback`."""
    contacts, names = _contacts(record, context)
    # a pipe that names no contacts reads those of its Robot, and ignores those of other parts
    known = None if record.names is None else context.robot.contacts.names
    return ContactFeedbackPipe(
        record.name,
        context.middleware.reader(record.source, _message(record)),
        context.robot,
        contacts=contacts,
        fixed=record.interface == "fixed",
        names=names,
        required=record.initialize,
        known=known,
    )


def controller(record: ContactControllerRecord, context: PipeContext) -> ContactCommandPipe:
    """Make a pipe from the wrenches of the Robot's contacts to a topic; see `factory.controller`."""
    contacts, names = _contacts(record, context)
    writer = context.writer(record.sink, _message(record))
    return ContactCommandPipe(
        record.name, writer, context.robot, contacts=contacts, fixed=record.interface == "fixed", names=names
    )


def _message(record: ContactFeedbackRecord | ContactControllerRecord) -> str:
    what = "wrenches of contacts" if record.space == "CONTACTS" else "wrench of a contact"
    return message_of(record, (record.default_message,), what)


def _contacts(
    record: ContactFeedbackRecord | ContactControllerRecord, context: PipeContext
) -> tuple[tuple[Contact, ...], tuple[str, ...] | None]:
    """Look up the contacts of a pipe, and their names for a message of several."""
    found = context.robot.contacts
    if not found.names:
        raise PipeError(
            f"pipe '{record.name}' carries contacts, but the Robot has none",
            where=record.where("space"),
            expected="a robot configuration with contacts: {read: true}",
        )
    names = found.names if record.contacts is None else record.contacts
    key = "names" if record.space == "CONTACTS" else "contact"
    try:
        return tuple(found[name] for name in names), names if record.space == "CONTACTS" else None
    except SolferError as error:
        raise error.at(record.where(key)) from None
