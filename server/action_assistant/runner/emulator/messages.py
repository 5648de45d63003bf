"""The messages of the robot emulator, and the traits of a real engine that it has."""

import json
from collections.abc import Container, Iterable
from typing import Any, ClassVar, Final, TypeAlias

import msgspec

from action_assistant.umrf import check as checks
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Key, Signature
from action_assistant.umrf.semantics import Engine, Performer, Script
from action_assistant.umrf.semantics.printing import printed_action
from action_assistant.umrf.signatures import signature_of

#: The name of the node, which is that of the real engine's.
NODE: Final = "action_engine_node"


class EngineTraits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The traits of a real engine that an emulated one has; each can be switched off.

    `depth`: commands of one topic that wait, the newest win (0: all wait). `blocks`: a stop, pause or
    modify that is under way makes it deaf (up to 5 s). `restart_stops`: a start of a running graph
    stops it. `keeps_ended`: graphs that have ended are listed as running. `checks_actions`: a graph
    with an action that is not in its index is refused. `quiet_pause`: pausing and resuming bring no
    feedback. `narrates`: it says on its log what it does and refuses. `drops_fields`: a graph comes
    back with less than was sent. `extra_is_actor`: the first extra wake word becomes its name.
    `ring`: snapshots between two messages of feedback. `newest_first`: the order inside one.
    `loss`: the chance that a snapshot is lost, more when many come at once. `loading_ms`: how long an
    action is not yet RUNNING although it was started. `reaction_ms`: until a message is taken up.
    `late_ms`: how long a start is on its way.
    """

    depth: int = 1
    blocks: bool = True
    restart_stops: bool = True
    keeps_ended: bool = True
    checks_actions: bool = True
    quiet_pause: bool = True
    narrates: bool = True
    drops_fields: bool = True
    extra_is_actor: bool = True
    ring: int = 100
    newest_first: bool = True
    loss: float = 0.15
    loading_ms: float = 3.0
    reaction_ms: float = 1.0
    late_ms: float = 0.0


# --- in ---------------------------------------------------------------------------------------------


class _Command(msgspec.Struct, frozen=True, kw_only=True):
    """A command about a graph, to the engines with these names."""

    graph_name: str
    targets: tuple[str, ...]


class Start(_Command, frozen=True, kw_only=True):
    """A command to start the graph of a text or, where that is empty, the indexed graph of this name."""

    topic: ClassVar[str] = "start"

    graph_json: str = ""


class Stop(_Command, frozen=True, kw_only=True):
    """A command to stop a graph."""

    topic: ClassVar[str] = "stop"


class Pause(_Command, frozen=True, kw_only=True):
    """A command to pause a graph."""

    topic: ClassVar[str] = "pause"


class Resume(_Command, frozen=True, kw_only=True):
    """A command to let a paused graph go on."""

    topic: ClassVar[str] = "resume"


class Modify(_Command, frozen=True, kw_only=True):
    """A command to put `modified_graph` in the place of the graph of its name."""

    topic: ClassVar[str] = "modify"

    modified_graph: str
    continue_from: str = ""


Message: TypeAlias = Start | Stop | Pause | Resume | Modify
#: The order in which an engine takes up messages that wait.
TOPICS: Final = tuple(kind.topic for kind in (Start, Stop, Pause, Resume, Modify))


# --- out --------------------------------------------------------------------------------------------


class FeedbackMessage(msgspec.Struct, frozen=True):
    """One message of feedback; index 0 is the newest snapshot."""

    at_ms: float
    actor: str
    history: tuple[str, ...]


class GetResponse(msgspec.Struct, frozen=True):
    """The answer to the get with this ticket (number): the texts of what the engine has indexed,
    and of every graph it holds."""

    at_ms: float
    ticket: int
    umrfs: tuple[str, ...]
    indexed: tuple[str, ...]
    running: tuple[str, ...]


class LogMessage(msgspec.Struct, frozen=True):
    """A line of the engine's log, which goes to /rosout."""

    at_ms: float
    text: str


class Gone(msgspec.Struct, frozen=True):
    """The end of the engine's process, and why."""

    at_ms: float
    why: str


Said: TypeAlias = FeedbackMessage | GetResponse | LogMessage | Gone


# --- what it has read -------------------------------------------------------------------------------


class GraphPlan(msgspec.Struct, frozen=True):
    """A graph as it was read from a message or file. `attributes` are the `gui_attributes` by full name;
    `states` are those that the text carries, which real engines take over."""

    graph: Graph
    attributes: dict[str, Any] = {}
    states: dict[Key, str] = {}


class Refusal(Exception):
    """The refusal of a text by the engine's parser, in the words of its log."""


