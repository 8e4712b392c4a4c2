"""The lower level's interface to plugins: topics, services, and the heartbeat of the commanding process."""
