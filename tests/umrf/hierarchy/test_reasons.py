"""Hierarchies that can be flattened, and those that cannot, with each reason and its place."""

from random import Random

import pytest
from msgspec.structs import replace

from action_assistant.umrf.hierarchy import flattening, joints
from action_assistant.umrf.hierarchy.flattening import Flattened, Unflattenable, flattened
from action_assistant.umrf.model import ENGINE_DEFAULTS, Conditions
from umrf.hierarchy.hierarchies import Hierarchy, leaf
from umrf.hierarchy.lines import CHAIN, ONE, TWO, changed, inner, with_values
from umrf.hierarchy.test_flattening import agree
from umrf.semantics.traces import graph_of, optional

RUN_TRUE, OTHERWISE = Conditions("run"), Conditions("ignore", "run", "run")
SAFE = Conditions("run", "run", "ignore", "ignore")


TEXT = leaf("string")
SIDE_BY_SIDE = inner("entry>X", "entry>Y", "X>exit", "Y>exit")
CHOICE = optional(
    inner("entry>X", "X>Y", "Y>exit", "X>exit", XY=RUN_TRUE, Xexit=OTHERWISE), "Y>exit", "X>exit"
)
LOOP = optional(
    inner("entry>X", "X>Y", "Y>X", "Y>exit", YX=OTHERWISE, Yexit=RUN_TRUE), "Y>X", "X>Y"
)

