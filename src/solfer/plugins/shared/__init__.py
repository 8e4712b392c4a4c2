"""The shared plugin: components in one process, in a fixed order, on shared Robots (section 2.3 of the paper)."""

from solfer.plugins.shared.shared_plugin import Members, budget_of, generate_shared

__all__ = ["Members", "budget_of", "generate_shared"]
