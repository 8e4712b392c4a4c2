"""Everything in one process on a virtual clock: deterministic, and as fast as it can be."""

from solfer.middleware.memory.bus import Bus
from solfer.middleware.memory.faults import FaultsRecord, read_faults
from solfer.middleware.memory.middleware import MemoryMiddleware

__all__ = ["Bus", "FaultsRecord", "MemoryMiddleware", "read_faults"]
