"""Telemetry of the real-time layer: statistics, health, recordings."""
