"""The parts of a running graph: nodes, edges and their run state, built from a graph value."""

from collections.abc import Mapping, Sequence
from math import inf
from typing import TypeAlias

from action_assistant.umrf.files.writing import name_order
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Key,
    Precondition,
    Relation,
    Remap,
)
from action_assistant.umrf.semantics.script import Behaviour
from action_assistant.umrf.semantics.transitions import IDLE, PAUSED, RUNS, STOPS, THREAD_LEFT
from action_assistant.umrf.semantics.values import Slot, slots_of

ENTRY_NODE = "graph_entry_0"
EXIT_NODE = "graph_exit_0"
#: Names of actions that the engine takes for the ends of a graph, whatever their number: it never runs them.
RESERVED = frozenset({"graph_entry", "graph_exit"})

#: The results with which a call of an action can end.
Outcome: TypeAlias = Precondition

#: States in which an action holds a thread of its own.
ACTIVE = frozenset({"RUNNING", "PAUSE_REQUESTED", "PAUSED", "STOPPING"})
HELD = frozenset({"PAUSE_REQUESTED", "PAUSED"})


class NodeLink:
    """Holds what a child knows of one of its parents."""

    __slots__ = ("conditions", "received", "required")

    def __init__(self, conditions: Conditions, required: bool) -> None:
        self.conditions = conditions
        self.required = required
        self.received = False


class Edge:
    """Holds one item of a parent's `children`. `child` is None if the graph has no such action."""

    __slots__ = ("child", "label", "remap")

    def __init__(self, child: "Node | None", label: str, remap: Sequence[Remap]) -> None:
        self.child = child
        self.label = label
        self.remap = remap


class Execution:
    """Holds one call of an action's own code, independent of the state that the engine shows for
    the action.

    An engine calls an action that ignores a stop ERROR after five seconds, while its code
    continues. `ends_ms`: when the code returns; inf while nothing will end it, also while it is
    paused. `number`: the number of a call that a performer carries out; 0 where the script says how
    the action behaves.
    """

    __slots__ = ("began_ms", "ends_ms", "graph", "node", "number")

    def __init__(self, graph: str, node: str, began_ms: float) -> None:
        self.graph = graph
        self.node = node
        self.began_ms = began_ms
        self.ends_ms = inf
        self.number = 0


class Node:
    """Holds one action while its graph runs.

    `token` is increased to make scheduled events void. `loaded`: the plugin instance exists.
    `due_ms`: when the call returns by itself; `rest_ms`: the time that was left of it when it was
    paused. `pending`: the result of a call that returned while paused. `returning`: the call has
    returned and the children are being informed. `execution`: the newest call of the action's code.
    `loading`: it was triggered and will run once it has loaded; no state shows this.
    """

    __slots__ = (
        "actor", "again", "behaviours", "busy_until", "call", "calls", "children", "due_ms",
        "execution", "failed_to_load", "full_name", "inputs", "instance_id", "key", "links", "loaded", "loading", "name", "outputs", "pending",
        "rest_ms", "returning", "started_ms", "state", "sub", "subgraph", "token", "type",
        "waiting_links",
    )  # fmt: skip

    def __init__(self, action: Action, full_name: str, behaviours: tuple[Behaviour, ...]) -> None:
        self.key = action.key
        self.name = action.name
        self.instance_id = action.instance_id
        self.full_name = full_name
        self.type = action.type
        self.actor = action.actor
        self.behaviours = behaviours
        self.children: list[Edge] = []
        self.links: dict[str, NodeLink] = {}
        self.waiting_links = 0
        self.inputs: dict[str, Slot] = slots_of(action.inputs)
        self.outputs: dict[str, Slot] = slots_of(action.outputs)
        self.state = "UNINITIALIZED"
        self.loaded = False
        self.loading = False
        self.failed_to_load = False
        self.calls = 0
        self.call = behaviours[0]
        self.token = 0
        self.started_ms = -1.0
        self.due_ms: float | None = None
        self.rest_ms: float | None = None
        self.busy_until = -1.0
        self.pending: Outcome | None = None
        self.returning = False
        self.execution: Execution | None = None
        self.again = 0
        self.subgraph: Graph | None = None
        self.sub: Running | None = None

    @property
    def active(self) -> bool:
        """True while the engine counts the action as active: while it runs, is paused or is being
        stopped."""
        return self.state in ACTIVE

    def activity(self, at_ms: float) -> int:
        """Return what the action does at this time (ms), as one of the numbers that `transitions`
        defines."""
        match self.state:
            case "RUNNING":
                return RUNS
            case "STOPPING":
                return STOPS
            case "PAUSED" | "PAUSE_REQUESTED":
                return PAUSED
            case _:
                return THREAD_LEFT if self.loading or self.busy_until > at_ms else IDLE

    def holds_thread(self, at_ms: float) -> bool:
        """Return whether the engine has a thread for the action at this time (ms). Also an action
        that still loads has one, and one whose code continues after the engine has shown ERROR."""
        return self.activity(at_ms) != IDLE

    def link(self, parent: str, link: NodeLink) -> None:
        """Add a parent by its full name. A parent that is listed already keeps its earlier link."""
        if parent not in self.links:
            self.links[parent] = link
            self.waiting_links += link.required

    def receive(self, link: NodeLink) -> None:
        """Mark a parent (`link`) as having reported; it stays so until the run ends."""
        if not link.received:
            link.received = True
            self.waiting_links -= link.required

    def has_inputs(self) -> bool:
        """Return whether every required input of the action has a value."""
        return all(slot.has_value() or not slot.required for slot in self.inputs.values())


