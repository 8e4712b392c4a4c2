"""The levels of a health report."""

import enum


class Health(enum.IntEnum):
    """Health of a part: GOOD; WARNING: it works with restrictions, or waits; ERROR: it does not work."""

    GOOD = 0
    WARNING = 1
    ERROR = 2
