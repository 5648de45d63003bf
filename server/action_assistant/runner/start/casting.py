"""Says who carries out the actions of a start: the robot of each actor, and who answers its questions.
Pure."""

from collections.abc import Collection, Mapping

import msgspec

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.links.port import CONDUCTED, SIMULATOR
from action_assistant.runner.start.start_from import EarlierRun
from action_assistant.umrf.json.text import pointer
from action_assistant.umrf.model import Action, Graph
from action_assistant.umrf.questions import Asked, asked_by, is_asked, roles_in
from action_assistant.umrf.semantics import Script, script_from


def require_nobody_asked(graph: Graph, engine: str, script: Script) -> None:
    """Raise Conflict if a graph that is handed over whole asks people, or lets the runner wait. The
    simulator plays those that the script answers."""
    for action in filter(is_asked, graph.actions):
        if engine == SIMULATOR and is_preset(action, script):
            continue
        by = "People answer" if asked_by(action.name) == "people" else "The runner waits for"
        text = (
            f"{by} {action.full_name}, which no engine can do: let the runner lead this graph, step by step "
            f"(engine “{CONDUCTED}”)."
        )
        raise Conflict(text, where={"path": "/engine", "action": action.full_name})


def is_preset(action: Action, script: Script) -> bool:
    """Return whether a script says by name how an action is answered, or how long it is waited for."""
    return not script.behaviours.keys().isdisjoint({action.full_name, action.name})


def people_of(graph: Graph, people: Mapping[str, str], *, is_part: bool) -> dict[str, str]:
    """Return who answers the questions of each actor of a graph; "" stands for questions without an
    actor. The result is empty if the graph neither asks people nor lets the runner wait. `people`:
    who answers, by actor, in the request; `is_part`: only a part of the graph starts, so `people`
    may name actors whose questions are skipped. Raise BadInput if `people` lacks an actor that
    asks, or, without `is_part`, names one that does not ask."""
    roles = roles_in(graph) | {""} if any(map(is_asked, graph.actions)) else frozenset[str]()
    for role in sorted(roles):
        if role and role not in people:
            raise BadInput(f"Say who answers for {role}.", where={"path": "/people"})
    for role in sorted(people):
        if role and role not in roles and not is_part:
            path = pointer("people", role)
            raise BadInput(f"The graph asks nobody as {role}.", where={"path": path})
    return {role: people.get(role, "") for role in sorted(roles)}


def without_preset(graph: Graph, asked: dict[str, Asked], script: str) -> dict[str, Asked]:
    """Return the actions `asked` without those that the script answers, since it does so where
    nothing moves."""
    if not script:
        return asked
    known = script_from(msgspec.json.decode(script))
    preset = {each.full_name for each in filter(is_asked, graph.actions) if is_preset(each, known)}
    return {name: each for name, each in asked.items() if name not in preset}


def require_robots(robots: Mapping[str, str], actors: Collection[str]) -> None:
    """Raise BadInput unless exactly the actors of the graph have a robot."""
    for actor in sorted(actors):
        if not robots.get(actor):
            who = f"{actor}'s actions" if actor else "the actions without an actor"
            raise BadInput(f"Say which robot plays {who}.", where={"path": "/robots"})
    for actor in sorted(robots):
        if actor not in actors:
            who = f"no action of {actor}" if actor else "no action without an actor"
            raise BadInput(f"The graph has {who}.", where={"path": pointer("robots", actor)})


def require_same_robots(robots: Mapping[str, str], earlier: EarlierRun | None) -> None:
    """Raise Conflict if a run is to be continued on other robots: they are not where it ended."""
    led = earlier.first.led if earlier is not None else None
    if earlier is not None and led is not None and dict(robots) != led.robots:
        text = f"Run {earlier.first.number} had other robots: continue it on these, or begin anew."
        raise Conflict(text, where={"path": "/robots"})


def placed_on(graph: Graph, played: Mapping[str, str]) -> Graph:
    """Return the graph with the robot of each action as its actor, "" for the simulator, which moves
    nothing. `played`: the robots by full name; two actors on one robot become one, and a sub-graph
    has one."""
    robots = {name: robot if robot != SIMULATOR else "" for name, robot in played.items()}
    placed = tuple(
        msgspec.structs.replace(
            each, actor="" if is_asked(each) else robots.get(each.full_name, each.actor)
        )
        for each in graph.actions
    )
    return msgspec.structs.replace(graph, actions=placed)


def require_not_led(robots: Mapping[str, str], people: Mapping[str, str]) -> None:
    """Raise BadInput if a start has what only that of a led run has."""
    if robots:
        raise BadInput("Only a led run has several robots.", where={"path": "/robots"})
    if people:
        raise BadInput("Only a led run asks people.", where={"path": "/people"})
