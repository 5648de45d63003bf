"""Sealed rules of graphs: what both processes verify without each other."""

from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from action_assistant.errors import BadInput, Unavailable
from action_assistant.web.auth.graph_rules import OPEN, Rule
from action_assistant.web.auth.graph_seals import (
    FILE,
    GraphSeals,
    RulesFile,
    Sight,
    Statement,
    statement_of,
)
from action_assistant.web.auth.keys import Keys

KEYS = Keys("a" * 43)
SEALS = GraphSeals(KEYS)
ADA, BEN = Rule(("ada",), ()), Rule(("ben",), "all")
rules = st.sampled_from([OPEN, ADA, BEN, Rule((), ()), Rule(("ada", "ben"), ("night",))])
countings = st.dictionaries(st.sampled_from(["g", "h", "k"]), rules)


def sealed(counting: dict[str, Rule], after: Statement | None = None) -> Statement:
    return SEALS.sealed(statement_of(counting, after))


@given(countings)
def test_a_statement_says_the_rule_of_each_graph(counting: dict[str, Rule]) -> None:
    statement = sealed(counting)
    again = msgspec.json.decode(msgspec.json.encode(statement), type=Statement)
    assert SEALS.holds(again)
    assert {graph: again.rule_of(graph) for graph in counting} == counting
    assert again.rule_of("another") == OPEN


@given(st.data())
def test_whoever_changes_a_byte_or_has_another_token_has_no_seal(data: st.DataObject) -> None:
    sight = SEALS.sealed(Sight("v", "d", ("g", "h"), (ADA, OPEN), 5))
    statement = sealed({"g": ADA})
    forged: list[Sight | Statement] = [
        replace(sight, version="w"),
        replace(sight, digest="e"),
        replace(sight, graphs=("g",)),
        replace(sight, rules=()),
        replace(sight, at=6),
        replace(sight, seal=""),
        replace(sight, seal="é"),
        replace(statement, graphs={}),
        replace(statement, at=statement.at + 1),
        replace(statement, rules=(OPEN,)),
        SEALS.sealed(replace(statement, graphs={"g": 1})),
        GraphSeals(Keys("b" * 43)).sealed(statement),
    ]
    assert SEALS.holds(sight)
    assert not SEALS.holds(data.draw(st.sampled_from(forged)))


def test_the_other_process_reads_what_was_stored(tmp_path: Path) -> None:
    editor, runner = RulesFile(tmp_path, KEYS), RulesFile(tmp_path, KEYS)
    assert runner.newest() is None
    first = sealed({"g": ADA})
    editor.store(first)
    assert runner.newest() == first
    assert (tmp_path / FILE).stat().st_mode & 0o077 == 0
    second = sealed({}, first)
    editor.store(second)
    editor.store(first)  # an old one that comes late
    assert (editor.newest(), runner.newest()) == (second, second)


def test_what_cannot_be_read_changes_nothing(tmp_path: Path) -> None:
    file, statement = RulesFile(tmp_path, KEYS), sealed({"g": ADA})
    file.store(statement)
    for content in (b"", b"{}", msgspec.json.encode(replace(statement, at=statement.at + 9))):
        (tmp_path / FILE).write_bytes(content)
        assert file.newest() == statement
    (tmp_path / FILE).unlink()
    assert file.newest() == statement
    with pytest.raises(BadInput):
        file.store(replace(statement, at=statement.at + 1))


def test_a_file_that_cannot_be_written_is_told_and_the_rule_holds_here(tmp_path: Path) -> None:
    (tmp_path / "data").write_text("a file where the folder should be")
    file, statement = RulesFile(tmp_path / "data", KEYS), sealed({"g": ADA})
    with pytest.raises(Unavailable):
        file.store(statement)
    assert file.newest() == statement
