"""The digest changes with the meaning of a graph only."""

from random import Random

import msgspec
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.umrf.digest import digest, tree_digest
from action_assistant.umrf.files.codec import Stamp, read, write
from action_assistant.umrf.model import Graph
from strategies import graphs
from support.doses import examples

FILE = """{"graph_name": "g", "actions": [{"name": "A", "type": "sync",
  "input_parameters": {"p": {"pvf_type": "number", "pvf_value": %s}}%s}]}"""


def of(text: str) -> str:
    return digest(read(text).graph)


@given(graphs(max_actions=4))
@settings(max_examples=examples(60))
def test_layout_stamps_and_keys_do_not_count(graph: Graph) -> None:
    stamped = read(write(graph, Stamp(graph="g", version="v", run="r"))).graph
    moved = msgspec.structs.replace(graph, entry_position=(1.0, 2.0), notes=(("n", "1"),))
    moved = msgspec.structs.replace(
        moved, direction="down" if graph.direction == "right" else "right"
    )
    led = tuple(
        msgspec.structs.replace(relation, waypoints=(("run", "[[1,2]]"),))
        for relation in graph.relations
    )
    moved = msgspec.structs.replace(moved, relations=led)
    assert digest(graph) == digest(stamped) == digest(moved)


def test_numbers_count_by_value_and_not_by_spelling() -> None:
    assert of(FILE % ("5", "")) == of(FILE % ("5.0", "")) == of(FILE % ("0.5e1", ""))
    assert of(FILE % ("5", "")) != of(FILE % ("5.000001", ""))


def test_run_state_does_not_count() -> None:
    assert of(FILE % ("5", "")) == of(FILE % ("5", ', "state": "RUNNING"'))


def test_meaning_counts() -> None:
    plain = of(FILE % ("5", ""))
    assert plain != of(FILE % ("5", ', "description": "d"'))
    assert plain != of(FILE % ("5", ', "actor": "a"'))
    assert plain != of(FILE % ("5", ', "mine": 1'))


def test_the_order_of_members_does_not_count_that_of_actions_does() -> None:
    one = '{"graph_name":"g","graph_entry":[],"graph_exit":[],"actions":[%s]}'
    a, b = '{"name":"A","type":"sync"}', '{"type":"sync","name":"B"}'
    turned = '{"name":"B","type":"sync"}'
    assert of(one % f"{a},{b}") == of(one % f"{a},{turned}")
    assert of(one % f"{a},{b}") != of(one % f"{b},{a}")


def test_the_digest_is_lower_case_hexadecimal_sha_256() -> None:
    text = of('{"graph_name":"g","graph_entry":[],"graph_exit":[],"actions":[]}')
    # SHA-256 of {"actions":[],"graph_entry":[],"graph_exit":[],"graph_name":"g"}
    assert text == "9764f09cef28213f7343b9d7578be426c4878ee7e2201f73b2c3b8d402efe6a3"


@given(
    st.dictionaries(st.text("ab", min_size=1, max_size=3), st.text("01", min_size=2, max_size=2)),
    st.randoms(use_true_random=False),
)
def test_a_tree_has_one_digest_in_any_order_and_another_for_anything_else(
    inside: dict[str, str], random: Random
) -> None:
    pairs = list(inside.items())
    mixed = random.sample(pairs, len(pairs))
    whole = tree_digest("00", pairs)
    assert tree_digest("00", mixed) == whole
    assert (whole == "00") == (not inside)
    assert tree_digest("11", pairs) != whole
    for name in inside:
        assert tree_digest("00", (inside | {name: "other"}).items()) != whole
        assert tree_digest("00", [pair for pair in pairs if pair[0] != name]) != whole
