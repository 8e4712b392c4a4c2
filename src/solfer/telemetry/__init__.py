"""Telemetry of loops: statistics, health, recordings."""

STATISTICS = "statistics"
"""File and kind of the segment of statistics, which the executor of an RT layer owns as long as it lives."""
