"""Makes pipes that carry the wrenches of the Robot's contacts."""

from solfer.config.kinds.contact import ContactControllerRecord, ContactFeedbackRecord
from solfer.errors import PipeError, SolferError
from solfer.pipes.contact.pipes import CarriedContacts, ContactCommandPipe, ContactFeedbackPipe
from solfer.pipes.context import PipeContext, message_of


def feedback(record: ContactFeedbackRecord, context: PipeContext) -> ContactFeedbackPipe:
    """Make a pipe from a topic to the wrenches of the Robot's contacts; see `factory.feedback`."""
    # a pipe that names no contacts reads those of its Robot, and ignores those of other parts
    known = None if record.names is None else context.robot.contacts.names
    return ContactFeedbackPipe(
        record.name,
        context.middleware.reader(record.source, _message(record)),
        context.robot,
        carried=_carried(record, context),
        required=record.initialize,
        known=known,
    )


def controller(record: ContactControllerRecord, context: PipeContext) -> ContactCommandPipe:
    """Make a pipe from the wrenches of the Robot's contacts to a topic; see `factory.controller`."""
    carried = _carried(record, context)
    writer = context.writer(record.sink, _message(record))
    return ContactCommandPipe(record.name, writer, context.robot, carried=carried)


def _message(record: ContactFeedbackRecord | ContactControllerRecord) -> str:
    what = "wrenches of contacts" if record.space == "CONTACTS" else "wrench of a contact"
    return message_of(record, (record.default_message,), what)


def _carried(record: ContactFeedbackRecord | ContactControllerRecord, context: PipeContext) -> CarriedContacts:
    """Look up the contacts of a pipe."""
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
        contacts = tuple(found[name] for name in names)
    except SolferError as error:
        raise error.at(record.where(key)) from None
    return CarriedContacts(contacts, record.interface == "fixed", names if record.space == "CONTACTS" else None)
