"""What is true of one engine build; kept with a robot's profile, taken by check, simulator and link."""

from typing import Final

import msgspec

ALL_HAZARDS: Final = frozenset(
    {"H1", "H2", "H2b", "H3", "H4", "H5", "H6", "H7", "H8", "H9", "H10", "H11", "H12"}
)


class EngineFacts(msgspec.Struct, frozen=True, kw_only=True):
    """Hazards, names and abilities of an engine built from one commit.

    `hazards`: those of SPEC 3 that this build has. `bypass_fixed`: it captures the result of a
    bypass by value, so that H3 is no crash. `synchronises`: graphs with several actors run.
    `pauses_safely`: a stop of a paused graph works. `restart_matches`: starting a graph's JSON again
    finds its sub-graphs again. Times in milliseconds.
    """

    commit: str
    hazards: frozenset[str] = ALL_HAZARDS
    bypass_fixed: bool = False
    synchronises: bool = False
    pauses_safely: bool = False
    restart_matches: bool = False
    simulated: bool = False
    start_topic: str = "/umrf_graph_start"
    stop_topic: str = "/umrf_graph_stop"
    pause_topic: str = "/umrf_pause_pause"
    resume_topic: str = "/umrf_graph_resume"
    modify_topic: str = "/umrf_graph_modify"
    feedback_topic: str = "/umrf_graph_feedback"
    get_service: str = "umrf_graph_get"
    feedback_period_ms: int = 500
    stop_timeout_ms: int = 5_000
    stop_poll_ms: int = 50
    pause_poll_ms: int = 100


PINNED: Final = EngineFacts(commit="5819055")
SIMULATED: Final = EngineFacts(
    commit="simulator", bypass_fixed=True, restart_matches=True, simulated=True
)

_KNOWN: Final = {facts.commit: facts for facts in (PINNED, SIMULATED)}


def facts_for(commit: str | None) -> EngineFacts:
    """The facts of a commit (seven digits or more); those of the pinned engine for one that nobody
    has measured, under its own name."""
    if not commit:
        return PINNED
    for known, facts in _KNOWN.items():
        if commit.startswith(known):
            return facts
    return msgspec.structs.replace(PINNED, commit=commit)
