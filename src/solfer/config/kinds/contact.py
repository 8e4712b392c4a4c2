"""Records of pipes that carry the wrenches of a Robot's contacts (Table 1, row 5 of the paper)."""

from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field, model_validator

from solfer.config.kinds.point import MESSAGES, POINTS_MESSAGE, require_without
from solfer.config.records.bounds import Name
from solfer.config.records.pipes import Content, ControllerRecord, FeedbackRecord, KindRecords
from solfer.config.records.record import Record


class ContactTags(Record):
    """Tags of a pipe of contacts, which replace its DoFs."""

    content: ClassVar[Content] = Content(contacts=True)

    space: Literal["CONTACT", "CONTACTS"] = Field(description="`CONTACT`, or `CONTACTS` for several in one message")
    dofs: None = Field(default=None, description="nothing: a contact has no DoFs")
    contact: Name | None = Field(default=None, description="CONTACT: its name, if not that of the pipe")
    names: tuple[str, ...] | None = Field(
        default=None, min_length=1, description="CONTACTS: their names; left out: all that the Robot has"
    )
    interface: Literal["world", "fixed"] = Field(
        default="world", description="axes of the wrenches: those of the world, or `fixed` to the contact's link"
    )
    function: Literal["state"] = Field(default="state", description="`state`: what acts on the Robot")

    if TYPE_CHECKING:
        name: str  # the pipe's

    @model_validator(mode="after")
    def _complete(self) -> "ContactTags":
        several = self.space == "CONTACTS"
        if several and self.interface == "fixed":
            raise ValueError("several contacts in one message have to be in the axes of the world: interface: world")
        if (self.contact if several else self.names) is not None:
            raise ValueError("CONTACTS have 'names', a CONTACT has 'contact'")
        if self.names is not None and len(set(self.names)) < len(self.names):
            raise ValueError("a name that stands twice in 'names'")
        require_without(self, "contact")
        return self

    @property
    def default_message(self) -> str:
        """See `PipeRecord.default_message`."""
        return POINTS_MESSAGE if self.space == "CONTACTS" else MESSAGES["wrench"]

    @property
    def carried(self) -> tuple[str, ...]:
        """See `PipeRecord.carried`."""
        return tuple(f"wrench of {name}" for name in self.contacts or ("all contacts",))

    @property
    def refers_to(self) -> str:
        """See `PipeRecord.refers_to`."""
        return f"axes of {'its link' if self.interface == 'fixed' else 'world'}"

    @property
    def contacts(self) -> tuple[str, ...] | None:
        """Names of the contacts; None: all that the Robot has."""
        return self.names if self.space == "CONTACTS" else (self.contact or self.name,)


class ContactFeedbackRecord(ContactTags, FeedbackRecord):
    """Wrenches that a plugin receives: they become those of its Robot's contacts."""


class ContactControllerRecord(ContactTags, ControllerRecord):
    """Wrenches of its Robot's contacts that a plugin publishes."""


RECORDS = KindRecords(ContactFeedbackRecord, ContactControllerRecord, ContactTags, title="Contacts")
