"""Files of single actions."""

import json
import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.umrf.check import STRUCTURAL, check_action
from action_assistant.umrf.files.codec import Unreadable, read_action, write_action
from action_assistant.umrf.model import Action, Signature
from action_assistant.umrf.signatures import signature_of
from strategies import actions

ROOT = Path(__file__).parents[2]
SHARED = Path(os.environ.get("UMRF_SHARED", ROOT.parent / "shared")) / "umrf"
OWN = Path(__file__).parent / "examples" / "single.umrf.json"
NUMBER = {"pvf_type": "number"}


def found(file: Any) -> dict[str, str]:
    """Codes with their places."""
    return {p.code: p.where.path for p in check_action(read_action(json.dumps(file)))}


def verdicts() -> list[tuple[str, bool, str]]:
    """Name, text and verdict of the engine's parser on files of actions."""
    cases: list[tuple[str, bool, str]] = []
    corpus = SHARED / "corpus" / "verdicts.jsonl"
    for line in corpus.read_text().splitlines() if corpus.exists() else []:
        verdict = json.loads(line)
        path = SHARED / "corpus" / verdict["file"]
        if verdict["file"].startswith("actions/") and path.exists():
            text = path.read_text(errors="replace")
            cases.append((verdict["file"], verdict["accepted"], text))
    validation = SHARED / "traces" / "validation.jsonl"
    for line in validation.read_text().splitlines() if validation.exists() else []:
        case = json.loads(line)
        if case["case"].startswith("action:"):
            cases.append((case["case"], case["accepted"], case["input"]))
    return cases


@pytest.mark.skipif(not verdicts(), reason=f"there are no verdicts in {SHARED}")
def test_we_refuse_exactly_the_actions_that_the_engines_parser_refuses() -> None:
    differing = []
    for name, accepted, text in verdicts():
        try:
            refused = any(p.code in STRUCTURAL for p in check_action(read_action(text)))
        except Unreadable:
            refused = True
        if refused == accepted:
            differing.append(name)
    assert differing == []


@pytest.mark.skipif(not verdicts(), reason=f"there are no verdicts in {SHARED}")
def test_every_readable_action_of_the_corpus_survives_writing() -> None:
    for _, _, text in verdicts():
        try:
            action = read_action(text).action
        except Unreadable:
            continue
        again = read_action(write_action(action))
        assert (again.action, again.dialect) == (action, "D3-action")


@given(st.data())
@settings(max_examples=80)
def test_what_is_written_is_read_as_the_same_action(data: st.DataObject) -> None:
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
def test_what_is_no_action_is_refused(text: str) -> None:
    with pytest.raises(Unreadable):
        read_action(text)
