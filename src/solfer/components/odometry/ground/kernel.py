"""Compiled steps of `GroundTracks`, where arrays are described."""

import math

from solfer.numerics.compilation import cached, part

SPACING = 0.02
"""Way from a sample of a track to the next [m]."""

BESIDE, NEAR = 0.05, 0.03
"""How far a wheel may be beside a track that it follows, and from a sample where it begins to [m]."""

OWN = 8
"""Newest samples of its own track that a wheel does not follow: it has just left them."""

LOOSE = 0.01
"""Weight of a wheel that goes ahead onto a floor that may end there; that of one that follows a track is 1."""

SMALL = 5e-4
"""How far a wheel that leaves a floor may be off it while it is said to be on it [m]."""

STILL = 1e-3
"""Speed below which wheels go nowhere [m/s]."""


@part
def _distance(tracks, track, sample, x, y):
    """Return the squared distance to a sample, seen from above [m^2]."""
    place = tracks[track, sample % tracks.shape[1]]
    return (place[0] - x) ** 2 + (place[1] - y) ** 2


@part
def _search(tracks, heads, wheel, x, y, followed):
    """Find the sample that is nearest to a wheel."""
    nearest = NEAR * NEAR
    for track in range(len(tracks)):
        newest = heads[track] - (OWN if track == wheel else 0)
        for sample in range(max(0, heads[track] - tracks.shape[1]), newest - 1):
            square = _distance(tracks, track, sample, x, y)
            if square < nearest:
                nearest = square
                followed[wheel, 0], followed[wheel, 1] = track, sample


@part
def _height(tracks, heads, wheel, x, y, slope, followed):
    """Return the height of the track that a wheel follows [m]; NaN where it has left it."""
    track, sample, size = followed[wheel, 0], followed[wheel, 1], tracks.shape[1]
    for _ in range(size):
        if track < 0 or sample < max(0, heads[track] - size) or sample + 1 >= heads[track]:
            break
        one, other = tracks[track, sample % size], tracks[track, (sample + 1) % size]
        along, across = other[0] - one[0], other[1] - one[1]
        square = along * along + across * across
        if square > BESIDE * BESIDE or square == 0.0:
            break
        share = ((x - one[0]) * along + (y - one[1]) * across) / square
        if share < 0.0 or share > 1.0:
            sample += 1 if share > 1.0 else -1
            continue
        off_x, off_y = x - one[0] - share * along, y - one[1] - share * across
        if off_x * off_x + off_y * off_y > BESIDE * BESIDE:
            break
        followed[wheel, 1] = sample
        return one[2] + share * (other[2] - one[2]) + slope[0] * off_x + slope[1] * off_y
    followed[wheel, 0] = -1
    return math.nan


@part
def _ahead(arms, wheel, x, y, velocity, turn, outward):
    """Note whether a wheel goes ahead of the others, 1, or follows them, -1."""
    u, v = velocity[0] - turn * arms[wheel, 1], velocity[1] + turn * arms[wheel, 0]
    length = math.sqrt((u * u + v * v) * (x * x + y * y))
    if u * u + v * v > STILL * STILL and length > 0.0:
        outward[wheel] = (u * x + v * y) / length


