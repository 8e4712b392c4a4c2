"""Compiled steps of `HeightMap`, where arrays are described."""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part

FLOOR_TOLERANCE = 0.008
"""How far a wheel may be above or below a floor and still be on it [m]: twice what floors are uneven (DIN 18202)."""


HEIGHTS = BlockLayout(
    "Heights",
    count=int,  # number of wheels
    sample_count=int,
    cycle=(int, 1),
    radii=(float, "count"),
    floor=(float, 2),  # its height, NaN where there is none; and how far wheels have rolled on even ground
    # samples of each wheel's track in a ring, how far each was above the floor, and their number
    tracks=(float, "count", "sample_count", 3),
    risen=(float, "count", "sample_count"),
    heads=(int, "count"),
    followed=(int, "count", 2),  # track and sample that a wheel follows; -1: none
    leading=(float, "count"),
    places=(float, "count", 3),
    stood=(float, "count", 4),  # where each wheel has come to rest, and in which cycle
)
"""What the kernels read and write."""

_heights_at = HEIGHTS.at


@part
def squared_distance(tracks, track, sample, x, y):
    """Return the squared horizontal distance to a sample [m^2]."""
    place = tracks[track, sample % tracks.shape[1]]
    return (place[0] - x) ** 2 + (place[1] - y) ** 2


@part
def find_track(tracks, heads, wheel, x, y, followed):
    """Let a wheel follow the track of the sample that is nearest to it."""
    largest_distance = 0.03  # [m] from a sample, where it begins to follow
    nearest = largest_distance * largest_distance
    for track in range(len(tracks)):
        newest = heads[track] - (8 if track == wheel else 0)  # it has just left the newest of its own
        for sample in range(max(0, heads[track] - tracks.shape[1]), newest - 1):
            square = squared_distance(tracks, track, sample, x, y)
            if square < nearest:
                nearest = square
                followed[wheel, 0] = track
                followed[wheel, 1] = sample


@part
def height_on_track(tracks, heads, wheel, x, y, slope, followed):
    """Interpolate the height of the track that a wheel follows [m]; NaN where it has left it."""
    track = followed[wheel, 0]
    sample = followed[wheel, 1]
    size = tracks.shape[1]
    largest_offset = 0.05  # [m] beside the track, and between its samples
    for _ in range(size):
        if track < 0 or sample < max(0, heads[track] - size) or sample + 1 >= heads[track]:
            break
        one = tracks[track, sample % size]
        other = tracks[track, (sample + 1) % size]
        along = other[0] - one[0]
        across = other[1] - one[1]
        square = along * along + across * across
        if square > largest_offset * largest_offset or square == 0.0:
            break
        ratio = ((x - one[0]) * along + (y - one[1]) * across) / square
        if ratio < 0.0 or ratio > 1.0:
            sample += 1 if ratio > 1.0 else -1
            continue
        off_x = x - one[0] - ratio * along
        off_y = y - one[1] - ratio * across
        if off_x * off_x + off_y * off_y > largest_offset * largest_offset:
            break
        followed[wheel, 1] = sample
        return one[2] + ratio * (other[2] - one[2]) + slope[0] * off_x + slope[1] * off_y
    followed[wheel, 0] = -1
    return math.nan


@part
def leads(arm, x, y, velocity, yaw_rate, before):
    """Return whether a wheel leads the others, 1, or follows them, -1; `before` while it stands."""
    u = velocity[0] - yaw_rate * arm[1]
    v = velocity[1] + yaw_rate * arm[0]
    length = math.sqrt((u * u + v * v) * (x * x + y * y))
    rest_speed = 1e-3  # [m/s] below which no wheel leads
    if u * u + v * v > rest_speed * rest_speed and length > 0.0:
        return (u * x + v * y) / length
    return before


@part
def height_at_rest(stood, wheel, place, cycle):
    """Return the height at which a wheel has come to rest [m]; NaN: it has not, or is lifted from there."""
    distance = 0.001  # [m] within which a wheel rests
    cycles = 250  # in which it has come to rest: half a second of an IMU at 500 Hz
    off_x = place[0] - stood[wheel, 0]
    off_y = place[1] - stood[wheel, 1]
    if not off_x * off_x + off_y * off_y < distance * distance:
        stood[wheel, :3] = place
        stood[wheel, 3] = cycle
    rests = cycle - stood[wheel, 3] > cycles and abs(place[2] - stood[wheel, 2]) <= FLOOR_TOLERANCE
    return stood[wheel, 2] if rests else math.nan


