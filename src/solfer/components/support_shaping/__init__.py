"""Support shaping: wheeled motion that keeps the balance inside the support polygon, and the legs within reach."""

from solfer.components.support_shaping.component import SupportShaping

__all__ = ["SupportShaping"]
