"""Services in shared memory: a ring of requests and a ring of replies."""
