"""A world of MuJoCo: its model, which grows until it is used, and its steps."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from solfer.simulation.mujoco.library import load_mujoco
from solfer.simulation.mujoco.motors import Motors
from solfer.simulation.mujoco.touching import Frictions, contact_points
from solfer.simulation.physics import STEP, ContactPoint


class SavedState(NamedTuple):
    """Where everything is and how it moves.

    Attributes:
        numbers: MuJoCo's state with what its solver begins from.
        effort: Efforts of the motors, shape (nv,).
        contacts: Where the world pushed robots.
    """

    numbers: np.ndarray
    effort: np.ndarray
    contacts: list[ContactPoint]


class Push(NamedTuple):
    """A wrench on a body, in world axes, each of shape (3,) [N], [Nm], and the point at which its force acts [m]."""

    body: int
    force: np.ndarray
    torque: np.ndarray
    position: np.ndarray


class MujocoWorld:
    """Bodies in a world with gravity. A change of `spec` begins with a call of `change`.

    A step is one of semi-implicit Euler, with the damping of joints at its end. Contacts have elliptic cones, and
    Newton's method solves them.

    Attributes:
        mujoco: The module.
        spec: What the model is made of.
        bodies: Names of the bodies that are numbered.
    """

    def __init__(self) -> None:
        self.mujoco: Any = load_mujoco()
        self._mj_step = self.mujoco.mj_step
        self.spec = self.mujoco.MjSpec()
        option = self.spec.option
        option.timestep = STEP
        option.integrator = self.mujoco.mjtIntegrator.mjINT_EULER
        option.cone = self.mujoco.mjtCone.mjCONE_ELLIPTIC
        option.tolerance = 1e-10
        option.disableflags |= self.mujoco.mjtDisableBit.mjDSBL_AUTORESET  # the simulation finds a divergence
        self.bodies: list[str] = []
        self._friction: dict[str, float] = {}
        self._is_stale = True
        self._model: Any = None
        self._pushes: list[Push] = []
        self._contacts: list[ContactPoint] | None = []

    @property
    def model(self) -> Any:
        """The compiled model."""
        if self._is_stale:
            self.compile()
        return self._model

    @property
    def data(self) -> Any:
        """The state of the model."""
        if self._is_stale:
            self.compile()
        return self._data

    @property
    def motors(self) -> Motors:
        """The motors of all DoFs."""
        if self._is_stale:
            self.compile()
        return self._motors

    def change(self) -> None:
        """Note that `spec` changes; positions and velocities stay, what motors do does not."""
        self._is_stale = True

    def compile(self) -> None:
        """Make the model of `spec`, where it has changed.

        Raises:
            ValueError: MuJoCo cannot make it.
        """
        if not self._is_stale:
            return
        if self._model is None:
            self._model = self.spec.compile()
            self._data = self.mujoco.MjData(self._model)
        else:
            self._model, self._data = self.spec.recompile(self._model, self._data)
        self._is_stale = False
        self._probe = self.mujoco.MjData(self._model)
        self._motors = Motors(self._model, self._data)
        self._frictions = Frictions(self.mujoco, self._model)
        for body, coefficient in self._friction.items():
            self._frictions.set(body, coefficient)

    def shapes(self, bodies: Sequence[str]) -> np.ndarray:
        """Find the shapes of bodies that touch others."""
        model = self.model
        numbers = [model.body(body).id for body in bodies]
        return np.flatnonzero(np.isin(model.geom_bodyid, numbers) & (model.geom_contype > 0))

    def probe(self) -> Any:
        """Compute where all bodies are, in a state of its own that knows no forces, and return it."""
        places = self.data.qpos
        np.copyto(self._probe.qpos, places)
        self.mujoco.mj_kinematics(self._model, self._probe)
        return self._probe

    def set_friction(self, body: str, coefficient: float) -> None:
        """Change the friction coefficient of a body."""
        self._friction[body] = coefficient
        if not self._is_stale:
            self._frictions.set(body, coefficient)

    def push(self, push: Push) -> None:
        """Let a wrench act in the next step."""
        self._pushes.append(push)

    def step(self) -> None:
        """Advance by STEP."""
        data = self.data
        if self._pushes or self._motors.turn or self._frictions.are_mixed:
            self._step_in_two()
        else:
            self._mj_step(self._model, data)
        self._motors.age()
        data.qfrc_applied[:] = 0.0
        self._contacts = None

    def _step_in_two(self) -> None:
        """Make a step, and change its constraints and wrenches once MuJoCo knows where everything is."""
        model = self._model
        data = self._data
        self.mujoco.mj_step1(model, data)
        if self._frictions.are_mixed:
            self._frictions.mix(data)
        if self._motors.turn:
            self._motors.move()
        wrench = data.xfrc_applied
        for body, force, torque, position in self._pushes:
            wrench[body, :3] += force
            wrench[body, 3:] += torque + np.cross(position - data.xipos[body], force)
        self.mujoco.mj_step2(model, data)
        if self._pushes:
            wrench[:] = 0.0
            self._pushes.clear()

    def contacts(self) -> list[ContactPoint]:
        """List where the world pushed robots in the newest step."""
        if self._contacts is None:
            self._contacts = list(contact_points(self.mujoco, self._model, self._data))
        return self._contacts

    def forget_contacts(self) -> None:
        """Let the next step begin from nothing."""
        self.data.qacc_warmstart[:] = 0.0
        self._contacts = []

    def save(self) -> SavedState:
        """Save where all bodies are and how they move."""
        kind = self.mujoco.mjtState.mjSTATE_INTEGRATION
        numbers = np.empty(self.mujoco.mj_stateSize(self.model, kind))
        self.mujoco.mj_getState(self.model, self.data, numbers, kind)
        return SavedState(numbers, self.motors.effort.copy(), self.contacts())

    def restore(self, state: SavedState) -> None:
        """Restore what was saved."""
        self.mujoco.mj_setState(self.model, self.data, state.numbers, self.mujoco.mjtState.mjSTATE_INTEGRATION)
        self.motors.effort[:] = state.effort
        self._contacts = state.contacts
        self._pushes.clear()
