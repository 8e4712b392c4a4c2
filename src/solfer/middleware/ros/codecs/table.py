"""ROS messages to named numbers and back: the codec of each message."""

import importlib
import pkgutil

from solfer.middleware.ros import codecs
from solfer.middleware.ros.codecs.base import Codec
from solfer.middleware.ros.codecs.fields import FieldsCodec

__all__ = ["Codec", "codec"]

for _module in pkgutil.iter_modules(codecs.__path__):
    importlib.import_module(f"{codecs.__name__}.{_module.name}")

CODECS = {message: kind for kind in Codec.__subclasses__() for message in kind.messages}
"""Codecs by the canonical names of their messages: all in the modules of this folder."""


def codec(message: str) -> Codec:
    """Make the codec of a message by its canonical name; one that no pipe carries travels by its fields.

    Raises:
        MissingDependency: The package of a message that a component declares is not there, or not built.
        UnknownName: The package has no such message.
    """
    return CODECS.get(message, FieldsCodec).of(message)
