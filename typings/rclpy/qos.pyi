from enum import IntEnum

class ReliabilityPolicy(IntEnum):
    RELIABLE = 1
    BEST_EFFORT = 2

class DurabilityPolicy(IntEnum):
    TRANSIENT_LOCAL = 1
    VOLATILE = 2

class HistoryPolicy(IntEnum):
    KEEP_LAST = 1
    KEEP_ALL = 2

class QoSProfile:
    def __init__(
        self,
        *,
        depth: int,
        history: HistoryPolicy = ...,
        reliability: ReliabilityPolicy = ...,
        durability: DurabilityPolicy = ...,
    ) -> None: ...
