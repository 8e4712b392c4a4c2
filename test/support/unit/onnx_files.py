"""Small ONNX files."""

from pathlib import Path

import numpy as np

from solfer.policy.onnx_file import INT64, field, node, tensor, value, varint, write

__all__ = ["INT64", "counting", "field", "linear", "node", "tensor", "value", "varint", "write"]


def linear(path: Path, weights: np.ndarray, offset: np.ndarray, batch: int | str = 1, **options) -> Path:
    """Write a network actions = obs @ weights + offset; weights have the shape (observations, actions)."""
    nodes = [node("MatMul", ("obs", "weights"), ("product",)), node("Add", ("product", "offset"), ("actions",))]
    observations, actions = np.shape(weights)
    inputs = [value("obs", (batch, observations))]
    outputs = [value("actions", (batch, actions))]
    return write(path, nodes, inputs, outputs, {"weights": weights, "offset": offset}, **options)


def counting(path: Path, observations: int, actions: int) -> Path:
    """Write a network whose actions are its state, `h_in`, which grows by one each time: its run count."""
    nodes = [
        node("Add", ("h_in", "one"), ("h_out",)),
        node("MatMul", ("obs", "zero"), ("product",)),
        node("Add", ("product", "h_out"), ("actions",)),
    ]
    inputs = [value("obs", (1, observations)), value("h_in", (1, actions))]
    outputs = [value("actions", (1, actions)), value("h_out", (1, actions))]
    constants = {"one": np.ones((1, actions)), "zero": np.zeros((observations, actions))}
    return write(path, nodes, inputs, outputs, constants)
