"""Shipped configurations with mistakes in them, drawn by a seed."""

import random
import re
import shutil
import struct
import zlib
from pathlib import Path

import yaml
import zstandard

FOLDERS = ("support", "transport", "worlds", "robots/centauro", "robots/centauro/hardware")
NUMBERS = (
    0, -1, 1, 99, 1e9, 1e29, 1e-3, 1e-300, 1e300, -1e300, float("nan"), float("inf"), float("-inf"), 10**17, 10**40,
    -0.0, 0.1, 4000, 1e-12,
)  # fmt: skip
WORDS = (
    "", " ", "~", "all", "SKIP", "none", "../..", "/", ".", "package://", "package://solfer", "$(find )", "::", "a::",
    "::a", "joint_states", "solfer:errors", "os:path", "\t", "\u00e4\u4f60\U0001f600", "\u202e\u200b", "\ufeff", "\x85",
    "\x00", "x" * 5000, "yes", "1e3", "{}", "%s", "a.b", "null", "base_link", "FEEDBACK", "RBDL", "class",
)  # fmt: skip
LINES = (
    "\t", "- a", "a: b", "? x", "<<: *x", "&x {a: *x}", "...", "---", "%YAML 3", "!!python/object:os.system x", "'",
    '"', "|", ">", "[" * 40, "{" * 40, "[" * 3000, "*nobody", "\x07", "\ud800", "@", "`", "# \u2028", "!foo a",
    "!foo [a]", "!foo {a: 1}", ": ", "{a: 1, a: 2}",
)  # fmt: skip
DIGITS = ("1e400", "-1e300", "1e-300", "nan", "inf", "0", "-1", "", "1e9", "0x1F", "1_0", ".nan", "999999999999")
KEY = re.compile(r"^( *)([A-Za-z_]\w*)(?=:)", re.MULTILINE)
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d*)?(?:e-?\d+)?(?![\w.])")


def shipped(repository: Path, folder: Path) -> list[Path]:
    """Copy all shipped configurations; the files, without what only their generator reads."""
    source = repository / "config"
    for place in ("", *FOLDERS):
        (folder / place).mkdir(parents=True, exist_ok=True)
        for file in (source / place).iterdir():
            if file.suffix in (".yaml", ".urdf", ".srdf") and file.name != "parameters.yaml":
                shutil.copy(file, folder / place / file.name)
    return sorted(path for path in folder.rglob("*") if path.is_file())


def mutated(text: str, draw: random.Random, tree: bool) -> str:
    """Make one to three mistakes in a text; those of a `tree` of YAML are made in its values, too, else in XML."""
    for _ in range(draw.choice((1, 1, 1, 2, 3))):
        text = draw.choice(ON_TREES + ON_TEXTS if tree else ON_XML)(text, draw)
    return text


def _places(value, found):
    """All (container, key) of a tree."""
    for key in value if isinstance(value, dict) else range(len(value)):
        found.append((value, key))
        if isinstance(value[key], dict | list):
            _places(value[key], found)
    return found


def _on_tree(change):
    def changed(text, draw):
        try:
            root = yaml.safe_load(text)
        except (yaml.YAMLError, ValueError, RecursionError):
            return text  # an earlier mistake
        if not isinstance(root, dict) or not root:
            return text
        root = {"": yaml.safe_load(yaml.dump(root, Dumper=_Plain))}  # without aliases: one mistake is in one place
        places = _places(root, [])
        change(*draw.choice(places), draw, places)
        return yaml.dump(root[""], Dumper=_Plain, allow_unicode=draw.random() < 0.5, sort_keys=False)

    return changed


class _Plain(yaml.SafeDumper):
    def ignore_aliases(self, _):
        return True


def _drop(place, key, draw, _):
    if isinstance(place, dict) and key != "":
        del place[key]
    else:
        place[key] = None


def _rename(place, key, draw, _):
    if isinstance(place, dict) and key != "":
        new = draw.choice((str(key)[:-1], f"{key}s", str(key).upper(), draw.choice(WORDS), 3, 1.5, True, None))
        items = [(new if name == key else name, value) for name, value in place.items()]
        place.clear()
        place.update(items)


def _swap(place, key, draw, places):
    other, name = draw.choice(places)
    copies = [yaml.safe_load(yaml.dump(value, Dumper=_Plain)) for value in (place[key], other[name])]
    place[key], other[name] = copies[1], copies[0]


def _double(place, key, draw, _):
    if isinstance(place, list):
        place.append(place[key])
    else:
        place[f"{key}_2" if isinstance(key, str) else "twice"] = place[key]


def _number(place, key, draw, places):
    numbers = [each for each in places if isinstance(each[0][each[1]], int | float)]
    place, key = draw.choice(numbers) if numbers and draw.random() < 0.9 else (place, key)
    place[key] = draw.choice(NUMBERS)


def _word(place, key, draw, places):
    texts = [each for each in places if isinstance(each[0][each[1]], str)]
    place, key = draw.choice(texts) if texts and draw.random() < 0.9 else (place, key)
    word = place[key] if isinstance(place[key], str) else "word"
    place[key] = draw.choice((*WORDS, word[:-1], f"{word}x", word.swapcase(), word * 200))


def _kind(place, key, draw, _):
    kinds = (
        None, True, [], {}, [place[key]], {"a": place[key]}, [[1]], str(place[key])[:50], 7, {"list": []}, [None],
        [True, "a", 1], {"file": "main.yaml"}, {"path": "/", "file": "."},
    )  # fmt: skip
    place[key] = draw.choice(kinds)


def _nest(place, key, draw, _):
    for _ in range(draw.choice((3, 30, 100))):
        place[key] = [place[key]] if draw.random() < 0.5 else {"a": place[key]}


