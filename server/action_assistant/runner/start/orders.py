"""The order of a start: its claim to the rules of its robots, and the values to which a second person says
yes. Pure."""

import hashlib
from collections.abc import Collection
from typing import Any

import msgspec
import rfc8785

from action_assistant.errors import BadInput
from action_assistant.runner.links.port import CONDUCTED, SIMULATOR
from action_assistant.runner.robots.rights import Claim
from action_assistant.runner.start.admission import Prepared, StartRequest, Watching
from action_assistant.umrf.json.text import pointer
from action_assistant.umrf.limits import Limits


def watched_in(watching: Watching, robots: Collection[str]) -> tuple[str, ...]:
    """Return the robots that a person watches, sorted. Raise BadInput for one that is not in
    `robots`."""
    for name in watching:
        if name not in robots:
            where: dict[str, object] = {"path": pointer("watching", name)}
            raise BadInput(f"Nothing of this moves {name}.", where=where)
    return tuple(sorted(name for name, is_watched in watching.items() if is_watched))


def claim_of(request: StartRequest, ready: Prepared | None) -> Claim:
    """Return what a start brings to the rules of robots. `ready`: None for a graph that is refused
    anyway."""
    return Claim(
        digest="" if ready is None else ready.tree_digest,
        watching=frozenset(name for name, is_watched in request.watching.items() if is_watched),
        is_drill=request.drill,
        beyond=ready is not None and ready.beyond,
        limits=None if ready is None else ready.limits,
        over=() if ready is None else ready.over,
        is_led=request.engine == CONDUCTED,
        is_start=True,
    )


def order_of(
    request: StartRequest, tree_digest: str, codes: Collection[str], limits: Limits
) -> str:
    """Return the digest of everything that a second person says yes to: the version (`tree_digest`), and
    where there are any, the values, the robots of a led run with what happens when one is lost and the
    script of what the simulator plays in it, the overridden `codes`, the `limits` in force on its robots,
    its breakpoints, that its sub-graphs are opened, and where it begins: the record of an earlier run,
    which is over, does not change. That of a start with nothing besides its graph is the tree digest."""
    more: dict[str, Any] = {}
    if request.values:
        more["values"] = msgspec.to_builtins(request.values)
    if request.engine == CONDUCTED:
        more |= {"robots": request.robots, "lost": request.lost}
    if request.engine == CONDUCTED and SIMULATOR in request.robots.values() and request.script:
        more["script"] = bytes(request.script).decode()
    if request.people:
        more["people"] = request.people
    if codes:
        more["override"] = sorted(set(codes))
    if limits:
        more["limits"] = msgspec.to_builtins(limits)
    if request.start_from is not None:
        more["from"] = msgspec.to_builtins(request.start_from)
    if request.breakpoints:
        more["breakpoints"] = msgspec.to_builtins(request.breakpoints)
    if request.levels != "one_step":
        more["levels"] = request.levels
    if not more:
        return tree_digest
    return hashlib.sha256(rfc8785.dumps([tree_digest, more])).hexdigest()


def overridden_in(request: StartRequest) -> tuple[str, ...]:
    """Return the codes of the problems that a start overrides."""
    return request.override.codes if request.override is not None else ()


def engines_of(request: StartRequest) -> tuple[str, ...]:
    """Return the names of the robots that a start is for, sorted; none for the simulator."""
    is_led = bool(request.robots or request.people)
    named = request.robots.values() if is_led else (request.engine,)
    return tuple(sorted({*named} - {SIMULATOR}))


def kept_for(request: StartRequest) -> tuple[str, ...]:
    """Return what one start at a time may have: its robots, by name, and the run that it continues, if
    any. No robot's name has a slash."""
    since = request.start_from
    continued = (f"run/{since.run}",) if since is not None and since.continues else ()
    return (*engines_of(request), *continued)


def require_plain(request: StartRequest) -> None:
    """Raise BadInput if a start on a robot has fields that only the simulator understands."""
    if request.like is not None:
        raise BadInput("Only the simulator plays a robot.", where={"path": "/like"})
    if request.behaviours:
        raise BadInput("Only the simulator runs behaviours.", where={"path": "/behaviours"})
