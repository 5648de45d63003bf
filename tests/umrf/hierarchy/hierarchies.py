"""Hierarchies that hypothesis draws, and their courses: nested, and flat."""

from collections import Counter
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, NamedTuple

from hypothesis import strategies as st
from msgspec.structs import replace

from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.flattening import Flattened
from action_assistant.umrf.model import (
    ENGINE_DEFAULTS,
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    RESPONSES,
    Action,
    Conditions,
    Graph,
    Key,
    Parameter,
    Relation,
    Remap,
)
from action_assistant.umrf.semantics import (
    Behaviour,
    Engine,
    GraphRefused,
    GraphStateEvent,
    NodeResultEvent,
    NodeStateEvent,
    Script,
    Trace,
)
from action_assistant.umrf.semantics.parts import Node, Running
from action_assistant.umrf.signatures import action_of_graph

RUN = Conditions("run", "run", "run", "ignore")
USUAL = [*[RUN] * 5, *[ENGINE_DEFAULTS] * 3, Conditions("run", "run")]
TRUE, OTHER = Conditions("run"), Conditions("ignore", "run", "run")
BYPASS, FAILED = Conditions("run", "bypass", "bypass"), Conditions("ignore", "ignore", "run")
TWEAKS = [TRUE, OTHER, RUN, ENGINE_DEFAULTS, FAILED, Conditions()]
TOP = "g"


class Hierarchy(NamedTuple):
    """A graph, and those that can be in it."""

    graph: Graph
    graphs: dict[str, Graph]


# Graphs


def leaf(kind: str, value: str = "", extra: str = "") -> str:
    given = f',"pvf_value":{value}' if value else ""
    return f'{{"pvf_type":"{kind}"{given}{extra}}}'


LEAF = st.sampled_from(
    [
        *[leaf("string")] * 8,
        *[leaf("string", '"x"')] * 3,
        leaf("number"),
        leaf("string", extra=',"pvf_required":false'),
        leaf("string", extra=',"pvf_updatable":false'),
        leaf("string", extra=',"pvf_allowed_values":["a"]'),
    ]
)
SIDE = st.dictionaries(st.sampled_from("pqr"), LEAF, max_size=2).map(
    lambda d: tuple(Parameter(*each) for each in d.items())
)
OUT = st.dictionaries(st.sampled_from("pqr"), st.just(leaf("string")), max_size=2).map(
    lambda d: tuple(Parameter(*each) for each in d.items())
)
WIRES = st.sets(st.sampled_from("pq"), min_size=1).map(
    lambda names: tuple(Parameter(name, leaf("string")) for name in sorted(names))
)
ANY = st.builds(Conditions, *[st.sampled_from(RESPONSES)] * 4)


