"""Topics in shared memory: layouts of messages, one segment for each sender, endpoints."""
