"""Recordings that are damaged: one error with its place, or what is missing, in little memory."""

import json
import struct
import zlib

import numpy as np
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Channel as ChannelRecord

from solfer.errors import RecordingError
from solfer.recording import reader
from solfer.recording.model import COLUMNS_KIND, Channel, Recording
from solfer.recording.reader import read
from solfer.recording.writer import save
from solfer_tools.cli.main import main


@pytest.fixture
def file(tmp_path):
    times = np.arange(10) / 100.0
    save(
        Recording({"arm/a": Channel("arm/a", COLUMNS_KIND, ("x",), ("m",), "", times, np.ones((10, 1)))}),
        tmp_path / "a.mcap",
    )
    return tmp_path / "a.mcap"


def records(data):
    place = 8
    while place + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, place)
        yield opcode, place, length
        place += 9 + length
        if opcode == 15:
            return


def changed(file, kind, change):
    """Change the content of the last record of a kind."""
    data = file.read_bytes()
    _, place, length = [each for each in records(data) if each[0] == kind][-1]
    content = change(data[place + 9 : place + 9 + length])
    file.write_bytes(data[:place] + struct.pack("<BQ", kind, len(content)) + content + data[place + 9 + length :])


def announced(**metadata):
    builder = RecordBuilder()
    ChannelRecord(2, "/arm/a", "cdr", {"frame": "", "child": "", **metadata}, 2).write(builder)
    return builder.end()[9:]


DAMAGES = {
    "a text that is not UTF-8": (3, lambda old: old[:6] + b"\xff\xff" + old[8:]),
    "a record that is too short": (4, lambda old: old[:3]),
    "a schema that is not there": (4, lambda old: old[:2] + b"\x63\x00" + old[4:]),
    "not JSON": (4, lambda _: announced(channels="[")),
    "nested JSON": (4, lambda _: announced(channels="[" * 100_000)),
    "JSON of another kind": (4, lambda _: announced(channels="7")),
    "names that are numbers": (4, lambda _: announced(channels=json.dumps([[1, [2], [3]]]))),
    "names that cannot be printed": (4, lambda _: announced(channels=json.dumps([["a\0", ["x"], ["m"]]]))),
    "no channels": (4, lambda _: announced(channels="[]")),
    "units of other columns": (4, lambda _: announced(channels=json.dumps([["arm/a", ["x"], []]]))),
    "nothing about the columns": (4, lambda _: announced()),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_record_is_one_placed_error(file, capsys, damage):
    changed(file, *DAMAGES[damage])
    with pytest.raises(RecordingError) as caught:
        read(file)
    assert str(file) in caught.value.where and ("byte" in caught.value.where or "topic" in caught.value.where)
    assert main(["log", "info", str(file)]) == 2
    assert capsys.readouterr().err.startswith(f"error: {file}")


@pytest.mark.parametrize("size", [1 << 40, (1 << 64) - 1])
def test_a_huge_length_takes_no_memory(file, size):
    """Both the chunk and the frame in it say that there are many more bytes than there are."""

    def huge(old):
        packed = bytes.fromhex("28b52ffd") + b"\xe0" + struct.pack("<Q", size) + b"\x01\x00\x00"
        return old[:16] + struct.pack("<QI", size, 0) + old[28:36] + struct.pack("<Q", len(packed)) + packed

    changed(file, 6, huge)
    assert any("damaged rows" in sentence for sentence in read(file).missing)


def with_messages(old, change):
    """Return a chunk whose messages are changed, with their checksum."""
    messages = change(zstandard.decompress(old[44:]))
    packed = zstandard.compress(messages)
    head = old[:16] + struct.pack("<QI", len(messages), zlib.crc32(messages)) + old[28:36]
    return head + struct.pack("<Q", len(packed)) + packed


def test_a_chunk_with_a_message_beyond_its_end_is_an_error(file):
    def beyond(messages):
        return messages[:1] + struct.pack("<Q", 1 << 62) + messages[9:]

    changed(file, 6, lambda old: with_messages(old, beyond))
    with pytest.raises(RecordingError, match="a chunk of"):
        read(file)


def test_messages_of_unequal_length_are_named(file):
    """Their topic has no row of that chunk, and the rest of the file is read."""

    def longer(messages):
        end = 9 + struct.unpack_from("<Q", messages, 1)[0]
        return messages[:1] + struct.pack("<Q", end - 9 + 8) + messages[9:end] + bytes(8) + messages[end:]

    changed(file, 6, lambda old: with_messages(old, longer))
    found = read(file)
    assert any("do not have the layout of their topic" in sentence for sentence in found.missing)
    assert len(found["arm/a"].times) == 0


def test_zeros_behind_the_beginning_are_an_error_at_once(tmp_path, file):
    file.write_bytes(file.read_bytes()[:8] + bytes(1000))
    with pytest.raises(RecordingError, match="a record of the kind 0"):
        read(file)


def test_a_file_that_unpacks_to_much_is_an_error(file, monkeypatch, capsys):
    """Chunks of a megabyte, a thousand bytes each in the file; and one that is too large by itself."""
    data = file.read_bytes()
    _, place, length = [each for each in records(data) if each[0] == 6][-1]
    old = data[place + 9 : place + 9 + length]
    message = zstandard.decompress(old[44:])
    message = message[: 9 + struct.unpack_from("<Q", message, 1)[0]]

    def chunk(count):
        packed = zstandard.compress(count * message)
        head = old[:16] + struct.pack("<QI", count * len(message), 0) + old[28:36] + struct.pack("<Q", len(packed))
        return struct.pack("<BQ", 6, len(head) + len(packed)) + head + packed

    many = 2**20 // len(message)
    monkeypatch.setattr(reader, "_MAX_UNPACKED_SIZE", 2**21)
    monkeypatch.setattr(reader, "_MAX_EXPANSION", 32)
    file.write_bytes(data[:place] + 5 * chunk(many) + data[place + 9 + length :])
    with pytest.raises(RecordingError, match="unpacks to more than"):
        read(file)
    assert main(["log", "info", str(file)]) == 2
    assert capsys.readouterr().err.count("error: ") == 1
    file.write_bytes(data[:place] + chunk(20 * many) + data[place + 9 + length :])
    assert any("damaged rows" in sentence for sentence in read(file).missing)


def test_attachments_and_texts_have_bounds(file, monkeypatch):
    monkeypatch.setattr(reader, "_MAX_OTHERS_SIZE", 100)
    with pytest.raises(RecordingError, match="that are no messages"):
        read(file)