class Drawn:
    """One graph while it is drawn."""

    def __init__(
        self, draw: st.DrawFn, name: str, subs: list[Graph], most: int, *, wired: bool
    ) -> None:
        self.draw = draw
        self.name = name
        self.wired = wired
        self.values = wired or draw(st.booleans())
        self.wild = draw(st.integers(0, 31 if wired else 7)) == 0
        self.relations: dict[tuple[Key, Key], Relation] = {}
        count = draw(st.integers(1, most))
        places = draw(st.sets(st.integers(0, count - 1), min_size=min(1, len(subs)), max_size=2))
        left = list(subs)
        self.actions: list[Action] = []
        for number in range(count):
            if number in places and left:
                sub = left.pop(draw(st.integers(0, len(left) - 1)))
                self.actions.append(self._sub(sub, number))
            else:
                self.actions.append(self._leaf(number))

    def _sub(self, sub: Graph, number: int) -> Action:
        action = action_of_graph(sub)
        given = {p.path for p in self.actions[-1].outputs} if self.actions else set[str]()
        inputs = tuple(
            Parameter(p.path, p.text[:-1] + ',"pvf_value":"s"}')
            if "string" in p.text
            and "pvf_value" not in p.text
            and self.draw(st.integers(0, 9)) < (1 if p.path in given else 7)
            else p
            for p in action.inputs
        )
        return replace(
            action, key=f"k{number}", instance_id=self.draw(st.integers(0, 1)), inputs=inputs
        )

    def _leaf(self, number: int) -> Action:
        draw = self.draw
        inputs: tuple[Parameter, ...] = ()
        outputs: tuple[Parameter, ...] = ()
        if self.wired:
            outputs = draw(WIRES)
            inputs = draw(WIRES) if number == 0 and self.name != TOP else ()
        elif self.values:
            outputs = draw(OUT if draw(st.integers(0, 7)) else SIDE)
            inputs = draw(SIDE) if number == 0 or not draw(st.integers(0, 7)) else ()
        if self.values and number and not inputs and (before := self.actions[-1].outputs):
            inputs = (draw(st.sampled_from(before)),)
        return Action(
            key=f"k{number}", name=draw(st.sampled_from("AB")), instance_id=number,
            inputs=inputs, outputs=outputs,
        )  # fmt: skip

    def arrow(self, parent: Key, child: Key, said: Conditions, *, required: bool = True) -> None:
        draw = self.draw
        if self.wild and not draw(st.integers(0, 3)):
            said = draw(ANY)
        if self.wild and not draw(st.integers(0, 3)):
            required = not required
        by_key = {a.key: a for a in self.actions}
        outputs = by_key[parent].outputs if parent in by_key else ()
        remap = ()
        if outputs and child in by_key and not draw(st.integers(0, 3)):
            targets = [p.path for p in by_key[child].inputs] or ["p", "q"]
            remap = (Remap(draw(st.sampled_from(outputs)).path, draw(st.sampled_from(targets))),)
        if parent == ENTRY:
            said = ENTRY_CONDITIONS
            inputs = by_key[child].inputs
            if self.name != TOP and inputs and not draw(st.integers(0, 3)):
                remap = (Remap(inputs[0].path, draw(st.sampled_from("pqr"))),)
        place = float(len(self.relations))
        self.relations[parent, child] = Relation(
            parent=parent, child=child, conditions=said, required=required, remap=remap,
            parent_order=place, child_order=place,
        )  # fmt: skip

    def usual(self) -> Conditions:
        usual = [ENGINE_DEFAULTS] * 5 + [RUN] if self.values else USUAL
        return self.draw(st.sampled_from(usual))

    def graph(self) -> Graph:
        shapes = ["chain", "chain", "fork", "choice", "wild"]
        likely = 30 if self.wired else 6 if self.values else 0
        shape = self.draw(st.sampled_from([*["chain"] * likely, *shapes]))
        keys = [a.key for a in self.actions]
        getattr(self, f"_{shape if len(keys) > 1 else 'chain'}")(keys)
        for _ in range(self.draw(st.sampled_from([0, 0, 0, 1, 1, 2]))):
            self._tweak(keys)
        return Graph(
            name=self.name, actions=tuple(self.actions), relations=tuple(self.relations.values())
        )

    def _tweak(self, keys: list[Key]) -> None:
        """Change one thing: many such hierarchies can still be made flat, and few are sound."""
        draw = self.draw
        pair = draw(st.sampled_from(sorted(self.relations)))
        relation = self.relations[pair]
        match draw(st.sampled_from(["required", "said", "said", "arrow", "exit", "entry"])):
            case "required":
                self.relations[pair] = replace(relation, required=not relation.required)
            case "said" if relation.parent != ENTRY:
                said = draw(st.sampled_from([TRUE, OTHER, RUN, ENGINE_DEFAULTS, BYPASS, FAILED]))
                self.relations[pair] = replace(relation, conditions=said)
            case "arrow":
                both = draw(st.sampled_from(keys)), draw(st.sampled_from(keys))
                if both not in self.relations and both[0] != both[1]:
                    self.arrow(*both, draw(st.sampled_from(TWEAKS)), required=draw(st.booleans()))
            case "exit" if (keys[0], EXIT) not in self.relations:
                said = draw(st.sampled_from(TWEAKS))
                self.arrow(keys[0], EXIT, said, required=draw(st.booleans()))
            case "entry" if (ENTRY, keys[-1]) not in self.relations:
                self.arrow(ENTRY, keys[-1], RUN)
            case _:
                pass

    def _chain(self, keys: list[Key]) -> None:
        self.arrow(ENTRY, keys[0], RUN)
        for first, second in pairwise(keys):
            self.arrow(first, second, self.usual())
        self.arrow(keys[-1], EXIT, self.usual())
        if len(keys) > 1 and not self.wired and not self.draw(st.integers(0, 4)):
            self.arrow(keys[-1], keys[0], OTHER, required=False)
            self.arrow(keys[-1], EXIT, TRUE)

    def _fork(self, keys: list[Key]) -> None:
        """Make a fork: all keys begin at once, or all but the first after it; the last key or
        the exit waits for the others."""
        first, *others = keys
        if self.draw(st.booleans()):
            others = keys
        else:
            self.arrow(ENTRY, first, RUN)
        join = others[-1] if len(others) > 2 and self.draw(st.booleans()) else EXIT
        required = self.draw(st.integers(0, 3)) > 0
        for key in others:
            if key != join:
                self.arrow(ENTRY if others is keys else first, key, self.usual())
                said = self.draw(st.sampled_from([RUN, RUN, ENGINE_DEFAULTS]))
                self.arrow(key, join, said, required=required)
        if join != EXIT:
            self.arrow(join, EXIT, self.usual())

    def _choice(self, keys: list[Key]) -> None:
        """One decides, and all ways meet again at the exit or at the last."""
        first, *others = keys
        self.arrow(ENTRY, first, RUN)
        join = others.pop() if len(others) > 2 and self.draw(st.booleans()) else EXIT
        for key, said in zip(others, (TRUE, OTHER), strict=False):
            self.arrow(first, key, said)
            self.arrow(key, join, self.usual(), required=False)
        if len(others) == 1:
            self.arrow(first, join, OTHER, required=False)
        if join != EXIT:
            self.arrow(join, EXIT, self.usual())

    def _wild(self, keys: list[Key]) -> None:
        draw = self.draw
        place = st.sampled_from(keys)
        self.arrow(ENTRY, keys[0], RUN)
        for _ in range(draw(st.integers(1, 2 * len(keys)))):
            parent, child = draw(place), draw(place)
            self.arrow(parent, child, self.usual(), required=draw(st.booleans()))
        for key in sorted(draw(st.sets(place, min_size=1, max_size=2))):
            self.arrow(key, EXIT, self.usual(), required=draw(st.booleans()))