class Running:
    """Holds one graph in an engine. `name`: the name under which it runs; `own`: the name in its
    own text.

    `above` and `home`: the action that this sub-graph stands for, and the graph of that action;
    None for a top graph. `running`, `active`, `held` and `loading` count nodes: those in state
    RUNNING, those that are active, those that are paused, and those that load and will then run.
    """

    def __init__(self, name: str, graph: Graph, above: "Node | None", home: "Running | None"):
        self.name = name
        self.own = graph.name
        self.graph = graph
        self.above = above
        self.home = home
        self.nodes: dict[str, Node] = {}
        self.entry: Node
        self.exit: Node
        self.state = "UNINITIALIZED"
        self.result: str | None = None
        self.running = 0
        self.active = 0
        self.held = 0
        self.loading = 0
        self.stuck = False
        self.pausing = False
        self.bypasses = 0
        self.bypassed_ms = -1.0
        self.stop_failed = False
        self.has_ghost_ends = False
        #: `broken`: it was built in part only. `deadly`: a get of it kills the engine.
        self.broken = False
        self.deadly = False
        self.blocked: Node | None = None  # the node whose thread hangs while it ends the graph
        self.linked: dict[Node, list[Node] | None] = {}

    def actor_of(self, node: Node) -> str:
        """Return the actor that performs an action of this graph: its own, or else that of the
        action for which this graph stands; "" if neither names one."""
        if node.actor or self.above is None or self.home is None:
            return node.actor
        return self.home.actor_of(self.above)

    def own_names(self) -> set[str]:
        """Return the names that sub-graphs of this graph cannot have: the names of this graph and
        of all graphs around it, and of the actions that stand for them."""
        found, graph = set[str](), self
        while True:
            found.add(graph.own)
            if graph.above is None or graph.home is None:
                return found
            found.add(graph.above.name)
            graph = graph.home

    def count(self, state: str, by: int) -> None:
        """Add `by` to the counters of a node state."""
        self.running += by * (state == "RUNNING")
        self.active += by * (state in ACTIVE)
        self.held += by * (state in HELD)


def build(running: Running, behaviours: Mapping[Key, tuple[Behaviour, ...]]) -> None:
    """Fill an empty `running` graph with the nodes and edges of its text. If two actions have the
    same full name, the later one is lost. `behaviours`: the behaviours of each action, by key."""
    graph = running.graph
    nodes = {a.key: Node(a, a.full_name, behaviours[a.key]) for a in graph.actions if not a.missing}
    for node in nodes.values():
        running.nodes.setdefault(node.full_name, node)
    running.entry = _end("graph_entry")
    running.exit = _end("graph_exit")
    ghosts = {a.key: a.full_name for a in graph.actions if a.missing}
    _link_parents(running, nodes, ghosts)
    _link_children(running, nodes, ghosts)
    running.exit.inputs = exit_inputs(running.graph)


def _end(name: str) -> Node:
    action = Action(key=name, name=name, type="sync")
    return Node(action, action.full_name, (Behaviour(),))


