"""Wrenches about points of links, and about contacts, compiled: one call for all contacts of a message.

With the force f and the arm r from the origin of a link to a contact, a torque t about the origin is t - r x f about
the contact.
"""

from solfer.numerics.compilation import cached


def _shift(wrenches, contacts, origins, rows, sign, out, places):
    """Move wrenches between origins of links and contacts, all in world axes.

    Args:
        wrenches: Force and torque of each, shape (s, 6).
        contacts: Positions of contacts, shape (c, 3) [m].
        origins: Origin of the link of each, shape (k, 3) [m].
        rows: Row of each in `wrenches`, `contacts` and `out`, shape (k, 3); below zero: it is left out.
        sign: 1 from contacts to origins, -1 from origins to contacts.
        out: Where they are written, shape (o, 6); may not be `wrenches`.
        places: Which of the k are moved, shape (j,).
    """
    for place in places:
        if rows[place, 1] < 0:
            continue
        wrench = wrenches[rows[place, 0]]
        contact = contacts[rows[place, 1]]
        moved = out[rows[place, 2]]
        origin = origins[place]
        rx = contact[0] - origin[0]
        ry = contact[1] - origin[1]
        rz = contact[2] - origin[2]
        fx = wrench[0]
        fy = wrench[1]
        fz = wrench[2]
        moved[0] = fx
        moved[1] = fy
        moved[2] = fz
        moved[3] = wrench[3] + sign * (ry * fz - rz * fy)
        moved[4] = wrench[4] + sign * (rz * fx - rx * fz)
        moved[5] = wrench[5] + sign * (rx * fy - ry * fx)


shift = cached(
    "void(float64[:,::1], float64[:,::1], float64[:,::1], int64[:,::1], float64, float64[:,::1], int64[::1])",
    _shift,
)