ACCEPTED = {
    "one action": (CHAIN, ONE),
    "a chain": (CHAIN, TWO),
    "a loop inside": (CHAIN, LOOP),
    "an exit that waits for all": (CHAIN, SIDE_BY_SIDE),
    "an exit that several reach": (CHAIN, CHOICE),
    "the sub-graph alone": (graph_of("entry>S", "S>exit"), CHOICE),
    "beside others": (
        graph_of("entry>A", "entry>S", "A>B", "S>B", "B>exit"),
        SIDE_BY_SIDE,
    ),
    "a bypass goes through": (
        graph_of("entry>A", "A>S", "S>B", "B>exit", AS=ENGINE_DEFAULTS),
        inner("entry>X", "X>Y", "Y>exit", XY=ENGINE_DEFAULTS, Yexit=ENGINE_DEFAULTS),
    ),
    "values go through": (
        with_values(CHAIN, A=({}, {"p": TEXT}), S=({"p": TEXT}, {"q": TEXT}), B=({"q": TEXT}, {})),
        with_values(
            inner("entry>X", "X>exit", Xexit=ENGINE_DEFAULTS), X=({"p": TEXT}, {"q": TEXT})
        ),
    ),
    "a value in the file": (
        with_values(CHAIN, S=({"p": leaf("string", '"s"')}, {})),
        with_values(ONE, X=({"p": TEXT}, {})),
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", ACCEPTED)
def test_a_hierarchy_that_becomes_flat_has_the_same_course(what: str) -> None:
    outer, sub = ACCEPTED[what]
    found = flattened(outer, {"S": sub})
    assert isinstance(found, Flattened)
    hierarchy = Hierarchy(outer, {"S": sub})
    assert agree(hierarchy, found, Random(7), stop=False) > 5
    assert agree(hierarchy, found, Random(7), stop=True) > 5


REFUSED = {
    "halts": ("never-ends", CHAIN, inner("entry>X", "X>Y", "Y>exit", XY=SAFE)),
    "waits": (
        "never-ends",
        graph_of("entry>S", "entry>A", "S>exit", "A>exit", Aexit=Conditions()),
        inner("entry>X", "X>Y", "Z>Y", "Y>exit"),
    ),
    "waits for outputs": (
        "never-ends",
        with_values(CHAIN, S=({}, {"q": TEXT})),
        with_values(ONE, X=({}, {"q": TEXT})),
    ),
    "ends early": (
        "left-running",
        graph_of("entry>S", "S>B", "B>C", "C>exit"),
        optional(inner("entry>X", "entry>Y", "X>exit", "Y>exit"), "X>exit", "Y>exit"),
    ),
    "goes on when the graph around it has ended": (
        "left-running",
        optional(graph_of("entry>A", "entry>S", "A>exit", "S>exit"), "A>exit", "S>exit"),
        TWO,
    ),
    "asks another beside the exit": ("left-running", CHAIN, inner("entry>X", "X>Y", "X>exit")),
    "asks one beside the exit that does not begin": (
        "asks-beside",
        graph_of("entry>S", "S>exit", Sexit=Conditions()),
        inner("entry>X", "X>Y", "X>exit", "Z>Y"),
    ),
    "a second time": (
        "begins-again", optional(graph_of("entry>A", "A>S", "S>A", "S>exit", SA=OTHERWISE,
        Sexit=RUN_TRUE), "S>A", "A>S"), ONE,
    ),
    "a bypass that nothing lets through": (
        "bypass", graph_of("entry>A", "A>S", "S>B", "B>exit", AS=ENGINE_DEFAULTS), TWO,
    ),
    "told to stop": (
        "stops",
        optional(
            graph_of("entry>A", "entry>S", "A>S", "S>exit", AS=Conditions("stop")), "A>S"
        ),
        TWO,
    ),
    "told to restart": (
        "response", graph_of("entry>A", "A>S", "S>B", "B>exit", AS=Conditions("run", "restart")), ONE,
    ),
    "stops inside": ("stops", CHAIN, inner("entry>X", "X>Y", "Y>exit", XY=Conditions("stop"))),
    "spontaneous": ("spontaneous", CHAIN, changed(ONE, "X", type="spontaneous")),
    "ways out that are both required and not": (
        "exits",
        CHAIN,
        optional(
            inner("entry>X", "X>Y", "Y>exit", "X>exit", XY=RUN_TRUE, Xexit=OTHERWISE), "Y>exit"
        ),
    ),
    "what follows waits for others": (
        "exits", graph_of("entry>A", "entry>S", "A>B", "S>B", "B>exit"), CHOICE,
    ),
    "an end inside that is none, and others wait": (
        "exits", graph_of("entry>A", "entry>S", "A>B", "S>B", "B>exit"), changed(LOOP, "X"),
    ),
    "all have to end, and one is bypassed": (
        "exits",
        CHAIN,
        inner(
            "entry>X", "X>Y", "Y>exit", "X>exit", XY=RUN_TRUE,
            Xexit=Conditions("ignore", "bypass", "bypass"),
        ),
    ),
    "an input that one entry needs and another does not": (
        "entries",
        with_values(CHAIN, A=({}, {"p": TEXT}), S=({"p": TEXT}, {})),
        with_values(SIDE_BY_SIDE, X=({"p": TEXT}, {})),
    ),
    "other types": (
        "inputs",
        with_values(CHAIN, A=({}, {"p": TEXT}), S=({"p": leaf("number")}, {})),
        with_values(ONE, X=({"p": TEXT}, {})),
    ),
    "values that are gone in a loop": (
        "loop",
        with_values(CHAIN, S=({"p": leaf("string", '"s"')}, {})),
        with_values(LOOP, X=({"p": TEXT}, {})),
    ),
    "a value that would go past the sub-graph": (
        "renaming",
        with_values(CHAIN, A=({}, {"p": TEXT}), S=({}, {})),
        with_values(ONE, X=({"p": leaf("string", '"own"')}, {})),
    ),
    "outputs, and an end with an error": (
        "outputs",
        with_values(CHAIN, S=({}, {"q": leaf("string", extra=',"pvf_required":false')})),
        with_values(ONE, X=({}, {"q": leaf("string", extra=',"pvf_required":false')})),
    ),
    "outputs, and a bypass that ends it": (
        "outputs",
        with_values(
            CHAIN,
            S=({}, {"q": TEXT}),
            B=({"q": leaf("string", extra=',"pvf_required":false')}, {}),
        ),
        with_values(
            inner("entry>X", "X>exit", Xexit=Conditions("bypass", "run", "bypass")),
            X=({}, {"q": TEXT}),
        ),
    ),
    "choosy": (
        "allowed-values",
        with_values(graph_of("entry>A", "A>B", "B>S", "S>exit"), A=({}, {"p": TEXT}),
                    B=({"p": leaf("string", extra=',"pvf_allowed_values":["a"]')}, {})),
        ONE,
    ),
    "other parameters": ("signature", CHAIN, with_values(ONE, X=({"p": TEXT}, {}))),
    "itself": ("recursion", CHAIN, inner("entry>S", "S>exit")),
    "a ghost": ("faulty", CHAIN, changed(TWO, "Y", missing=True)),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_a_hierarchy_that_cannot_become_flat_has_a_reason(what: str) -> None:
    code, outer, sub = REFUSED[what]
    found = flattened(outer, {"S": sub})
    assert isinstance(found, Unflattenable)
    assert code in {reason.code for reason in found.reasons}


def test_a_reason_leads_to_its_place_at_any_depth() -> None:
    middle = inner("entry>T", "T>exit", name="S")
    deepest = inner("entry>X", "X>Y", "Y>exit", name="T", XY=SAFE)
    found = flattened(CHAIN, {"S": middle, "T": deepest})
    assert isinstance(found, Unflattenable)
    (reason,) = found.reasons
    assert [(level.graph, level.action) for level in reason.at] == [("g", "S_0"), ("S", "T_0")]
    assert "when X_0 ends on_error" in reason.message


def test_all_reasons_are_reported_not_only_the_first() -> None:
    outer = graph_of("entry>S", "S>T", "T>exit", ST=ENGINE_DEFAULTS)
    halting = inner("entry>X", "X>exit", Xexit=SAFE)
    found = flattened(
        outer, {"S": halting, "T": changed(replace(ONE, name="T"), "X", type="spontaneous")}
    )
    assert isinstance(found, Unflattenable)
    assert [(r.code, r.at[0].action) for r in found.reasons] == [
        ("never-ends", "S_0"), ("spontaneous", "T_0"),
    ]  # fmt: skip


def test_more_courses_than_are_examined_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flattening, "BUDGET", 10)
    found = flattened(CHAIN, {"S": TWO})
    assert isinstance(found, Unflattenable)
    assert {reason.code for reason in found.reasons} == {"undecided"}


def test_levels_and_actions_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    deep = {f"N{n}": inner(f"entry>N{n + 1}", f"N{n + 1}>exit", name=f"N{n}") for n in range(60)}
    found = flattened(graph_of("entry>N0", "N0>exit"), deep | {"N60": replace(ONE, name="N60")})
    assert isinstance(found, Unflattenable)
    assert [reason.code for reason in found.reasons] == ["too-large"]
    doubling = {
        f"N{n}": replace(
            graph_of(f"entry>N{n + 1}", f"N{n + 1}>B", "B>exit"), name=f"N{n}",
        )
        for n in range(12)
    }  # fmt: skip
    for name, graph in doubling.items():
        again = f"N{int(name[1:]) + 1}"
        doubling[name] = changed(graph, "B", name=again, instance_id=1)
    doubling["N12"] = replace(ONE, name="N12")
    monkeypatch.setattr(flattening, "MOST", 500)
    found = flattened(graph_of("entry>N0", "N0>exit"), doubling)
    assert isinstance(found, Unflattenable)
    assert {reason.code for reason in found.reasons} == {"too-large"}
    doubling["N12"] = replace(changed(ONE, "X", name="N12"), name="N12")
    found = flattened(graph_of("entry>N0", "N0>exit"), doubling)
    assert isinstance(found, Unflattenable)
    assert 0 < len(found.reasons) <= flattening.REASONS


FORCED = [
    "halts", "waits", "ends early", "goes on when the graph around it has ended",
    "asks one beside the exit that does not begin", "a second time", "told to stop",
    "a bypass that nothing lets through", "what follows waits for others",
    "an end inside that is none, and others wait", "all have to end, and one is bypassed",
    "an input that one entry needs and another does not", "other types",
    "outputs, and a bypass that ends it", "values that are gone in a loop",
]  # fmt: skip


@pytest.mark.parametrize("what", FORCED)
def test_a_refused_hierarchy_would_behave_otherwise(
    what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reasons are none out of caution: made flat all the same, the course is another one."""
    _, outer, sub = REFUSED[what]
    monkeypatch.setattr(flattening, "_troubles", lambda *_, **__: iter(()))
    monkeypatch.setattr(flattening, "faults", lambda _: iter(()))
    monkeypatch.setattr(joints, "_lets_through", lambda *_: True)
    monkeypatch.setattr(joints, "refuse", lambda *_: None)
    found = flattened(outer, {"S": sub})
    assert isinstance(found, Flattened)

    def play() -> None:
        for seed in range(20):
            agree(Hierarchy(outer, {"S": sub}), found, Random(seed), stop=False)

    with pytest.raises(AssertionError):
        play()


def test_actions_that_double_with_each_level_are_counted_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    levels = 16
    doubling = {}
    for n in range(levels):
        graph = graph_of(f"entry>N{n + 1}", f"N{n + 1}>B", "B>exit")
        doubling[f"N{n}"] = changed(
            replace(graph, name=f"N{n}"), "B", name=f"N{n + 1}", instance_id=1
        )
    doubling[f"N{levels}"] = replace(ONE, name=f"N{levels}")
    monkeypatch.setattr(flattening, "inlined", None)  # nothing is put together
    monkeypatch.setattr(flattening, "level_courses", None)  # nor simulated
    found = flattened(graph_of("entry>N0", "N0>exit"), doubling)
    assert isinstance(found, Unflattenable)
    assert [reason.message for reason in found.reasons] == [
        "One graph would have 65,536 actions; 5,000 are the most."
    ]
    deep = {**doubling, "N16": replace(TWO, name="N16")}
    found = flattened(graph_of("entry>N0", "N0>exit"), deep)
    assert isinstance(found, Unflattenable)
    assert "131,072" in found.reasons[0].message