def _missing_height(start, arms, normal, position, heading, weights, velocity, yaw_rate):
    """Write the lowest points of the wheels as `places`; return how far the base is below the map [m], NaN: unknown."""
    heights = _heights_at(start)
    radii = heights.radii
    floor = heights.floor
    followed = heights.followed
    leading = heights.leading
    places = heights.places
    heights.cycle[0] += 1
    cosine = math.cos(heading)
    sine = math.sin(heading)
    count = heights.count
    x0 = y0 = total = 0.0
    for i in range(count):
        if weights[i] > 0.0:
            total += 1.0
            x0 += arms[i, 0]
            y0 += arms[i, 1]
    x0 = x0 / total
    y0 = y0 / total
    slope = (
        (-cosine * normal[0] + sine * normal[1]) / normal[2],
        (-sine * normal[0] - cosine * normal[1]) / normal[2],
    )
    missing = total_weight = 0.0
    for i in range(count):
        x = arms[i, 0] + radii[i] * normal[0]
        y = arms[i, 1] + radii[i] * normal[1]
        places[i, 0] = position[0] + cosine * x - sine * y
        places[i, 1] = position[1] + sine * x + cosine * y
        places[i, 2] = position[2] + arms[i, 2] + radii[i] * (normal[2] - 1.0)
        if weights[i] <= 0.0:
            followed[i, 0] = -1
            heights.stood[i, 0] = math.nan
            continue
        rest = height_at_rest(heights.stood, i, places[i], heights.cycle[0])
        leading[i] = leads(arms[i], arms[i, 0] - x0, arms[i, 1] - y0, velocity, yaw_rate, leading[i])
        if followed[i, 0] < 0 and heights.cycle[0] % count == i:
            find_track(heights.tracks, heights.heads, i, places[i, 0], places[i, 1], followed)
        height = math.nan
        weight = 1.0
        if followed[i, 0] >= 0:
            height = height_on_track(heights.tracks, heights.heads, i, places[i, 0], places[i, 1], slope, followed)
        if math.isnan(height):
            if abs(places[i, 2] - floor[0]) <= FLOOR_TOLERANCE:
                height = floor[0]
                # one that leads may be where the floor ends: it weighs a hundredth of one that follows a track
                weight = 0.01 + (0.5 - 0.5 * leading[i]) ** 2
            elif not math.isnan(rest):
                height = rest
            else:
                continue
        missing += weight * (height - places[i, 2])
        total_weight += weight
    return missing / total_weight if total_weight > 0.0 else math.nan


@part
def end_floor(tracks, heads, risen, wheel):
    """Give the newest samples the heights that were measured: the floor has ended there already."""
    size = tracks.shape[1]
    later = math.inf
    for sample in range(heads[wheel] - 1, max(0, heads[wheel] - size) - 1, -1):
        off = risen[wheel, sample % size]
        if abs(off) < 5e-4 or abs(off) > later:  # within half a millimetre it still counts as on the floor
            break
        tracks[wheel, sample % size, 2] += off
        risen[wheel, sample % size] = 0.0
        later = abs(off)


def _note(start, raised, weights):
    """Note where wheels are, on tracks and on floors, when the base has been raised [m].

    Returns whether all wheels that touch are on the floor.
    """
    heights = _heights_at(start)
    places = heights.places
    floor = heights.floor
    tracks = heights.tracks
    risen = heights.risen
    heads = heights.heads
    count = heights.count
    size = heights.sample_count
    on_floor = 0
    touching = 0
    lowest = 1e9
    highest = -1e9
    mean = 0.0
    distance = 0.0
    spacing = 0.02  # [m] from one sample of a track to the next
    for i in range(count):
        if weights[i] <= 0.0:
            continue
        x = places[i, 0]
        y = places[i, 1]
        z = places[i, 2] + raised
        touching += 1
        lowest = min(lowest, z)
        highest = max(highest, z)
        mean = mean + z
        level = not math.isnan(floor[0]) and abs(z - floor[0]) <= FLOOR_TOLERANCE
        on_floor += level
        square = spacing * spacing if heads[i] == 0 else squared_distance(tracks, i, heads[i] - 1, x, y)
        if square < spacing * spacing:
            continue
        distance = max(distance, math.sqrt(square))
        off = z - floor[0] if level else 0.0
        if not level:
            end_floor(tracks, heads, risen, i)
        place = heads[i] % size
        tracks[i, place, 0], tracks[i, place, 1], tracks[i, place, 2] = x, y, z - off
        risen[i, place] = off
        heads[i] += 1
    if not math.isnan(floor[0]):
        if on_floor == 0:
            floor[0] = math.nan
            floor[1] = 0.0
    elif touching < 3 or highest - lowest > 0.003:  # [m] of even ground
        floor[1] = 0.0
    else:
        floor[1] += distance
        if floor[1] > 0.2:  # [m] of the way on even ground
            floor[0] = mean / touching
    return on_floor > 0 and on_floor == touching


_V = "float64[::1]"

missing_height = cached(f"float64(int64, float64[:, ::1], {_V}, {_V}, float64, {_V}, {_V}, float64)", _missing_height)
note = cached(f"boolean(int64, float64, {_V})", _note)
