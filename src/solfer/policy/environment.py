"""A robot in a simulation, as programs that train networks use it: the interface of Gymnasium."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from solfer.config import load
from solfer.errors import ComponentError
from solfer.policy.bench import Bench
from solfer.policy.learner import Learner
from solfer.policy.spaces import box
from solfer.simulation.bundle import find_robot, read_bundle
from solfer.simulation.physics import STEP
from solfer.simulation.server.publications import robot_parameters
from solfer.simulation.simulation import Simulation

Reward = Callable[["Environment"], tuple[float, bool]]
"""Returns the reward of a step, and whether the episode ends for good."""

Begin = Callable[["Environment"], None]
"""Draws what differs from episode to episode."""


class Environment:
    """The plugin of a policy on its simulated robot, whose actions come from outside.

    Observations, targets and torques are those of the plugin: the same component computes them, at the plugin's rate,
    of the same Robot. `metadata`, `render_mode` and `unwrapped` are there because programs look at them.

    Args:
        configuration: Main configuration with the policy as a module; its `file` need not exist yet.
        module: Name of this module.
        robot: Name or file of the robot's bundle; sensors have the errors that are written there.
        reward: Function of the user; what it needs are attributes.
        begin: Function of the user that is called in each `reset`, before the episode begins; draws by `random`, and
            may call `scale_masses` first of all, then `simulation.set_friction` and `simulation.reset`.
        duration: Length of an episode [s].
        world: File of the world; None: a plane.

    Attributes:
        simulation: The simulated robot; `simulation.pushes.add` pushes it.
        component: The policy.
        velocity: Commanded velocity of the base in its own axes: x, y [m/s], yaw rate [rad/s], shape (3,); live.
        action: The newest action, shape (m,).
        random: Generator of all that is drawn.
        options: Options of the newest `reset`.
        observation_space, action_space: See Gymnasium.

    Raises:
        SolferError: The configuration, the robot or the contract is wrong.
    """

    metadata: Mapping[str, Any] = {"render_modes": []}
    render_mode = None

    def __init__(
        self,
        configuration: str | Path,
        module: str,
        robot: str | Path,
        reward: Reward,
        *,
        begin: Begin | None = None,
        duration: float = 20.0,
        world: str | Path | None = None,
    ):
        loaded = load(str(configuration), module)
        bundle = read_bundle(find_robot(str(robot)))
        parameters = robot_parameters(bundle)
        self._make = lambda urdf: Simulation.from_file(bundle, description_text=urdf, world=world)
        self._masses = 1.0
        self._urdf = parameters["/robot_description"]
        self.simulation = self._make(None)
        try:
            senses = any(_errs(getattr(bundle.sensors, kind)) for kind in ("joint_noise", "imu"))
            self._bench = Bench(loaded, self.simulation, parameters, senses)
            self.component = Learner(self._bench.robot, loaded.tags(Learner.Tags), module)
            self.component.set_rate(loaded.rate)
            self._bench.connect(self.component.commanded)
        except Exception:
            self.simulation.close()
            raise
        self._steps = round(1.0 / (loaded.rate * STEP))
        if abs(self._steps * loaded.rate * STEP - 1.0) > 1e-9:
            what = f"a plugin at {loaded.rate:g} Hz in a simulation of {1.0 / STEP:g} Hz"
            raise ComponentError(what, where=loaded.where("robot", "rate"), expected="the latter by a whole number")
        self._functions = reward, begin
        self._longest = round(duration * self.component.tags.rate)
        self.velocity = np.zeros(3)
        self.action = self.component.network.actions
        self.observation_space = box(len(self.component.network.observations), np.inf)
        self.action_space = box(len(self.action), self.component.tags.action.clip)
        self.random = np.random.default_rng()
        self.options: Mapping[str, Any] = {}

    @property
    def unwrapped(self) -> "Environment":
        """Itself."""
        return self

    @property
    def robot(self) -> Any:
        """The plugin's Robot, with its measured state and its commands."""
        return self._bench.robot

    @property
    def time(self) -> float:
        """Time since the episode began [s]."""
        return self.component.steps / self.component.tags.rate

    @property
    def tilt(self) -> float:
        """Angle between the vertical and the z axis of the base in truth [rad]."""
        base = self.simulation.state.base
        rotation = np.eye(3) if base is None else self.simulation.state.now.rotation(base.link)
        return float(np.arccos(np.clip(rotation[2, 2], -1.0, 1.0)))

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; returns the observations and a dict that is empty. A `seed` begins all draws again.

        Raises:
            ComponentError: The policy refuses to start, as where a joint is too far from the default pose.
        """
        if seed is not None:
            self.random = np.random.default_rng(seed)
        self.options = options or {}
        self.velocity[:] = 0.0
        self.simulation.reset(seed=int(self.random.integers(2**31)))
        begin = self._functions[1]
        if begin is not None:
            begin(self)
        self.action[:] = 0.0
        component = self.component
        self._bench.measure()
        component.begin()
        component.command_base(self.velocity)
        component.observe()
        if component.fault:
            what = f"'{component.name}' does not start: {component.fault}"
            raise ComponentError(what, where="reset", expected="a start that it accepts")
        component.send()
        self._bench.begin()
        return component.network.observations.copy(), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Act until the next observations, a step of the network later.

        Returns:
            Observations, reward, whether the episode ended for good, whether its time is over, and `fault` where the
            policy holds the robot: it has ended then.
        """
        component = self.component
        bench = self._bench
        simulation = self.simulation
        self.action[:] = action
        component.act()
        component.command_base(self.velocity)
        is_due = False
        while not is_due and not component.fault:
            component.send()
            bench.command()
            for _ in range(self._steps):
                simulation.step()
            bench.measure()
            is_due = component.observe()
        fault = component.fault or simulation.lower_level.safeguard.reason
        reward, terminated = self._functions[0](self)
        info = {"fault": fault} if fault else {}
        is_over = component.steps >= self._longest
        return component.network.observations.copy(), reward, terminated or bool(fault), is_over, info

    def scale_masses(self, factor: float) -> None:
        """Multiply masses and inertias of the simulated robot, not of the model; where that changes them it is made."""
        if factor == self._masses:
            return
        simulation = self._make(scaled(self._urdf, factor))
        self.simulation.close()
        self._masses = factor
        self.simulation = self._bench.simulation = simulation
        self._bench.connect(self.component.commanded)

    def render(self) -> None:
        """Draw nothing: `solfer view` shows robots that run."""

    def close(self) -> None:
        """Release the simulation. May be called twice."""
        self.simulation.close()


def _errs(sensor: Any) -> bool:
    """Return whether the record of a sensor has errors."""
    mounting = {"link", "offset_position", "offset_orientation", "exact"}
    return sensor is not None and not sensor.exact and not sensor.model_fields_set <= mounting


def scaled(urdf: str, factor: float) -> str:
    """Multiply all masses and inertias of a URDF by a factor."""

    def multiplied(match: re.Match[str]) -> str:
        return re.sub(r'"(-?[\d.e+-]+)"', lambda number: f'"{float(number[1]) * factor!r}"', match[0])

    return re.sub(r"<mass [^>]*>|<inertia [^>]*>", multiplied, urdf)
