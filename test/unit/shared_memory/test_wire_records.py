"""Messages of fields in shared memory."""

import math

import numpy as np
import pytest

from solfer.middleware.shared_memory.topics.layouts import FieldsLayout
from solfer.transport.messages import FieldsMessage

FLOATS = (math.inf, -math.inf, -0.0, 5e-324, np.float64(0.1))


@pytest.mark.parametrize("value", [2**63 - 1, -(2**63), 2**64 - 1, 2**80, -(2**80), "\ud800", "é\0", True, None, ""])
def test_fields_come_back_as_they_were_sent(value):
    """Also integers beyond 64 bits and texts that are no Unicode, which MessagePack does not hold."""
    sent = FieldsMessage({"value": value, "nested": {"rows": ((1, 2.0), (value,))}, "floats": FLOATS, "nan": math.nan})
    layout = FieldsLayout.from_message(sent)
    record = layout.bind(FieldsMessage, np.zeros(layout.width), "sender")
    assert record.encode(sent)
    fields = record.copy().fields
    assert math.isnan(fields.pop("nan"))
    assert repr(fields) == repr(
        {"value": value, "nested": {"rows": [[1, 2.0], [value]]}, "floats": [float(each) for each in FLOATS]}
    )


def test_what_is_no_field_is_refused():
    with pytest.raises(TypeError, match="not JSON serializable"):
        FieldsLayout.from_message(FieldsMessage({"value": np.zeros(2)}))
