"""The component `inverse_dynamics`: joint torques that let tasks follow their references on contacts."""

from solfer.components.inverse_dynamics.component import InverseDynamics

__all__ = ["InverseDynamics"]