@st.composite
def hierarchies(draw: st.DrawFn, *, wired: bool = False) -> Hierarchy:
    """One to three levels of small graphs. `wired`: chains of actions that hand on values."""
    levels = draw(st.integers(1, 3))
    graphs: dict[str, Graph] = {}
    below: list[Graph] = []
    for level in range(levels):
        names = [f"H{level}", f"I{level}"][: draw(st.integers(1, 2 if level == 0 else 1))]
        made = [Drawn(draw, name, below, 3, wired=wired).graph() for name in names]
        graphs |= {graph.name: graph for graph in made}
        below = made
    return Hierarchy(Drawn(draw, TOP, below, 4, wired=wired).graph(), graphs)


# Courses


class Watched(Engine):
    """An engine that writes down which values actions begin with."""

    def __init__(self, script: Script, library: Mapping[str, Graph]) -> None:
        super().__init__(facts=SIMULATED, script=script, library=library, serial=False)
        self.values: list[tuple[float, str, str, str]] = []

    def _begin(self, graph: Running, node: Node) -> None:
        held = {name: slot.value for name, slot in node.inputs.items() if slot.has_value()}
        self.values.append((self.now, graph.name, node.full_name, f"begins with {held}"))
        super()._begin(graph, node)


class Course(NamedTuple):
    """The events of actions that are no sub-graphs, by instant and by action, and the states of the
    top graph.

    `tied`: two actions ended at one instant.
    """

    instants: dict[float, Counter[tuple[str, str]]]
    own: dict[str, list[tuple[float, str]]]
    top: list[tuple[float, str]]
    result: str | None
    tied: bool
    hazards: frozenset[str]


