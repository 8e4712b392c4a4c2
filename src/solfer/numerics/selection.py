"""Which entries of an array are meant, in the form that costs least."""

import numpy as np


def selection(indices: np.ndarray) -> np.ndarray | slice:
    """What selects the same entries as `indices`, shape (k,): a slice where they follow each other."""
    first = int(indices[0]) if len(indices) else 0
    if np.array_equal(indices, np.arange(first, first + len(indices))):
        return slice(first, first + len(indices))
    return indices
