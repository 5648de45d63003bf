"""What a stop of everything concerns, and what it may not reach. Pure."""

import msgspec


class StoppedAll(msgspec.Struct, frozen=True):
    """The answer to a stop of everything. `runs`: of ours that are being stopped. `graphs`: those of
    others that are, by robot. `unknown`: why nothing is known of what a robot runs, by robot: whatever
    it runs is not being stopped unless it was seen before."""

    runs: list[str]
    graphs: dict[str, list[str]] = {}
    unknown: dict[str, str] = {}