def graph_plan_of(text: str) -> GraphPlan:
    """Read a graph text as the engine's parser does. Raise Refusal, with the engine's own message,
    if that parser would refuse it."""
    try:
        tree = json.loads(text)
    except ValueError as wrong:
        why = f"[json.exception.parse_error.101] parse error: {wrong}"
        raise Refusal(_syntax(why)) from wrong
    if not isinstance(tree, dict) or not isinstance(tree.get("graph_name"), str):
        why = "[json.exception.type_error.302] type must be string, but is null"
        raise Refusal(_syntax(why))
    try:
        reading = codec.read(text)
    except codec.Unreadable as wrong:
        raise Refusal(_syntax(wrong.message)) from wrong
    if reading.dialect != "D3":
        raise Refusal(
            "origin [in parseChildRelations]: The relations field must be an array\n"
            "   fwd [in fromUmrfGraphJsonStr]: forwarding\n"
        )
    if refusals := checks.refused_by_parser(reading):
        raise Refusal(f"origin [in fromUmrfGraphJsonStr]: {refusals[0].message}\n")
    attributes = {
        f"{each.get('name')}_{int(each.get('instance_id', 0))}": each["gui_attributes"]
        for each in tree.get("actions", ())
        if isinstance(each, dict) and "gui_attributes" in each
    }
    return GraphPlan(reading.graph, attributes, reading.states)


def _syntax(why: str) -> str:
    return (
        "origin [in fromUmrfGraphJsonStr]: The provided JSON string contains syntax errors: "
        f"{why}\n"
    )


class EmulatedIndex(msgspec.Struct, frozen=True):
    """The actions and graphs that an engine has found in its folder. Without any action an emulated engine has
    every action, with any parameters."""

    texts: tuple[str, ...] = ()
    actions: dict[str, Signature] = {}
    graphs: dict[str, GraphPlan] = {}


def index_of(actions: Iterable[str], graphs: Iterable[str]) -> EmulatedIndex:
    """Return the index of files with these texts, of actions and of graphs. Unreadable ones are
    ignored, as by engines."""
    texts: list[str] = []
    found: dict[str, Signature] = {}
    for text in actions:
        try:
            action = codec.read_action(text).action
        except codec.Unreadable:
            continue
        texts.append(printed_action(action))
        found.setdefault(action.name, signature_of(action))
    plans: dict[str, GraphPlan] = {}
    for text in graphs:
        try:
            plan = graph_plan_of(text)
        except Refusal:
            continue
        plans.setdefault(plan.graph.name, plan)
    return EmulatedIndex(tuple(texts), found, plans)


def library_of(index: EmulatedIndex) -> dict[str, Graph]:
    """Return the graphs of an index, which can be sub-graphs, by name."""
    return {name: plan.graph for name, plan in index.graphs.items()}


def signatures_of(index: EmulatedIndex, quirks: EngineTraits) -> dict[str, Signature] | None:
    """Return the signatures of the actions in an index, by name; None if the engine accepts every
    action (an empty index, or a quirk)."""
    return index.actions if index.actions and quirks.checks_actions else None


def engine_inside(
    index: EmulatedIndex,
    quirks: EngineTraits,
    facts: EngineFacts,
    script: Script,
    actor: str,
    performer: Performer | None,
) -> Engine:
    """Return the engine that runs graphs, without the ROS node around it. `quirks`: the traits of
    real engines that it imitates; `facts`: what is true of the imitated build; `script`: how
    actions act; `actor`: the name of the engine; `performer`: runs Python behaviours, None without
    any."""
    return Engine(
        facts=facts,
        script=script,
        library=library_of(index),
        actor=actor,
        signatures=signatures_of(index, quirks),
        loading_ms=quirks.loading_ms,
        performer=performer,
    )


def asked_for(message: Start, index: EmulatedIndex, held: Container[str]) -> GraphPlan:
    """Return the graph that a start message names or carries. `held`: names of graphs that the
    engine already holds. Raise Refusal, with the engine's own message, if the index lacks it or
    its name conflicts with an indexed graph."""
    if not message.graph_json:
        plan = index.graphs.get(message.graph_name)
        if plan is None:
            raise Refusal(unknown("stop", message.graph_name))  # sic
        return plan
    plan = graph_plan_of(message.graph_json)
    if plan.graph.name in index.graphs and plan.graph.name not in held:
        raise Refusal(
            f"origin [in startGraphA]: Cannot execute UMRF graph '{plan.graph.name}' because it "
            "conflicts with an indexed graph (graph name not unique).\n"
            "   fwd [in startGraphA]: forwarding\n"
        )
    return plan


def unknown(verb: str, name: str) -> str:
    """Return the log line for a command (`verb`) about a graph that the engine does not hold."""
    return f"origin [in {verb}Graph]: Cannot {verb} UMRF graph '{name}' because it doesn't exist.\n"


def active(name: str, state: str) -> str:
    """Return the engine's reason for not starting the graph `name`, which is running in `state`."""
    return f"Cannot execute UMRF graph '{name}' because it's already active ({state})"


def refusal(why: str, message: Start) -> str:
    """Return the log line, in the real engine's words, for a start message that it refuses for the
    reason `why`."""
    by_name = not message.graph_json
    if why == "map::at":  # an exception of C++ without a text of the engine
        return why
    if "Could not resolve" in why:
        if by_name:  # it then stops what it does not hold, and says only that
            return unknown("stop", message.graph_name)
        return f"origin [in startGraphA]: {why}\n   fwd [in startGraphA]: forwarding\n"
    told = f"origin [in startGraph]: {why}\n   fwd [in startGraph]: forwarding\n"
    return told if by_name else f"{told}   fwd [in startGraphA]: forwarding\n"
