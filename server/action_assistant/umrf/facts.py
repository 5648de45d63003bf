"""Facts about one engine build. They are kept with a robot's profile and used by checks, simulator
and link."""

from collections.abc import Mapping
from typing import Final

import msgspec

ALL_HAZARDS: Final = frozenset(
    {"H1", "H2", "H2b", "H3", "H4", "H5", "H6", "H7", "H8", "H9", "H10", "H11", "H12", "H14", "H15"}
)


class EngineFacts(msgspec.Struct, frozen=True, kw_only=True):
    """Hazards, names and abilities of an engine built from one commit. Times are in milliseconds.

    `hazards`: those of docs/umrf-and-the-engine.md 3 that this build has. `bypass_fixed`: it
    captures the result of a bypass by value, so that H3 is no crash. `synchronises`: graphs with
    several actors run. `pauses_safely`: a stop of a paused graph works. `restart_matches`: starting
    a graph's JSON again finds its sub-graphs again. `longest_loading_ms`: the longest time that an
    action of this robot takes to load, as a person has declared it; 0 if nobody has.
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
    longest_loading_ms: int = 0


PINNED: Final = EngineFacts(commit="5819055")
SIMULATED: Final = EngineFacts(
    commit="simulator",
    bypass_fixed=True,
    synchronises=True,
    restart_matches=True,
    simulated=True,
)

_KNOWN: Final = {facts.commit: facts for facts in (PINNED, SIMULATED)}


def facts_for(commit: str | None) -> EngineFacts:
    """Return what is true of the engine that was built from this commit (seven hex digits or more).
    A commit that was not measured gets the facts of the pinned engine with its own `commit`. None
    stands for the pinned engine."""
    if not commit:
        return PINNED
    for known, facts in _KNOWN.items():
        if commit.startswith(known):
            return facts
    return msgspec.structs.replace(PINNED, commit=commit)


class BadProfile(ValueError):
    """Raised for a robot's profile that states a wrong or unknown fact about its engine. `path` is
    the JSON pointer of this fact in the profile."""

    def __init__(self, message: str, path: str) -> None:
        super().__init__(message)
        self.message = message
        self.path = path


#: The one field of a profile that is a demand on people: that a second person has approved a graph before its start.
SECOND_PERSON: Final = "second_person"


def facts_of(profile: Mapping[str, object]) -> EngineFacts:
    """Return what is true of a robot's engine: the facts of the `commit` in its profile, or of the
    pinned engine if the profile has none. Other fields of the profile, named as in `EngineFacts`,
    replace them. A robot synchronises only if its profile says so, whatever the commit. Raise
    `BadProfile` if a field is unknown or has a wrong type or value."""
    if not isinstance(profile.get(SECOND_PERSON, False), bool):
        raise BadProfile(f"{SECOND_PERSON} is true or false.", f"/{SECOND_PERSON}")
    profile = {key: value for key, value in profile.items() if key != SECOND_PERSON}
    for key in profile:
        if key not in EngineFacts.__struct_fields__:
            known = ", ".join(EngineFacts.__struct_fields__)
            raise BadProfile(
                f"There is no fact with the name {key!r}; there are: {known}.", f"/{key}"
            )
    given = {key: _profile_value(key, value) for key, value in profile.items()}
    commit = given.pop("commit", None)
    base = facts_for(commit if isinstance(commit, str) else None)
    return msgspec.structs.replace(base, **{"synchronises": False, **given})


def _profile_value(key: str, value: object) -> object:
    """Return the value of the field `key` of a profile with the type of its field in `EngineFacts`.
    Raise `BadProfile` if it cannot have this type."""
    try:
        fitting: EngineFacts = msgspec.convert({"commit": "", key: value}, EngineFacts)
    except msgspec.ValidationError as wrong:
        what = str(wrong).partition(" - at `$")[0]
        raise BadProfile(f"{key}: {what}.", f"/{key}") from wrong
    given = getattr(fitting, key)
    match given:
        case frozenset() if unknown := given - ALL_HAZARDS:
            raise BadProfile(f"No hazard is called {min(unknown)!r}.", f"/{key}")
        case bool():
            return given
        case int() if given <= 0:
            raise BadProfile(f"{key} is a time in milliseconds, more than 0.", f"/{key}")
        case _:
            return given
