"""Extracted actions behave as before; differences are reported."""

from collections import Counter
from collections.abc import Iterator, Mapping
from random import Random

import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.extraction import Extracted, Unextractable, extracted
from action_assistant.umrf.model import ENGINE_DEFAULTS, Conditions, Graph, Remap
from action_assistant.umrf.semantics import Behaviour, Script
from support.doses import examples, is_share
from umrf.hierarchy.hierarchies import Course, Drawn, course, hierarchies, leaf, outputs_of
from umrf.hierarchy.lines import changed, with_values
from umrf.semantics.traces import graph_of, optional

RESULTS = ("on_true", "on_false", "on_error")
SAFE = Conditions("run")
TEXT = leaf("string")
OPTIONAL = leaf("string", extra=',"pvf_required":false')


def played(graph: Graph, found: Extracted, random: Random, stop: bool) -> tuple[Course, Course]:
    """One course of the graph, and that of the two made of it."""
    behaviours = {}
    for place, action in enumerate(graph.actions):
        after_s = random.choice((0.2, 1, 3, 7)) + 2.0**place / 1024
        behaviours[action.full_name] = tuple(
            Behaviour(
                after_s=after_s,
                result=random.choice(RESULTS),
                outputs=outputs_of(graph, action.full_name, call),
                init_error=random.random() < 0.03,
                never=random.random() < 0.03,
            )
            for call in range(3)
        )
    inner = {action.full_name for action in found.inner.actions}
    below = f"{graph.name}__{found.inner.name}__0"
    places = {name: (below if name in inner else graph.name, name) for name in behaviours}
    before = Script({f"{graph.name}/{name}": calls for name, calls in behaviours.items()})
    after = Script({f"{run}/{name}": behaviours[name] for run, name in places.values()})
    outer, sub = (codec.read(codec.write(each)).graph for each in (found.outer, found.inner))
    stop_ms = random.uniform(1, 20_000) if stop else None
    return (
        course(graph, {}, before, {(graph.name, name): name for name in behaviours}, stop_ms),
        course(outer, {sub.name: sub}, after, {at: name for name, at in places.items()}, stop_ms),
    )


def leaves(
    graph: Graph, graphs: Mapping[str, Graph], running: str, made: str = ""
) -> Iterator[tuple[str, tuple[str, str]]]:
    """The actions of all levels by their way down, but for the graph `made`, and where they run."""
    for action in graph.actions:
        place = f"{running}__{action.name}__{action.instance_id}"
        if action.name not in graphs:
            yield action.full_name, (running, action.full_name)
            continue
        way = "" if action.name == made else f"{action.full_name}/"
        for name, at in leaves(graphs[action.name], graphs, place, made):
            yield way + name, at


def agree(graph: Graph, found: Extracted, random: Random, *, stop: bool, times: int = 25) -> int:
    """Plays both under many scripts; how many courses were compared."""
    compared = 0
    for _ in range(times):
        one, two = played(graph, found, random, stop)
        if one.tied:
            continue
        compared += 1
        assert two.own == one.own
        assert two.instants == one.instants
        assert two.hazards == one.hazards
        assert two.result == one.result
        if stop:
            assert [state for _, state in two.top] == [state for _, state in one.top]
        else:
            assert two.top == one.top
    return compared


@st.composite
def graphs(draw: st.DrawFn, *, wired: bool = False) -> Graph:
    return Drawn(draw, "g", [], 5, wired=wired).graph()


CHAIN = graph_of("entry>A", "A>B", "B>C", "C>D", "D>exit")
VALUES = with_values(
    CHAIN,
    A=({}, {"p": TEXT}),
    B=({"p": TEXT}, {"p": TEXT, "q": TEXT}),
    C=({"q": TEXT}, {"r": TEXT}),
    D=({"r": TEXT}, {}),
)


def with_arrows(graph: Graph, said: Conditions) -> Graph:
    relations = (r if r.parent == "entry" else replace(r, conditions=said) for r in graph.relations)
    return replace(graph, relations=tuple(relations))


