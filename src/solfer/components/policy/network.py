"""A network in an ONNX file, run by onnxruntime without a copy of its inputs and outputs."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from solfer.errors import ComponentError, MissingDependency, SizeMismatch
from solfer.files import open_regular
from solfer.installation import pip_install

LARGEST = 200_000_000
"""Most bytes of a file."""

_FLOATS = "tensor(float)"


class PolicyNetwork:
    """A network with one input of observations, one output of actions, and states that its outputs hand to its inputs.

    A state is an input that has an output of its name, or `h_in` with `h_out`, or `h` with `h_out`, `hn` or `h_n`.

    Args:
        path: The file.
        where: Place that names it, for errors.

    Attributes:
        observations: What it observes, shape (n,) float32; live, to be written before `run`.
        actions: What it computes of them, shape (m,) float32; live.
        metadata: Texts of the file by their names.
        states: Names of its states.

    Raises:
        MissingDependency: onnxruntime is not installed.
        ComponentError: The file cannot be read, or is no such network.
    """

    def __init__(self, path: Path, where: str = ""):
        self._where = where
        content = _content(path, where)
        options = _runtime().SessionOptions()
        options.intra_op_num_threads = 1  # a network of this size is slower on several, which wait for each other
        options.inter_op_num_threads = 1
        options.log_severity_level = 4  # what is wrong is raised, too
        try:
            self._session = _runtime().InferenceSession(content, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # one of a dozen classes of the library, which have no other base
            what = f"'{path.name}' is no network that onnxruntime can load: {_first_line(error)}"
            raise ComponentError(what, where=where, expected="an ONNX file with ONNX's own operators alone") from error
        self.metadata: Mapping[str, str] = self._session.get_modelmeta().custom_metadata_map
        inputs = {each.name: each for each in self._session.get_inputs()}
        outputs = {each.name: each for each in self._session.get_outputs()}
        pairs = dict(_states(inputs, outputs))
        self.states = tuple(pairs)
        self._binding = self._session.io_binding()
        source = self._one("input", {name: inputs[name] for name in inputs if name not in pairs})
        result = self._one("output", {name: outputs[name] for name in outputs if name not in pairs.values()})
        self.observations = self._bound(source, is_input=True).reshape(-1)
        self.actions = self._bound(result, is_input=False).reshape(-1)
        self._fed = [
            (self._bound(inputs[name], is_input=True), self._bound(outputs[other], is_input=False))
            for name, other in pairs.items()
        ]
        for (name, other), (state, following) in zip(pairs.items(), self._fed, strict=True):
            if state.shape != following.shape:
                what = f"the state '{name}' has the shape {state.shape}, and '{other}' {following.shape}"
                raise SizeMismatch(what, where=where, expected="one shape of both")
        self._run_once(path.name)

    def run(self) -> None:
        """Compute `actions` of `observations`, and hand the states on."""
        self._session.run_with_iobinding(self._binding)
        for state, following in self._fed:
            np.copyto(state, following)

    def reset(self) -> None:
        """Forget the states."""
        for state, _ in self._fed:
            state[:] = 0.0

    def _one(self, kind: str, found: Mapping[str, Any]) -> Any:
        """Return the single input or output that is no state."""
        if len(found) == 1:
            return next(iter(found.values()))
        names = ", ".join(found) or "none"
        what = f"the network has {len(found)} {kind}s beside its states: {names}"
        raise ComponentError(what, where=self._where, expected=f"one {kind}; states by the names `h_in` and `h_out`")

    def _bound(self, node: Any, is_input: bool) -> np.ndarray:
        """Bind an array to an input or output; sizes that the file leaves open, as that of a batch, are one."""
        if node.type != _FLOATS:
            raise ComponentError(f"'{node.name}' is a {node.type}", where=self._where, expected=_FLOATS)
        if not node.shape or not isinstance(node.shape[-1], int):
            what = f"'{node.name}' has the shape {node.shape}"
            raise ComponentError(what, where=self._where, expected="a last size that the file says, as in (1, 45)")
        shape = tuple(size if isinstance(size, int) else 1 for size in node.shape)
        if np.prod(shape, dtype=float) > 1e6:
            raise ComponentError(
                f"'{node.name}' has the shape {node.shape}", where=self._where, expected="at most a million numbers"
            )
        array = np.zeros(shape, dtype=np.float32)
        bind = self._binding.bind_input if is_input else self._binding.bind_output
        bind(node.name, "cpu", 0, element_type=np.float32, shape=shape, buffer_ptr=array.ctypes.data)
        return array

    def _run_once(self, name: str) -> None:
        """Run it for the first time, which takes longer, and shows what the declared shapes hide."""
        try:
            self.run()
        except Exception as error:
            what = f"'{name}' does not run: {_first_line(error)}"
            raise ComponentError(what, where=self._where, expected="a network for a batch of one") from error
        self.reset()


def _states(inputs: Mapping[str, Any], outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the names of inputs and outputs that are states."""
    for name in inputs:
        stem = name.removesuffix("_in")
        for other in (name, f"{stem}_out", f"{stem}n", f"{stem}_n"):
            if other in outputs:
                yield name, other
                break


def _runtime() -> Any:
    try:
        import onnxruntime
    except ImportError as error:
        expected = pip_install("solfer[policy]", file="requirements-policy.txt")
        raise MissingDependency("a policy needs onnxruntime", expected=expected) from error
    return onnxruntime


def _content(path: Path, where: str) -> bytes:
    """Read a file whole; so the network cannot have others beside it, of any size."""
    try:
        with open_regular(path) as file:
            content = file.read(LARGEST + 1)
    except OSError as error:
        why = error.strerror or error
        raise ComponentError(f"'{path}' cannot be read: {why}", where=where, expected="an ONNX file") from error
    if len(content) > LARGEST:
        raise ComponentError(
            f"'{path.name}' has more than {LARGEST // 10**6} MB", where=where, expected="a smaller network"
        )
    return content


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0][:300]