def _anchor(
    arms, normal, radii, position, heading, weights, velocity, turn, cycle, tolerance, floor, tracks, heads, followed,
    outward, places, known,
):  # fmt: skip
    """Find how far the base is below what its wheels know of the ground [m]; NaN: none knows it.

    Writes the lowest points of the wheels as `places`, and what is known there.
    """
    cosine, sine, count = math.cos(heading), math.sin(heading), len(arms)
    x0 = y0 = total = 0.0
    for i in range(count):
        total += 1.0 * (weights[i] > 0.0)
        x0 += arms[i, 0] * (weights[i] > 0.0)
        y0 += arms[i, 1] * (weights[i] > 0.0)
    x0, y0 = x0 / total, y0 / total
    slope = (
        (-cosine * normal[0] + sine * normal[1]) / normal[2],
        (-sine * normal[0] - cosine * normal[1]) / normal[2],
    )
    missing = weight = 0.0
    for i in range(count):
        x, y = arms[i, 0] + radii[i] * normal[0], arms[i, 1] + radii[i] * normal[1]
        places[i, 0] = position[0] + cosine * x - sine * y
        places[i, 1] = position[1] + sine * x + cosine * y
        places[i, 2] = position[2] + arms[i, 2] + radii[i] * (normal[2] - 1.0)
        known[i] = math.nan
        if weights[i] <= 0.0:
            followed[i, 0] = -1
            continue
        _ahead(arms, i, arms[i, 0] - x0, arms[i, 1] - y0, velocity, turn, outward)
        if followed[i, 0] < 0 and cycle % count == i:
            _search(tracks, heads, i, places[i, 0], places[i, 1], followed)
        share = 1.0
        if followed[i, 0] >= 0:
            known[i] = _height(tracks, heads, i, places[i, 0], places[i, 1], slope, followed)
        if math.isnan(known[i]):
            if math.isnan(floor[0]) or abs(places[i, 2] - floor[0]) > tolerance:
                continue
            known[i] = floor[0]
            share = LOOSE + (0.5 - 0.5 * outward[i]) ** 2
        missing += share * (known[i] - places[i, 2])
        weight += share
    return missing / weight if weight > 0.0 else math.nan


@part
def _rewrite(tracks, heads, risen, wheel):
    """Give the samples before this one the heights that were measured: where the floor has ended already."""
    size, later = tracks.shape[1], math.inf
    for sample in range(heads[wheel] - 1, max(0, heads[wheel] - size) - 1, -1):
        off = risen[wheel, sample % size]
        if abs(off) < SMALL or abs(off) > later:
            break
        tracks[wheel, sample % size, 2] += off
        risen[wheel, sample % size], later = 0.0, abs(off)


def _note(places, raised, weights, tolerance, flat, least, floor, tracks, risen, heads):
    """Note where wheels are, on tracks and on floors, when the base has been raised [m].

    Returns how many wheels are on the floor; 0 where any that touches is not.
    """
    count, size, on_floor, touching = len(places), tracks.shape[1], 0, 0
    lowest, highest, mean, way = 1e9, -1e9, 0.0, 0.0
    for i in range(count):
        if weights[i] <= 0.0:
            continue
        x, y, z = places[i, 0], places[i, 1], places[i, 2] + raised
        touching += 1
        lowest, highest, mean = min(lowest, z), max(highest, z), mean + z
        level = not math.isnan(floor[0]) and abs(z - floor[0]) <= tolerance
        on_floor += level
        square = SPACING * SPACING if heads[i] == 0 else _distance(tracks, i, heads[i] - 1, x, y)
        if square < SPACING * SPACING:
            continue
        way = max(way, math.sqrt(square))
        off = z - floor[0] if level else 0.0
        if not level:
            _rewrite(tracks, heads, risen, i)
        place = heads[i] % size
        tracks[i, place, 0], tracks[i, place, 1], tracks[i, place, 2], risen[i, place] = x, y, z - off, off
        heads[i] += 1
    if not math.isnan(floor[0]):
        if on_floor == 0:
            floor[0], floor[1] = math.nan, 0.0
    elif touching < 3 or highest - lowest > least:
        floor[1] = 0.0
    else:
        floor[1] += way
        if floor[1] > flat:
            floor[0] = mean / touching
    return on_floor if on_floor == touching else 0


_V, _M, _F, _I = "float64[::1]", "float64[:, ::1]", "float64", "int64[:, ::1]"
_T, _N = "float64[:, :, ::1]", "int64[::1]"

anchor = cached(
    f"float64({_M}, {_V}, {_V}, {_V}, {_F}, {_V}, {_V}, {_F}, int64, {_F}, {_V}, {_T}, {_N}, {_I}, {_V}, {_M}, {_V})",
    _anchor,
)
note = cached(f"int64({_M}, {_F}, {_V}, {_F}, {_F}, {_F}, {_V}, {_T}, {_M}, int64[::1])", _note)
