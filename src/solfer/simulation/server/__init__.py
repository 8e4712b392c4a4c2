"""A simulation as plugins see it: topics, services, pace, and hooks between its steps."""
