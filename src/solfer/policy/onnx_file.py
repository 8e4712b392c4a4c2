"""ONNX files, written as protobuf without the package onnx: https://github.com/onnx/onnx/blob/main/onnx/onnx.proto."""

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

FLOAT, INT64 = 1, 7
"""Types of elements: floats of 32 bits, and whole numbers of 64."""


def field(number: int, value: int | str | bytes) -> bytes:
    """Encode one field."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    content = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(content)) + content


def varint(value: int) -> bytes:
    """Encode a number in as few bytes as it needs."""
    parts = []
    while value > 127:
        parts.append(value & 127 | 128)
        value >>= 7
    return bytes([*parts, value])


def node(kind: str, inputs: Sequence[str], outputs: Sequence[str], domain: str = "") -> bytes:
    """Encode a NodeProto."""
    names = b"".join(field(1, name) for name in inputs) + b"".join(field(2, name) for name in outputs)
    return names + field(4, kind) + (field(7, domain) if domain else b"")


def value(name: str, shape: Sequence[int | str], kind: int = FLOAT) -> bytes:
    """Encode a ValueInfoProto; a size that is a text is open."""
    sizes = b"".join(field(1, field(1 if isinstance(size, int) else 2, size)) for size in shape)
    return field(1, name) + field(2, field(1, field(1, kind) + field(2, sizes)))


def tensor(name: str, numbers: np.ndarray) -> bytes:
    """Encode a TensorProto."""
    numbers = np.asarray(numbers, dtype=np.float32)
    sizes = b"".join(field(1, size) for size in numbers.shape)
    raw = struct.pack(f"<{numbers.size}f", *numbers.ravel())
    return sizes + field(2, FLOAT) + field(8, name) + field(9, raw)


def write(
    path: Path,
    nodes: Sequence[bytes],
    inputs: Sequence[bytes],
    outputs: Sequence[bytes],
    constants: Mapping[str, np.ndarray],
    *,
    metadata: Mapping[str, str] = MappingProxyType({}),
    domains: Sequence[str] = ("",),
) -> Path:
    """Write a ModelProto of opset 17; returns its path."""
    graph = b"".join(
        field(number, content)
        for number, contents in ((1, nodes), (5, [tensor(*each) for each in constants.items()]), (11, inputs))
        for content in contents
    )
    graph += field(2, "graph") + b"".join(field(12, content) for content in outputs)
    model = field(1, 8) + field(7, graph) + b"".join(field(8, field(1, each) + field(2, 17)) for each in domains)
    model += b"".join(field(14, field(1, key) + field(2, text)) for key, text in metadata.items())
    path.write_bytes(model)
    return path


def write_layers(
    path: Path, layers: Sequence[tuple[np.ndarray, np.ndarray]], metadata: Mapping[str, str] = MappingProxyType({})
) -> Path:
    """Write a network of layers x @ weights + offset with tanh between them; returns its path.

    Args:
        path: The file.
        layers: Weights, shape (inputs, outputs), and offsets, shape (outputs,).
        metadata: Texts that the file keeps; of those of mjlab the component `policy` takes what its tags leave out.
    """
    nodes: list[bytes] = []
    constants: dict[str, np.ndarray] = {}
    before = "obs"
    for number, (weights, offset) in enumerate(layers):
        is_last = number == len(layers) - 1
        constants |= {f"weights_{number}": weights, f"offset_{number}": offset}
        nodes.append(node("MatMul", (before, f"weights_{number}"), (f"product_{number}",)))
        after = "actions" if is_last else f"sum_{number}"
        nodes.append(node("Add", (f"product_{number}", f"offset_{number}"), (after,)))
        if not is_last:
            before = f"hidden_{number}"
            nodes.append(node("Tanh", (after,), (before,)))
    inputs = [value("obs", (1, len(layers[0][0])))]
    return write(path, nodes, inputs, [value("actions", (1, len(layers[-1][1])))], constants, metadata=metadata)