def _cut(text, draw):
    begin = draw.randrange(len(text) + 1)
    return draw.choice((text[:begin], text[begin:], text[:begin] + text[begin + draw.choice((1, 10, 1000)) :], ""))


def _line(text, draw):
    lines = text.splitlines()
    place = draw.randrange(len(lines) + 1)
    kept = [*lines[:place], " " * draw.choice((0, 2, 4)) + draw.choice(LINES), *lines[place + draw.choice((0, 1)) :]]
    return "\n".join(draw.choice((kept, [*lines[:place], *lines[place:][1:]], [*lines[: place + 1], *lines[place:]])))


def _tab(text, draw):
    places = [match.start() for match in re.finditer(r"(?<=\n)  ", text)] or [0]
    place = draw.choice(places)
    return f"{text[:place]}\t{text[place + 2 :]}"


def _digit(text, draw):
    found = [*NUMBER.finditer(text)]
    if not found:
        return text
    match = draw.choice(found)
    return text[: match.start()] + draw.choice(DIGITS) + text[match.end() :]


def _anchor(text, draw):
    found = [*KEY.finditer(text)]
    if not found:
        return text
    match, other = draw.choice(found), draw.choice(found)
    first, second = sorted((match.end() + 1, other.end() + 1))
    return f"{text[:first]} &it {text[first:second]} *it {text[second:]}"


def _letter(text, draw):
    place = draw.randrange(len(text) + 1)
    return text[:place] + draw.choice(WORDS[15:]) + text[place + draw.choice((0, 1)) :]


ATTRIBUTE = re.compile(r'([\w:]+)="([^"]*)"')
VALUES = (
    "", " ", "0 0", "0 0 0 0", "nan 0 0", "inf", "0", "-1", "-0.1 1 1", "1e400", "0x1", "one", "1,2,3", "&#0;", "&x;",
)  # fmt: skip


def _attribute(text, draw):
    """Change an attribute of an element of XML, its name, or the name of the element."""
    found = [*ATTRIBUTE.finditer(text)]
    if not found:
        return text
    match, (_, other) = draw.choice(found), draw.choice(found).groups()
    value = draw.choice((*VALUES, *DIGITS, other, match[2] * 2, f"{match[2]} 1", draw.choice(WORDS).strip('"<&')))
    changed = draw.choice((f'{match[1]}="{value}"', f'{match[1]}="{value}"', f'{match[1]}x="{match[2]}"', ""))
    return text[: match.start()] + changed + text[match.end() :]


def _elements(text, draw):
    """Take an element of XML away, double it, or put it elsewhere."""
    found = [*re.finditer(r"<(\w+)\b[^<>]*(?:/>|>[^<>]*</\1>)", text)]
    if not found:
        return text
    match, other = draw.choice(found), draw.choice(found)
    put = draw.choice(("", match[0] * 2, other[0], f"<{match[1]}/>", f"<a>{match[0]}</a>"))
    return text[: match.start()] + put + text[match.end() :]


def damaged(data: bytes, draw: random.Random, resealed: bool) -> bytes:
    """Damage a recording in one to three places; `resealed` chunks have the checksum of their damaged messages."""
    for _ in range(draw.choice((1, 1, 2, 3))):
        if resealed:
            data = _in_record(data, draw)
        else:
            data = draw.choice((_flip, _flip, _cut_bytes, _in_record, _in_record))(data, draw)
    return data


def _flip(data, draw):
    place, size = draw.randrange(len(data) + 1), draw.choice((1, 1, 4, 8, 100))
    put = draw.choice((draw.randbytes(size), b"\xff" * size, bytes(size)))
    return data[:place] + put + data[place + size :]


def _cut_bytes(data, draw):
    begin = draw.randrange(len(data) + 1)
    return draw.choice((data[:begin], data[:begin] + data[begin + draw.choice((1, 8, 1000)) :], data + data[begin:]))


def _in_record(data, draw):
    """Damage the content of a record of any kind, whose length stays right; the messages of a chunk as they are."""
    records, place = [], 8
    while place + 9 <= len(data):
        length = int.from_bytes(data[place + 1 : place + 9], "little")
        if place + 9 + length > len(data):
            break
        records.append((data[place], place, length))
        place += 9 + length
    if not records:
        return _flip(data, draw)
    kind = draw.choice(sorted({opcode for opcode, _, _ in records}))
    opcode, place, length = draw.choice([each for each in records if each[0] == kind])
    content = data[place + 9 : place + 9 + length]
    if opcode == 6 and len(content) > 40 and content[32:36] == b"zstd":
        content = _in_chunk(content, draw)
    else:
        content = draw.choice((_flip, _flip, _cut_bytes))(content, draw)
    return data[:place] + struct.pack("<BQ", opcode, len(content)) + content + data[place + 9 + length :]


def _in_chunk(content, draw):
    try:
        messages = zstandard.decompress(content[44:])
    except zstandard.ZstdError:
        return _flip(content, draw)  # an earlier mistake
    messages = draw.choice((_flip, _flip, _flip, _cut_bytes))(messages, draw)
    packed, size = zstandard.compress(messages), draw.choice((len(messages), len(messages), 1 << 62))
    head = content[:16] + struct.pack("<QI", size, draw.choice((0, zlib.crc32(messages)))) + content[28:36]
    return head + struct.pack("<Q", draw.choice((len(packed), len(packed), 1 << 63))) + packed


ON_TREES = tuple(map(_on_tree, (_drop, _rename, _swap, _double, _number, _number, _word, _kind, _nest)))
ON_TEXTS = (_cut, _line, _tab, _digit, _anchor, _letter)
ON_XML = (_attribute, _attribute, _attribute, _attribute, _elements, _elements, _cut, _line, _letter)