SAME = {
    "a chain": (CHAIN, "BC"),
    "one action": (CHAIN, "B"),
    "everything": (CHAIN, "ABCD"),
    "the first": (CHAIN, "AB"),
    "the last": (CHAIN, "CD"),
    "a chain of true arrows": (with_arrows(CHAIN, SAFE), "BC"),
    "a chain of true arrows, whole": (with_arrows(CHAIN, SAFE), "ABCD"),
    "a chain whose errors are passed on": (with_arrows(CHAIN, ENGINE_DEFAULTS), "BC"),
    "a chain whose errors are ignored": (
        with_arrows(CHAIN, Conditions("run", "run", "ignore", "ignore")), "BC",
    ),
    "values, and errors that end the task": (
        with_arrows(VALUES, Conditions("run", "run", "ignore", "ignore")), "BC",
    ),
    "a chain with values and true arrows": (with_arrows(VALUES, SAFE), "BC"),
    "a chain with values and errors passed on": (with_arrows(VALUES, ENGINE_DEFAULTS), "BC"),
    "a chain that nothing follows": (graph_of("entry>A", "A>B", "B>C"), "BC"),
    "side by side": (graph_of("entry>A", "A>B", "A>C", "B>D", "C>D", "D>exit"), "BC"),
    "side by side, to the exit": (graph_of("entry>A", "A>B", "A>C", "B>exit", "C>exit"), "BC"),
    "a choice": (
        optional(
            graph_of(
                "entry>A", "A>B", "A>C", "B>D", "C>D", "D>exit",
                AB=Conditions("run"), AC=Conditions("ignore", "run", "run"),
            ),
            "B>D", "C>D",
        ),
        "ABC",
    ),
    "a branch beside another": (
        graph_of("entry>A", "A>B", "B>C", "A>E", "C>D", "E>D", "D>exit"), "BC",
    ),
    "a value that the file gives": (
        with_values(CHAIN, A=({}, {"p": TEXT}), B=({"p": leaf("string", '"x"')}, {})), "BC",
    ),
    "a value that only the file gives": (
        with_values(CHAIN, B=({"p": leaf("string", '"x"')}, {})), "BC",
    ),
    "an action that leads to two": (
        graph_of("entry>A", "A>B", "B>C", "C>D", "C>E", "D>exit", "E>exit"), "BC",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", SAME)
def test_a_selection_that_can_be_a_sub_graph_behaves_the_same(what: str) -> None:
    graph, chosen = SAME[what]
    found = extracted(graph, set(chosen), "S", "new")
    assert isinstance(found, Extracted), found
    assert found.differences == ()
    assert {a.key for a in found.inner.actions} == set(chosen)
    assert {a.key for a in found.outer.actions} == {a.key for a in graph.actions} - set(chosen) | {
        "new"
    }
    assert agree(graph, found, Random(3), stop=False) > 5
    assert agree(graph, found, Random(4), stop=True) > 5


@pytest.mark.timeout(900)
@pytest.mark.parametrize("wired", [False, True], ids=["any", "handing on values"])
def test_a_sub_graph_does_what_its_actions_did(wired: bool) -> None:
    told = Counter[str]()

    @settings(
        max_examples=examples(200), deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )  # fmt: skip
    @given(data=st.data(), seed=st.integers(0, 2**32), stop=st.booleans())
    def play(data: st.DataObject, seed: int, stop: bool) -> None:
        graph = data.draw(graphs(wired=wired))
        keys = [action.key for action in graph.actions]
        chosen = data.draw(st.sets(st.sampled_from(keys), min_size=1))
        found = extracted(graph, chosen, "S", "new")
        told["all"] += 1
        if isinstance(found, Unextractable):
            for code in {reason.code for reason in found.reasons}:
                event(f"refused: {code}")
            assert found.reasons
            return
        if found.differences:
            for code in {reason.code for reason in found.differences}:
                event(f"differs: {code}")
            return
        told["same"] += 1
        told["courses"] += agree(graph, found, Random(seed), stop=stop)

    play()
    assert is_share(told["same"], told["all"], 1 / 5)
    assert told["courses"] > told["same"]


def renamed(graph: Graph, **names: str) -> Graph:
    """`renamed(graph, BD="x")`: the output `p` reaches D as `x`."""
    relations = (
        replace(r, remap=(Remap("p", names[r.parent + r.child]),))
        if r.parent + r.child in names
        else r
        for r in graph.relations
    )
    return replace(graph, relations=tuple(relations))


OTHERWISE = {
    "two ends that give one output to two inputs": (
        "otherwise",
        with_values(
            renamed(
                optional(
                    graph_of(
                        "entry>A", "A>B", "A>C", "B>D", "C>D", "D>exit",
                        AB=Conditions("run"), AC=Conditions("ignore", "run", "run"),
                        BD=ENGINE_DEFAULTS, CD=ENGINE_DEFAULTS,
                    ),
                    "B>D", "C>D",
                ),
                BD="x", CD="y",
            ),
            B=({}, {"p": TEXT}),
            C=({}, {"p": TEXT}),
            D=({"x": OPTIONAL, "y": OPTIONAL}, {}),
        ),
        "ABC",
    ),
    "a loop that leads back in": (
        "begins-again",
        optional(
            graph_of("entry>A", "A>B", "B>C", "C>A", "C>exit", CA=Conditions("ignore", "run")),
            "C>A", "A>B",
        ),
        "AB",
    ),
    "one that ends it while another goes on inside": (
        "left-running", optional(graph_of("entry>A", "A>B", "A>C", "B>C", "C>exit"), "A>C"), "AB",
    ),
    "an error that ends nothing, where others follow one": (
        "never-ends",
        graph_of("entry>A", "A>B", "B>C", "C>exit", AB=Conditions("run"), BC=ENGINE_DEFAULTS),
        "AB",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", OTHERWISE)
def test_a_difference_in_behaviour_is_reported(what: str) -> None:
    code, graph, chosen = OTHERWISE[what]
    found = extracted(graph, set(chosen), "S", "new")
    assert isinstance(found, Extracted)
    assert code in {each.code for each in found.differences}


REFUSED = {
    "an arrow into the middle": (
        "ways-in", graph_of("entry>A", "A>B", "B>C", "A>D", "D>C", "C>exit"), "BC",
    ),
    "entries that wait otherwise": (
        "ways-in",
        graph_of("entry>A", "A>B", "A>C", "B>exit", "C>exit", AC=Conditions("run")), "BC",
    ),
    "ends that lead elsewhere": (
        "ways-out", graph_of("entry>A", "A>B", "A>C", "B>D", "C>E", "D>exit", "E>exit"), "ABC",
    ),
    "each follows another": ("ways-in", graph_of("entry>A", "A>exit", "B>C", "C>B"), "BC"),
    "nothing": ("selection", CHAIN, ""),
    "what is gone": ("selection", CHAIN, "AX"),
    "a ghost": ("selection", changed(CHAIN, "B", missing=True), "AB"),
    "a value for two, from two outputs": (
        "values",
        with_values(
            replace(
                (forked := graph_of("entry>A", "A>B", "A>C", "B>exit", "C>exit")),
                relations=tuple(
                    replace(r, remap=(Remap("r" if r.child == "C" else "o", "p"),))
                    if r.parent == "A"
                    else r
                    for r in forked.relations
                ),
            ),
            A=({}, {"o": TEXT, "r": TEXT}), B=({"p": TEXT}, {}), C=({"p": TEXT}, {}),
        ),
        "BC",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_a_selection_that_cannot_be_a_sub_graph_has_a_reason_with_its_place(what: str) -> None:
    code, graph, chosen = REFUSED[what]
    found = extracted(graph, set(chosen), "S", "new")
    assert isinstance(found, Unextractable)
    assert {reason.code for reason in found.reasons} == {code}
    if code in ("ways-in", "ways-out", "values") and what != "each follows another":
        assert all(reason.at for reason in found.reasons)


@pytest.mark.timeout(900)
def test_sub_graphs_of_sub_graphs_count_as_actions() -> None:
    told = Counter[str]()

    @settings(
        max_examples=examples(150), deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )  # fmt: skip
    @given(data=st.data(), wired=st.booleans(), seed=st.integers(0, 2**32))
    def play(data: st.DataObject, wired: bool, seed: int) -> None:
        graph, graphs = data.draw(hierarchies(wired=wired))
        keys = [action.key for action in graph.actions]
        chosen = data.draw(st.sets(st.sampled_from(keys), min_size=1))
        found = extracted(graph, chosen, "Made", "new")
        told["all"] += 1
        if isinstance(found, Unextractable) or found.differences:
            return
        deep = graphs | {"Made": found.inner}
        before = dict(leaves(graph, graphs, "g"))
        after = dict(leaves(found.outer, deep, "g", "Made"))
        assert before.keys() == after.keys()
        random = Random(seed)
        behaviours = {
            name: tuple(
                Behaviour(after_s=random.choice((0.2, 1, 3)) + 2.0**n / 1024, result=result)
                for result in random.choices(RESULTS, k=3)
            )
            for n, name in enumerate(before)
        }
        one, two = (
            course(
                each,
                library,
                Script({f"{run}/{leaf}": behaviours[name] for name, (run, leaf) in at.items()}),
                {place: name for name, place in at.items()},
            )
            for each, library, at in ((graph, graphs, before), (found.outer, deep, after))
        )
        if not one.tied:
            told["courses"] += 1
            assert (two.own, two.result, two.top) == (one.own, one.result, one.top)

    play()
    assert is_share(told["courses"], told["all"], 1 / 10)


def test_an_action_between_the_chosen_ones_is_named() -> None:
    found = extracted(CHAIN, {"A", "C"}, "S", "new")
    assert isinstance(found, Unextractable)
    first = found.reasons[0]
    assert (first.code, first.at[0].action) == ("between", "B_0")