def course(
    graph: Graph,
    library: Mapping[str, Graph],
    script: Script,
    names: Mapping[tuple[str, str], str],
    stop_ms: float | None = None,
    until_ms: float = 40_000.0,
) -> Course:
    """`names`: of the actions that count, by running graph and full name there."""
    engine = Watched(script, library)
    traces: list[Trace] = []
    try:
        traces += engine.start(graph, 0.0)
    except GraphRefused as refused:
        raise AssertionError(refused.message) from refused
    if stop_ms is not None:
        traces += engine.advance(stop_ms) + engine.stop(graph.name, stop_ms)
    while not engine.crashed and engine.due is not None and engine.due <= until_ms:
        traces += engine.advance(engine.due)
        if len(traces) > 20_000:
            break
    return _told(engine, graph.name, traces, names)


def _told(
    engine: Watched, top_name: str, traces: list[Trace], names: Mapping[tuple[str, str], str]
) -> Course:
    seen = list(engine.values)
    top, ends = [], Counter[float]()
    for trace in traces:
        match trace:
            case NodeStateEvent(state=state):
                seen.append((trace.t_ms, trace.graph, trace.node, state))
            case NodeResultEvent():
                seen.append((trace.t_ms, trace.graph, trace.node, f"ends {trace.result}"))
                ends[trace.t_ms] += (trace.graph, trace.node) in names
            case GraphStateEvent() if trace.graph == top_name:
                top.append((trace.t_ms, trace.state))
            case _:
                pass
    instants: dict[float, Counter[tuple[str, str]]] = {}
    own: dict[str, list[tuple[float, str]]] = {}
    for at, running, node, what in seen:
        if (name := names.get((running, node))) is not None:
            instants.setdefault(round(at, 3), Counter())[name, what] += 1
            own.setdefault(name, []).append((round(at, 3), what))
    tied = any(count > 1 for count in ends.values())
    crashed = frozenset({engine.crashed} if engine.crashed else ())
    return Course(instants, own, top, engine.graphs[top_name].result, tied, crashed)


def nested_names(found: Flattened) -> dict[str, tuple[str, str]]:
    """Return the place in the hierarchy of each action of a flat graph: running graph, and full
    name there."""
    places = {}
    for origin in found.origins:
        running = found.graph.name
        for level in origin.levels[:-1]:
            name, _, number = level.action.rpartition("_")
            running += f"__{name}__{number}"
        places[origin.action] = (running, origin.levels[-1].action)
    return places


def both(
    hierarchy: Hierarchy,
    found: Flattened,
    behaviours: Mapping[str, tuple[Behaviour, ...]],
    stop_ms: float | None = None,
) -> tuple[Course, Course]:
    """The course of the hierarchy and that of the flat graph. `behaviours`: by flat full name."""
    places = nested_names(found)
    deep = Script({f"{run}/{name}": behaviours[flat] for flat, (run, name) in places.items()})
    wide = Script({f"{found.graph.name}/{flat}": calls for flat, calls in behaviours.items()})
    read = codec.read(codec.write(found.graph)).graph  # what an engine would be given
    above = {place: flat for flat, place in places.items()}
    alike = {(found.graph.name, flat): flat for flat in places}
    return (
        course(hierarchy.graph, hierarchy.graphs, deep, above, stop_ms),
        course(read, {}, wide, alike, stop_ms),
    )


def outputs_of(graph: Graph, name: str, call: int) -> dict[str, Any]:
    """A value for each output that nobody else gives."""
    action = next(a for a in graph.actions if a.full_name == name)
    return {
        p.path: f"{name}.{p.path}.{call}" if "string" in p.text else float(call)
        for p in action.outputs
    }
