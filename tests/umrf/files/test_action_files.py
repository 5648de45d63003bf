"""Files of single actions."""

import json
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.umrf.check import STRUCTURAL, check_action
from action_assistant.umrf.files.codec import Unreadable, read_action, write_action
from action_assistant.umrf.model import Action, Signature
from action_assistant.umrf.signatures import signature_of
from strategies import actions
from support.doses import examples
from support.recordings import CORPUS, NO_CORPUS, family, lines

OWN = Path(__file__).parents[1] / "examples" / "single.umrf.json"
NUMBER = {"pvf_type": "number"}
#: Name, verdict, text.
Verdicts: TypeAlias = list[tuple[str, bool, str]]


def found(file: Any) -> dict[str, str]:
    """Return the codes of problems with their places."""
    return {p.code: p.where.path for p in check_action(read_action(json.dumps(file)))}


def recorded() -> Verdicts:
    """Return the answers of the engine's parser to action files that were made for it."""
    cases = lines(family("engine") / "validation.jsonl")
    return [
        (c["case"], c["accepted"], c["input"]) for c in cases if c["case"].startswith("action:")
    ]


def real() -> Verdicts:
    """Return the answers of the engine's parser to action files of repositories."""
    verdicts = lines(CORPUS / "verdicts.jsonl")
    return [
        (v["file"], v["accepted"], path.read_text(errors="replace"))
        for v in verdicts
        if v["file"].startswith("actions/") and (path := CORPUS / v["file"]).exists()
    ]


both = pytest.mark.parametrize(
    "verdicts",
    [recorded(), pytest.param(real(), marks=pytest.mark.skipif(not real(), reason=NO_CORPUS))],
    ids=["recorded", "real"],
)


@both
def test_we_refuse_exactly_the_actions_that_the_engines_parser_refuses(verdicts: Verdicts) -> None:
    assert verdicts
    differing = []
    for name, accepted, text in verdicts:
        try:
            refused = any(p.code in STRUCTURAL for p in check_action(read_action(text)))
        except Unreadable:
            refused = True
        if refused == accepted:
            differing.append(name)
    assert differing == []


@both
def test_every_readable_action_of_the_corpus_survives_writing(verdicts: Verdicts) -> None:
    assert verdicts
    for _, _, text in verdicts:
        try:
            action = read_action(text).action
        except Unreadable:
            continue
        again = read_action(write_action(action))
        assert (again.action, again.dialect) == (action, "D3-action")


@given(st.data())
@settings(max_examples=examples(80))
def test_a_written_action_is_read_as_the_same_action(data: st.DataObject) -> None:
    action: Action = data.draw(actions("a1", "Go", data.draw(st.integers(0, 3))))
    assert read_action(write_action(action)).action == action


def test_an_action_of_2019_is_translated_and_says_so() -> None:
    reading = read_action(OWN.read_text())
    assert reading.dialect == "D0"
    assert reading.notes
    assert not any("graph" in note for note in reading.notes)
    assert read_action(write_action(reading.action)).dialect == "D3-action"


def test_the_signature_of_an_action_names_types_and_what_is_optional() -> None:
    file = {
        "name": "Go",
        "type": "sync",
        "input_parameters": {"pose": {"x": NUMBER, "y": NUMBER | {"pvf_required": False}}},
        "output_parameters": {"reached": {"pvf_type": "bool"}},
    }
    assert signature_of(read_action(json.dumps(file)).action) == Signature(
        inputs={"pose::x": "number", "pose::y": "number"},
        outputs={"reached": "bool"},
        optional=frozenset({"pose::y"}),
    )


def test_problems_have_their_place_in_the_file_of_the_action() -> None:
    good = {"name": "Go", "type": "sync"}
    assert found(good) == {}
    assert found(good | {"type": ""}) == {"type-empty": "/type"}
    assert found(good | {"name": "go away"}) == {"name-class": "/name"}
    wrong = {"input_parameters": {"x": NUMBER | {"pvf_value": "1"}}}
    assert found(good | wrong) == {"parameter-illegal": "/input_parameters/x"}
    assert found({"name": "Go", "effect": "sync"})["dialect-old"] == ""


def test_relations_in_the_file_of_an_action_are_kept() -> None:
    text = '{"name": "Go", "type": "sync", "parents": [{"name": "A"}], "children": 5}'
    action = read_action(text).action
    assert action.extra == (("parents", '[{"name":"A"}]'), ("children", "5"))
    assert json.loads(write_action(action))["children"] == 5


@pytest.mark.parametrize(
    "text", ["[]", "{}", '{"graph_name": "g", "actions": []}', "", '{"name": 5}']
)
def test_a_file_that_is_no_action_is_refused(text: str) -> None:
    with pytest.raises(Unreadable):
        read_action(text)
