"""Graphs as hypothesis draws them, in which much happens: chains, branches, joins, loops, values."""

from typing import Any

from hypothesis import strategies as st

from action_assistant.umrf.model import (
    ENGINE_DEFAULTS,
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    RESPONSES,
    Action,
    Conditions,
    Graph,
    Parameter,
    Relation,
)

PLAIN = st.sampled_from(["run", "run", "run", "bypass", "ignore", "ignore"])
ANY = st.one_of(PLAIN, st.sampled_from(RESPONSES))


def conditions(answers: st.SearchStrategy[Any]) -> st.SearchStrategy[Conditions]:
    usual = st.sampled_from(
        [ENGINE_DEFAULTS, Conditions("run", "run"), Conditions("run"), Conditions("ignore", "run")]
    )
    return st.one_of(usual, st.builds(Conditions, answers, answers, answers, answers))


LEAF = st.sampled_from(
    [
        '{"pvf_type":"string"}',
        '{"pvf_type":"string","pvf_value":"x"}',
        '{"pvf_type":"number"}',
        '{"pvf_type":"string","pvf_required":false}',
        '{"pvf_type":"string","pvf_updatable":false}',
    ]
)
SIDE = st.dictionaries(st.sampled_from("pq"), LEAF, max_size=2).map(
    lambda d: tuple(Parameter(*each) for each in d.items())
)


@st.composite
def busy_graphs(draw: st.DrawFn, most: int = 12) -> Graph:
    """Chains, branches, joins and loops; half of them have values, some stop and pause."""
    count = draw(st.integers(1, most))
    said = conditions(ANY if draw(st.integers(0, 3)) == 0 else PLAIN)
    values = draw(st.booleans())
    nothing: st.SearchStrategy[tuple[Parameter, ...]] = st.just(())
    actions = tuple(
        Action(
            key=f"k{n}", name=f"A{n}",
            inputs=draw(SIDE if values and n else nothing), outputs=draw(SIDE if values else nothing),
        )
        for n in range(count)
    )  # fmt: skip
    place = st.integers(0, count - 1)
    pairs = draw(st.sets(st.tuples(place, place), max_size=2 * count))
    if draw(st.booleans()):
        pairs = {(min(pair), max(pair)) for pair in pairs if pair[0] != pair[1]}
    if draw(st.booleans()):
        pairs |= {(n, n + 1) for n in range(count - 1)}
    order = st.floats(0, 1)

    def arrow(parent: str, child: str) -> Relation:
        return Relation(
            parent=parent, child=child, conditions=draw(said), required=draw(st.booleans()),
            parent_order=draw(order), child_order=draw(order),
        )  # fmt: skip

    arrows = [arrow(f"k{a}", f"k{b}") for a, b in sorted(pairs)]
    arrows += [
        Relation(parent=ENTRY, child=f"k{n}", conditions=ENTRY_CONDITIONS)
        for n in sorted({0} | draw(st.sets(place, max_size=2)))
    ]
    arrows += [arrow(f"k{n}", EXIT) for n in sorted(draw(st.sets(place, max_size=3)))]
    return Graph(name="g", actions=actions, relations=tuple(arrows))
