"""A world of MuJoCo: its model, which grows until it is used, and its steps."""

from collections.abc import Iterator, Sequence
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from solfer.simulation.mujoco.library import load_mujoco
from solfer.simulation.physics import STEP, ContactPoint

RIGID = (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""`solimp` of motors, gears, limits and friction of joints: as rigid as MuJoCo allows."""

ROBOT = "robot:"
"""Begin of the names of robots' bodies and joints."""


class Touching(IntEnum):
    """What a shape belongs to: parts of a robot do not touch each other."""

    ROBOT = 1
    WORLD = 2

    def prepare(self, shape: Any) -> None:
        """Let a shape of a specification touch the world, with friction along two directions."""
        shape.contype = self
        shape.conaffinity = Touching.WORLD if self == Touching.ROBOT else Touching.ROBOT | Touching.WORLD
        shape.condim = 3
        shape.priority = 1 if self == Touching.ROBOT else 0
        shape.solref[:] = 0.004, 1.0  # a robot that stands sinks in by g times the square of it, 0.2 mm
        shape.solimp[:] = 0.99, 0.99, 0.001, 0.5, 2.0


class Motors(NamedTuple):
    """Motors that hold speeds, and friction, which is a motor that holds zero; live, for all DoFs.

    Attributes:
        speed: Speeds that they hold, shape (nv,) [rad/s, m/s].
        effort: What they did in the newest step, shape (nv,) [Nm, N].
    """

    speed: np.ndarray
    effort: np.ndarray


class SavedState(NamedTuple):
    """Where everything is and how it moves.

    Attributes:
        numbers: MuJoCo's state with what its solver begins from.
        effort: Efforts of the motors, shape (nv,).
        contacts: Where the world pushed the robot.
    """

    numbers: np.ndarray
    effort: np.ndarray
    contacts: list[ContactPoint]


class MujocoWorld:
    """Bodies in a world with gravity. Every change of `spec` needs `change` before it.

    Contacts have elliptic cones and are solved by Newton's method; a step is one of semi-implicit Euler with the
    damping of joints at its end. Friction coefficients of two bodies are multiplied: MuJoCo itself takes the one of a
    robot, so that constraints are made again only where a part of the world has another one than 1.

    Attributes:
        mujoco: The module.
        spec: What the model is made of.
        motors: Motors of all DoFs.
        bodies: Names of the bodies that are numbered.
    """

    def __init__(self) -> None:
        self.mujoco: Any = load_mujoco()
        self.spec = self.mujoco.MjSpec()
        option = self.spec.option
        option.timestep = STEP
        option.integrator = self.mujoco.mjtIntegrator.mjINT_EULER
        option.cone = self.mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = 10.0  # friction is that much stiffer than the normal force: wheels do not creep
        option.tolerance = 1e-10
        option.disableflags |= self.mujoco.mjtDisableBit.mjDSBL_AUTORESET  # whoever steps sees a divergence
        self.bodies: list[str] = []
        self._friction: dict[str, float] = {}
        self._model: Any = None
        self._data: Any = None
        self._is_stale = True

    @property
    def model(self) -> Any:
        """The compiled model."""
        self.compile()
        return self._model

    @property
    def data(self) -> Any:
        """The state of the model."""
        self.compile()
        return self._data

    def compile(self) -> None:
        """Make the model of `spec`, where it has changed.

        Raises:
            ValueError: MuJoCo cannot make it.
        """
        if self._is_stale:
            self._compile()

    def shapes(self, bodies: Sequence[str]) -> np.ndarray:
        """Find the shapes of bodies that touch others."""
        model = self.model
        numbers = [model.body(body).id for body in bodies]
        return np.flatnonzero(np.isin(model.geom_bodyid, numbers) & (model.geom_contype > 0))

    def change(self) -> None:
        """Note that `spec` changes; positions and velocities stay."""
        self._is_stale = True

    def probe(self) -> Any:
        """Compute where all bodies are in a state of its own, which says nothing of forces, and return it."""
        np.copyto(self._probe.qpos, self.data.qpos)
        self.mujoco.mj_kinematics(self._model, self._probe)
        return self._probe

    def set_friction(self, body: str, coefficient: float) -> None:
        """Change the friction coefficient of a body."""
        self._friction[body] = coefficient
        if not self._is_stale:
            self._set_friction(body)

    def hold_speeds(self, dofs: np.ndarray, speeds: np.ndarray, efforts: Sequence[float]) -> None:
        """Let motors hold speeds, see `JointGroup.hold_speeds`."""
        loss = self.model.dof_frictionloss
        if not np.array_equal(loss[dofs], efforts):
            loss[dofs] = efforts
            self._find_motors()
        self.motors.speed[dofs] = speeds

    def push(self, body: int, force: Sequence[float], torque: Sequence[float], position: Sequence[float]) -> None:
        """Let a wrench act on a body in the next step, see `RobotInEngine.push`."""
        self._pushes.append((body, np.array(force), np.array(torque), np.array(position)))

    def step(self) -> None:
        """Advance by STEP."""
        mujoco, model, data = self.mujoco, self.model, self._data
        mujoco.mj_step1(model, data)
        if self._is_mixed:
            self._mix_friction()
        if len(self._held):
            rows = data.ne + self._rows  # friction of DoFs follows the equalities
            data.efc_aref[rows] += data.efc_KBIP[rows, 1] * self.motors.speed[self._held]
        for body, force, torque, position in self._pushes:
            data.xfrc_applied[body, :3] += force
            data.xfrc_applied[body, 3:] += torque + np.cross(position - data.xipos[body], force)
        mujoco.mj_step2(model, data)
        if len(self._held):
            self.motors.effort[self._held] = data.efc_force[rows]
        data.qfrc_applied[:] = 0.0
        if self._pushes:
            data.xfrc_applied[:] = 0.0
            self._pushes.clear()
        self._contacts = None

    def contacts(self) -> list[ContactPoint]:
        """List where the world pushed robots in the newest step."""
        if self._contacts is None:
            self._contacts = list(self._find_contacts())
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

    def _compile(self) -> None:
        if self._model is None:
            self._model = self.spec.compile()
            self._data = self.mujoco.MjData(self._model)
        else:
            self._model, self._data = self.spec.recompile(self._model, self._data)
        self._probe = self.mujoco.MjData(self._model)
        self._is_stale = False
        self._contacts: list[ContactPoint] | None = []
        self._pushes: list[tuple[int, np.ndarray, np.ndarray, np.ndarray]] = []
        self.motors = Motors(np.zeros(self._model.nv), np.zeros(self._model.nv))
        self._find_motors()
        self._is_mixed = False
        self._coefficients = np.ones(self._model.ngeom)
        for body in self._friction:
            self._set_friction(body)

    def _find_motors(self) -> None:
        """Find the DoFs with friction or motors, and their rows behind the equalities."""
        self._held = np.flatnonzero(self._model.dof_frictionloss > 0.0)
        self._rows = np.arange(len(self._held))

    def _set_friction(self, body: str) -> None:
        model = self._model
        shapes = model.geom_bodyid == model.body(body).id
        self._coefficients[shapes] = model.geom_friction[shapes, 0] = self._friction[body]
        of_world = model.geom_contype == Touching.WORLD
        self._is_mixed = bool(np.any(self._coefficients[of_world] != 1.0))

    def _mix_friction(self) -> None:
        """Multiply the friction coefficients of what touches, and make the constraints again where that matters."""
        mujoco, model, data = self.mujoco, self._model, self._data
        contact = data.contact
        product = np.maximum(self._coefficients[contact.geom].prod(axis=1), 1e-5)  # MuJoCo takes nothing smaller
        if np.array_equal(product, contact.friction[:, 0]):
            return
        contact.friction[:, :2] = product[:, None]
        mujoco.mj_makeConstraint(model, data)
        mujoco.mj_island(model, data)
        mujoco.mj_projectConstraint(model, data)
        mujoco.mj_referenceConstraint(model, data)

    def _find_contacts(self) -> Iterator[ContactPoint]:
        model, data = self.model, self.data
        contact = data.contact
        wrench = np.empty(6)
        for index, pair in enumerate(contact.geom.tolist()):
            if contact.efc_address[index] < 0:
                continue
            self.mujoco.mj_contactForce(model, data, index, wrench)
            if wrench[0] <= 0.0:
                continue
            frame = contact.frame[index].reshape(3, 3)  # its first row is the normal, from the first geom to the second
            force = wrench[:3] @ frame
            half = 0.5 * contact.dist[index] * frame[0]
            for geom, sign in zip(pair, (-1.0, 1.0), strict=True):
                if model.geom_contype[geom] == Touching.ROBOT:
                    link = model.body(model.geom_bodyid[geom]).name.removeprefix(ROBOT)
                    place = contact.pos[index] + sign * half
                    yield ContactPoint(link, tuple(place.tolist()), tuple((sign * force).tolist()))