def _link_parents(running: Running, nodes: Mapping[Key, Node], ghosts: Mapping[Key, str]) -> None:
    for relation in sorted(running.graph.relations, key=lambda r: (r.child_order, name_order(r))):
        if relation.only == "children":
            continue
        conditions = relation.conditions
        if relation.parent == ENTRY:
            parent, conditions = ENTRY_NODE, ENTRY_CONDITIONS
        elif relation.parent in nodes:
            parent = nodes[relation.parent].full_name
        elif relation.parent in ghosts:
            parent = ghosts[relation.parent]
        else:
            continue
        if relation.child == EXIT:
            if relation.parent in ghosts:
                running.has_ghost_ends = True
            running.exit.link(parent, NodeLink(conditions, relation.required))
        elif relation.child in nodes:
            nodes[relation.child].link(parent, NodeLink(conditions, relation.required))


def _link_children(running: Running, nodes: Mapping[Key, Node], ghosts: Mapping[Key, str]) -> None:
    ordered = sorted(running.graph.relations, key=lambda r: (r.parent_order, name_order(r)))
    exits: list[tuple[Node, Relation]] = []
    for relation in ordered:
        if relation.only == "parents":
            continue
        parent = running.entry if relation.parent == ENTRY else nodes.get(relation.parent)
        if parent is None:
            continue
        if relation.child == EXIT:
            exits.append((parent, relation))
            continue
        child = nodes.get(relation.child)
        if child is None and relation.child not in ghosts:
            continue
        if child is None and relation.parent == ENTRY:
            running.has_ghost_ends = True
        name = child.full_name if child else ghosts[relation.child]
        parent.children.append(Edge(child, f"{parent.full_name} => {name}", relation.remap))
    seen: set[str] = set()
    for parent, _ in exits:
        if parent.full_name not in seen:
            seen.add(parent.full_name)
            label = f"{parent.full_name} => {EXIT_NODE}"
            parent.children.append(Edge(running.exit, label, ()))


def restructure(running: Running, new: Running) -> None:
    """Give a running graph the structure of `new`, as a modify does.

    Nodes that stay get the relations and values of the new graph. An empty list of relations
    changes nothing, and the reports of all parents are forgotten.
    """
    merged = {name: running.nodes.get(name, node) for name, node in new.nodes.items()}
    for node in (*new.nodes.values(), new.entry):
        for edge in node.children:
            if edge.child is not None and edge.child is not new.exit:
                edge.child = merged[edge.child.full_name]
    for name, node in merged.items():
        fresh = new.nodes[name]
        if fresh is node:
            node.subgraph = None
            continue
        node.inputs = fresh.inputs
        for slot in node.inputs.values():
            slot.received = slot.has_value()  # cleared after the run, like a value from a parent
        node.children = fresh.children or node.children
        node.links = fresh.links or node.links
        for link in node.links.values():
            link.received = False
        node.waiting_links = sum(link.required for link in node.links.values())
    running.nodes, running.entry, running.exit = merged, new.entry, new.exit
    running.graph = new.graph
    running.linked.clear()


def exit_owner(graph: Graph) -> Action | None:
    """Return the action whose outputs become the inputs of the exit: the last action of
    `graph_exit` that has any outputs; None if no action has."""
    by_key = {action.key: action for action in graph.actions if not action.missing}
    ends = [r for r in graph.relations if r.child == EXIT and r.only != "children"]
    ends.sort(key=lambda r: (r.child_order, name_order(r)), reverse=True)
    parents = (by_key.get(r.parent) for r in ends)
    return next((action for action in parents if action and slots_of(action.outputs)), None)


def exit_inputs(graph: Graph) -> dict[str, Slot]:
    """Return the inputs of the exit, which are also the outputs of the graph as a sub-graph, by
    flat name. The engine makes the outputs of each action of `graph_exit` inputs of the exit; the
    outputs of the last one that has any remain. They are required like any input: unless an action
    that leads to the exit hands them over, the graph does not end."""
    owner = exit_owner(graph)
    return slots_of(owner.outputs) if owner is not None else {}


def linked_nodes(running: Running, node: Node) -> list[Node] | None:
    """Return all actions of a running graph downstream of a node, or None if a path from it leads
    into a loop."""
    if node not in running.linked:
        running.linked[node] = _downstream(running, node)
    return running.linked[node]


def _downstream(running: Running, node: Node) -> list[Node] | None:
    open_nodes = {node}
    found: dict[Node, None] = {}
    stack = [(node, iter(node.children))]
    while stack:
        above, edges = stack[-1]
        for edge in edges:
            child = edge.child
            if child in open_nodes:
                return None
            if child is not None and child is not running.exit and child not in found:
                found[child] = None
                open_nodes.add(child)
                stack.append((child, iter(child.children)))
                break
        else:
            open_nodes.remove(above)
            stack.pop()
    return list(found)
