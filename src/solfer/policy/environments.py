"""Several environments at once, each in a process of its own."""

import multiprocessing
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from solfer.policy.environment import Environment


class Environments:
    """Environments in processes that step at once; an episode that ends is followed by the next one.

    `info` of the last step has its observations as `final_observation`; those of the step are the next episode's.

    Args:
        make: Makes one environment; a function of a module, which the processes import.
        count: Number of processes.

    Attributes:
        observation_space, action_space: Those of one environment.
    """

    def __init__(self, make: Callable[[], Environment], count: int):
        context = multiprocessing.get_context("spawn")  # a copy of a process with threads of libraries may wait forever
        self._ends: list[Connection] = []
        self._processes = []
        for _ in range(count):
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(make, theirs), daemon=True)
            process.start()
            theirs.close()
            self._ends.append(ours)
            self._processes.append(process)
        try:
            self.observation_space, self.action_space = self._call("spaces", [None] * count)[0]
        except BaseException:
            self.close()
            raise

    def __len__(self) -> int:
        return len(self._ends)

    def reset(self, *, seed: int | None = None) -> tuple[np.ndarray, list[dict[str, Any]]]:
        """Begin all, each with a seed of its own that follows from `seed`; returns observations, shape (count, n)."""
        seeds = np.random.SeedSequence(seed).generate_state(len(self)).tolist()
        found = self._call("reset", seeds)
        return np.array([observed for observed, _ in found]), [info for _, info in found]

    def step(
        self, actions: Sequence[np.ndarray] | np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Step all with actions, shape (count, m); see `Environment.step`, the first four have one more axis."""
        observed, rewards, terminated, truncated, infos = zip(*self._call("step", list(actions)), strict=True)
        return np.array(observed), np.array(rewards), np.array(terminated), np.array(truncated), list(infos)

    def close(self) -> None:
        """End the processes. May be called twice."""
        for end in self._ends:
            end.close()
        for process in self._processes:
            process.join(5.0)
            if process.is_alive():
                process.kill()
        self._ends.clear()
        self._processes.clear()

    def _call(self, what: str, arguments: Sequence[Any]) -> list[Any]:
        for end, argument in zip(self._ends, arguments, strict=True):
            end.send((what, argument))
        answers = [end.recv() for end in self._ends]
        for answer in answers:
            if isinstance(answer, Exception):
                raise answer
        return answers


def _serve(make: Callable[[], Environment], end: Connection) -> None:
    """Answer until the other end is closed."""
    environment: Environment | None = None
    while True:
        try:
            what, argument = end.recv()
        except (EOFError, KeyboardInterrupt):
            break
        try:
            environment = environment or make()
            end.send(_answer(environment, what, argument))
        except Exception as error:
            end.send(error)
    if environment is not None:
        environment.close()


def _answer(environment: Environment, what: str, argument: Any) -> Any:
    if what == "spaces":
        return environment.observation_space, environment.action_space
    if what == "reset":
        return environment.reset(seed=argument)
    observed, reward, terminated, truncated, info = environment.step(argument)
    if terminated or truncated:
        info["final_observation"] = observed
        observed, _ = environment.reset()
    return observed, reward, terminated, truncated, info
