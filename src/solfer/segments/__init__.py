"""Memory that processes share: segments, locks, slots, rings, and the namespace's folder."""
