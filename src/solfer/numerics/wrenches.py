"""Wrenches about points of links, and about contacts, compiled: one call for all contacts of a message.

With the force f and the arm r from the origin of a link to a contact, a torque t about the origin is t - r x f about
the contact.
"""

from solfer.numerics.compilation import cached


def _shift(wrenches, taken, contacts, members, origins, sign, out, put, places):
    """Move wrenches between origins of links and contacts, all in world axes.

    Args:
        wrenches: Force and torque of each, shape (s, 6).
        taken: Rows of `wrenches`, shape (k,).
        contacts: Positions of contacts, shape (c, 3) [m].
        members: Row of `contacts` of each, shape (k,); below zero: it is left out.
        origins: Origin of the link of each, shape (k, 3) [m].
        sign: 1 from contacts to origins, -1 from origins to contacts.
        out: Where they are written, shape (o, 6); may not be `wrenches`.
        put: Rows of `out`, shape (k,).
        places: Which of the k are moved, shape (j,).
    """
    for place in places:
        if members[place] < 0:
            continue
        wrench = wrenches[taken[place]]
        moved = out[put[place]]
        contact = contacts[members[place]]
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
    "void(float64[:,::1], int64[::1], float64[:,::1], int64[::1], float64[:,::1], float64, float64[:,::1], "
    "int64[::1], int64[::1])",
    _shift,
)
