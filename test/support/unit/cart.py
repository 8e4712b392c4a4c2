"""A floating cart with an arm on springs and a wheel on a motor, and commands for it."""

import numpy as np

from solfer.lower_level import GainRecord, JointControllerRecord, LowerLevelRecord, build_lower_level
from solfer.lower_level.claims.request import requested
from solfer.model import Description, Kinematics
from solfer.transport.lower_level import ClaimRequest
from solfer.transport.messages import JointMessage

URDF = """<robot name="cart">
  <link name="world"/>
  <link name="base"><inertial><mass value="5"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="wheel"><inertial><mass value="1"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="free" type="floating"><parent link="world"/><child link="base"/></joint>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="40"/></joint>
  <joint name="roll" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 1 0"/>
    <limit velocity="10" effort="20"/></joint>
</robot>"""
GROUPS = {"wheels": ("roll",), "nothing": ("free",)}
GAINS = {"shoulder": GainRecord(stiffness=200.0, damping=2.0)}
DT = 0.001  # [s]
RECORDS = {
    "arm": JointControllerRecord(type="impedance", **{"except": "wheels"}),
    "wheel": JointControllerRecord(type="velocity", group="wheels"),
}


def make(**record):
    """Make a cart with an arm and a wheel at rest."""
    kinematics = Kinematics(Description.from_text(URDF))
    made = build_lower_level(kinematics, RECORDS, GROUPS, GAINS, LowerLevelRecord(**record))
    made.start(np.zeros(8))
    return made


def turn(lower_level, sender, speed=1.0, component=""):
    """Command the wheel."""
    message = JointMessage(("roll",), velocity=np.array([speed]), sender=sender, component=component)
    lower_level.accept("wheel", message)


def bend(lower_level, sender, component="", **fields):
    """Command the arm."""
    fields = {name: np.array([value]) for name, value in fields.items()}
    lower_level.accept("arm", JointMessage(("shoulder",), sender=sender, component=component, **fields))


def claim(lower_level, owner, controllers, modes=(), joints=()):
    """Claim as the service does."""
    lower_level.claim(owner, requested(lower_level.controllers, ClaimRequest(owner, controllers, modes, joints)))


def advance(lower_level, duration):
    """Let time [s] pass."""
    for _ in range(round(duration / DT)):
        lower_level.update(np.zeros(8), np.zeros(8), DT)
