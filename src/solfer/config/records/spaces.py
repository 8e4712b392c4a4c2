"""The kinds of pipes: what a configuration calls a `space`."""

from typing import TYPE_CHECKING, Literal

HOMES = {
    "JOINT": "joint",
    "OPERATIONAL": "body",
    "POINT": "point",
    "POINTS": "point",
    "CONTACT": "contact",
    "CONTACTS": "contact",
}
"""Home of each kind: its records are in `solfer.config.kinds.<home>`, its pipes are made by `solfer.pipes.<home>`."""

if TYPE_CHECKING:
    Space = str
else:
    Space = Literal[tuple(HOMES)]
