"""Uses of an action get the parameters of the library, and nothing else changes."""

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.umrf.action_updates import NO_RENAMES, Renames, is_like, suggested, updated
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import Action, Graph, Parameter, Relation, Remap


def leaf(kind: str = "number", **more: object) -> str:
    return msgspec.json.encode({"pvf_type": kind, **more}).decode()


def parameters(**leaves: str) -> tuple[Parameter, ...]:
    return tuple(Parameter(path.replace("__", "/"), text) for path, text in leaves.items())


def action(key: str, name: str, *, takes: object = (), gives: object = ()) -> Action:
    return Action(key=key, name=name, inputs=takes, outputs=gives)  # type: ignore[arg-type]


def values(graph: Graph, key: str) -> dict[str, object]:
    (found,) = [each for each in graph.actions if each.key == key]
    return {each.path: msgspec.json.decode(each.text).get("pvf_value") for each in found.inputs}


def test_a_use_keeps_its_values_and_unknown_fields() -> None:
    use = action("a", "Go", takes=parameters(speed=leaf(pvf_value=2, mine=["kept"])))
    known = action("", "Go", takes=parameters(speed=leaf(pvf_value=1, pvf_required=False)))
    (after,) = updated(Graph(name="g", actions=(use,)), known).actions
    assert parse_small(after.inputs[0].text) == parse_small(
        leaf(pvf_required=False, pvf_value=2, mine=["kept"])
    )


def test_a_parameter_that_is_new_comes_with_the_value_of_the_library() -> None:
    known = action("", "Go", takes=parameters(speed=leaf(), torque=leaf(pvf_value=12.5)))
    use = action("a", "Go", takes=parameters(speed=leaf(pvf_value=2)))
    assert values(updated(Graph(name="g", actions=(use,)), known), "a") == {
        "speed": 2,
        "torque": 12.5,
    }


def test_a_value_that_no_engine_would_take_goes_with_its_type() -> None:
    known = action("", "Go", takes=parameters(speed=leaf("string"), place=leaf("string")))
    use = action(
        "a",
        "Go",
        takes=parameters(speed=leaf(pvf_value=2), place=leaf("pose", pvf_value="kitchen")),
    )
    after = updated(Graph(name="g", actions=(use,)), known)
    assert values(after, "a") == {"speed": None, "place": "kitchen"}


def test_a_renaming_that_nobody_has_asked_for_is_no_renaming() -> None:
    known = action("", "Go", takes=parameters(velocity=leaf()))
    graph = Graph(name="g", actions=(action("a", "Go", takes=parameters(speed=leaf(pvf_value=2))),))
    assert values(updated(graph, known), "a") == {"velocity": None}
    assert suggested(graph, known) == Renames((("speed", "velocity"),), ())
    assert values(updated(graph, known, suggested(graph, known)), "a") == {"velocity": 2}


def test_an_ambiguous_renaming_is_not_suggested() -> None:
    known = action("", "Go", takes=parameters(velocity=leaf(), torque=leaf()))
    graph = Graph(name="g", actions=(action("a", "Go", takes=parameters(speed=leaf())),))
    assert suggested(graph, known) == NO_RENAMES


def test_values_along_an_arrow_survive_renamings() -> None:
    graph = Graph(
        name="g",
        actions=(
            action("s", "See", gives=parameters(goal=leaf(), at=leaf())),
            action(
                "g",
                "Go",
                takes=parameters(goal=leaf(), speed=leaf(), at=leaf()),
                gives=parameters(way=leaf(), left=leaf()),
            ),
            action("t", "Tell", takes=parameters(way=leaf(), text=leaf())),
        ),
        relations=(
            Relation(parent="s", child="g", remap=(Remap("at", "speed"),)),
            Relation(parent="g", child="t", remap=(Remap("left", "text"),)),
        ),
    )
    known = action(
        "",
        "Go",
        takes=parameters(target=leaf(), velocity=leaf(), at=leaf()),
        gives=parameters(path=leaf(), rest=leaf()),
    )
    renames = Renames(
        (("goal", "target"), ("speed", "velocity")), (("way", "path"), ("left", "rest"))
    )
    to, on = updated(graph, known, renames).relations
    assert to.remap == (Remap("at", "velocity"), Remap("goal", "target"))
    assert on.remap == (Remap("rest", "text"), Remap("path", "way"))


def test_no_renaming_of_an_output_that_went_is_left_for_the_engine_to_abort_on() -> None:
    graph = Graph(
        name="g",
        actions=(
            action("g", "Go", gives=parameters(way=leaf())),
            action("t", "Tell", takes=parameters(text=leaf())),
        ),
        relations=(Relation(parent="g", child="t", remap=(Remap("way", "text"),)),),
    )
    (relation,) = updated(graph, action("", "Go")).relations
    assert relation.remap == ()


def test_a_use_differs_only_in_members_that_count() -> None:
    known = action("", "Go", takes=parameters(a=leaf(pvf_value=1), b__c=leaf("string")))
    same = action(
        "x", "Go", takes=parameters(b__c=leaf("string", pvf_required=True), a=leaf(pvf_example=3))
    )
    other = action("x", "Go", takes=parameters(a=leaf(pvf_required=False), b__c=leaf("string")))
    assert is_like(same, known)
    assert not is_like(other, known)


_PATHS = st.lists(st.sampled_from(["a", "b", "c", "d/x", "d/y"]), unique=True)
_LEAF = st.builds(
    lambda kind, required, value: leaf(kind, pvf_required=required, pvf_value=value),
    st.sampled_from(["number", "string", "thing"]),
    st.booleans(),
    st.sampled_from([1, "one", None]),
)


@st.composite
def _taking(draw: st.DrawFn) -> tuple[Parameter, ...]:
    return tuple(Parameter(path, draw(_LEAF)) for path in draw(_PATHS))


@given(_taking(), _taking(), _taking(), _taking())
def test_after_an_update_every_use_is_like_the_library_and_another_changes_nothing(
    takes: tuple[Parameter, ...],
    gives: tuple[Parameter, ...],
    now_takes: tuple[Parameter, ...],
    now_gives: tuple[Parameter, ...],
) -> None:
    known = action("", "Go", takes=now_takes, gives=now_gives)
    other = action("o", "Other", takes=takes, gives=gives)
    graph = Graph(
        name="g",
        actions=(action("u", "Go", takes=takes, gives=gives), other),
        relations=(Relation(parent="u", child="o"), Relation(parent="o", child="u")),
    )
    after = updated(graph, known)
    use, same = after.actions
    assert is_like(use, known)
    assert same == other
    assert updated(after, known) == after
