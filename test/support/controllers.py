"""Commands for one controller of a lower level, without a claim."""


def accept(controller, message):
    """Check and apply a command."""
    controller.apply(*controller.check(message))
