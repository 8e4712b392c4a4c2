"""Actions of `solfer params`, and the callers of services that they use."""
