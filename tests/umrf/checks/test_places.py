"""Every finding has a place in the given text, and that place has the text that the finding
quotes."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.safe_text import sentence
from action_assistant.umrf.check import check_action, check_reading, check_written
from action_assistant.umrf.files.codec import Reading, Unreadable, read, read_action, write
from action_assistant.umrf.json.places import places_of, pointer
from action_assistant.umrf.model import Graph, Where
from strategies import graphs
from support.doses import examples
from support.recordings import CORPUS, NO_CORPUS

OWN = sorted((Path(__file__).parents[1] / "examples").glob("*.json"))
FILES = sorted(CORPUS.rglob("*.json"))
#: A reply of CMake, which the engine takes for an action, since it has a name and a type.
FOREIGN = ".cmake__api__v1__reply__target-"
SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large]


def said(text: bytes) -> Iterator[tuple[str, Where]]:
    """Return every problem and note about a file, with its place."""
    reading = read(text)
    if reading.dialect in ("D0", "D3-action"):
        action = read_action(text)
        told, found = action.remarks, check_action(action)
    else:
        told, found = reading.remarks, check_reading(reading)
    for problem in found:
        yield problem.message, problem.where
    for note in told:
        yield from ((note.message, where) for where in (note.where, *note.also))


def value_at(value: Any, path: str) -> Any:
    """Return the value at a pointer; fails if there is none."""
    for key in path.split("/")[1:]:
        key = key.replace("~1", "/").replace("~0", "~")
        value = value[int(key)] if isinstance(value, list) else value[key]
    return value


def offset_of(text: str, where: Where) -> int:
    """The offset of a line and column; fails if the text has none such."""
    assert where.line is not None
    assert where.column is not None
    lines = text.split("\n")
    assert where.column <= len(lines[where.line - 1]) + 1
    return sum(len(line) + 1 for line in lines[: where.line - 1]) + where.column - 1


def hold(text: bytes) -> int:
    """Every finding's place exists, by pointer and by line and column, and has what is quoted."""
    decoded = text.decode("utf-8-sig")
    whole = json.loads(decoded)
    count = 0
    for message, where in said(text):
        count += 1
        value = value_at(whole, where.path)
        at = offset_of(decoded, where)
        *_, key = where.path.rsplit("/", 1)
        key = key.replace("~1", "/").replace("~0", "~")
        begin, end = json.JSONDecoder().raw_decode(decoded, at)
        if where.path and isinstance(value_at(whole, where.path.rpartition("/")[0]), dict):
            assert begin == key, (message, where)
            colon = re.compile(r"\s*:\s*").match(decoded, end)
            assert colon is not None
            begin, _ = json.JSONDecoder().raw_decode(decoded, colon.end())
        assert begin == value, (message, where)
        for quoted in re.findall("“(.*?)”", message, re.DOTALL):
            assert has(plain(quoted), where.path, value), (message, where, value)
    return count


def plain(text: str) -> str:
    """Return a text as sentences show it, without the isolates that they put around words."""
    return re.sub("[\u2068\u2069]", "", sentence(text))


def has(quoted: str, path: str, value: Any) -> bool:
    """Return whether a place has a text: as it is, as a full name (`Go_1`), or as a flat name
    (`a::b`)."""
    keys = [plain(key.replace("~1", "/").replace("~0", "~")) for key in path.split("/")]
    texts = {plain(str(each)) for each in leaves(value)} | {plain(path), *keys}
    if any(quoted in text for text in texts):
        return True
    name, _, number = quoted.rpartition("_")
    if name in texts and (number in texts or number == "0"):
        return True
    return any("::".join(keys[n:]) == quoted for n in range(len(keys)))


def leaves(value: Any) -> Iterator[Any]:
    match value:
        case dict():
            for key, member in value.items():
                yield key
                yield from leaves(member)
        case list():
            for member in value:
                yield from leaves(member)
        case _:
            yield value


@pytest.mark.parametrize("path", OWN, ids=lambda path: path.name)
def test_every_finding_of_our_examples_has_its_place(path: Path) -> None:
    hold(path.read_bytes())


@pytest.mark.skipif(not FILES, reason=NO_CORPUS)
def test_every_finding_of_the_corpus_has_its_place() -> None:
    found = [hold(path.read_bytes()) for path in FILES if FOREIGN not in path.name]
    assert sum(found) > 2_000


# Files in which much is wrong


JUNK: list[Any] = [5, None, {"instance_id": 1}, {"name": 3}, {"no": {"such/key": "~"}}]


def spoiled(draw: st.DrawFn, file: dict[str, Any]) -> dict[str, Any]:
    """The file with items that are left out on reading, and what is wrong in the others."""
    for action in file["actions"]:
        for side in ("parents", "children"):
            if side in action:
                mix(draw, action[side])
                for item in action[side]:
                    spoil(draw, item)
        if draw(st.integers(0, 3)) == 0:
            action["state"] = draw(st.sampled_from(["RUNNING", "UNINITIALIZED", "READY", 3]))
    mix(draw, file["actions"], [5, None, "no action"])
    for end in ("graph_entry", "graph_exit"):
        mix(draw, file[end])
    return file


def mix(draw: st.DrawFn, items: list[Any], junk: list[Any] = JUNK) -> None:
    for item in draw(st.lists(st.sampled_from(junk), max_size=2)):
        items.insert(draw(st.integers(0, len(items))), item)


def spoil(draw: st.DrawFn, item: Any) -> None:
    if isinstance(item, dict) and "name" in item and draw(st.integers(0, 3)) == 0:
        item |= draw(
            st.sampled_from(
                [
                    {"conditions": ["on_true -> run", "on_true -> skip"]},
                    {"conditions": "on_true -> run"},
                    {"remap": [{"from": "a", "to": "b"}, {"from": "a", "to": "c"}]},
                    {"required": "yes"},
                    {"instance_id": 70_000},
                ]
            )
        )


def as_ros_1(file: dict[str, Any]) -> dict[str, Any]:
    """Return the graph in the dialect of 2020, as far as it can express it."""
    old = {key: value for key, value in file.items() if not key.startswith("graph_e")}
    old["umrf_actions"] = [older(action) for action in old.pop("actions")]
    for action in old["umrf_actions"]:
        if isinstance(action, dict) and "effect" not in action and "type" in action:
            action["effect"] = f"{action.pop('type')}hronous"
    return old


def older(value: Any) -> Any:
    if isinstance(value, list):
        return [older(item) for item in value]
    if isinstance(value, dict):
        fields = {key: older(member) for key, member in value.items()}
        if "instance_id" in fields and "name" in fields and "id" not in fields:
            fields["id"] = fields.pop("instance_id")
        return fields
    return value


@st.composite
def files(draw: st.DrawFn) -> bytes:
    """Texts of several dialects and layouts."""
    file = spoiled(draw, json.loads(write(draw(graphs()))))
    if draw(st.booleans()):
        file = as_ros_1(file)
    elif draw(st.booleans()):
        file |= {end: {"actions": file[end], "more": 1} for end in ("graph_entry", "graph_exit")}
    text = json.dumps(
        file, indent=draw(st.sampled_from([None, 1])), ensure_ascii=draw(st.booleans())
    )
    text = text.encode(errors="replace").decode()
    if draw(st.booleans()):
        text = "\r\n  " + text.replace("\n", "\r\n")
    return (b"\xef\xbb\xbf" if draw(st.booleans()) else b"") + text.encode()


@given(files())
@settings(max_examples=examples(150), deadline=None, suppress_health_check=SLOW)
def test_every_finding_of_a_spoiled_file_has_its_place(text: bytes) -> None:
    hold(text)


@given(files())
@settings(max_examples=examples(80), deadline=None, suppress_health_check=SLOW)
def test_a_finding_about_an_action_points_at_that_action(text: bytes) -> None:
    reading = read(text)
    whole = json.loads(text.decode("utf-8-sig"))
    actions = {action.key: action for action in reading.graph.actions}
    for problem in check_reading(reading):
        if problem.where.relation is None and problem.where.aid in actions:
            head = "/".join(problem.where.path.split("/")[:3])
            assert value_at(whole, head).get("name", "") == actions[problem.where.aid].name


@given(graphs())
@settings(max_examples=examples(60), deadline=None, suppress_health_check=SLOW)
def test_the_problems_of_a_graph_have_their_places_in_its_canonical_text(graph: Graph) -> None:
    text = write(graph)
    for problem in check_written(graph):
        value_at(json.loads(text), problem.where.path)
        offset_of(text, problem.where)


# Single cases


def places(file: Any) -> dict[str, str]:
    """Return the codes of problems with their places."""
    return {p.code: p.where.path for p in check_reading(reading_of(file))}


def reading_of(file: Any) -> Reading:
    return read(json.dumps(file))


GO: dict[str, Any] = {"name": "Go", "type": "sync"}


def test_a_missing_value_has_the_place_where_it_would_be() -> None:
    file = {"graph_name": "g", "actions": [{"name": "Go"}]}
    assert places(file)["type-missing"] == "/actions/0"
    reading = reading_of({"umrf_actions": [{"name": "Go", "effect": "synchronous"}]})
    missing = next(p for p in reading.problems if p.code == "graph-name-missing")
    assert (missing.where.path, missing.where.line, missing.where.column) == ("", 1, 1)


def test_an_end_that_was_made_from_the_actions_points_at_the_action() -> None:
    loop = {"name": "A", "id": 0, "effect": "asynchronous", "parents": [{"name": "Z", "id": 0}]}
    first = {"name": "B", "id": 0, "effect": "synchronous"}
    found = check_reading(reading_of({"graph_name": "g", "umrf_actions": [loop, first]}))
    ghost = next(p for p in found if p.code == "ghost")
    assert ghost.where.path == "/umrf_actions/0/parents/0"


def test_a_condition_is_quoted_where_it_stands() -> None:
    parents = [{"name": "A", "conditions": ["on_true -> run", "on_true -> skip"]}]
    actions = [
        GO | {"name": "A", "children": [{"name": "B"}]},
        GO | {"name": "B", "parents": parents},
    ]
    ends = {"graph_entry": [{"name": "A"}], "graph_exit": [{"name": "B"}]}
    found = check_reading(reading_of({"graph_name": "g", "actions": actions} | ends))
    wrong = next(p for p in found if p.code == "condition-illegal")
    assert wrong.where.path == "/actions/1/parents/0/conditions/1"
    assert "“on_true -> skip”" in wrong.message


def test_a_field_on_the_wrong_side_has_its_place_there() -> None:
    children = [{"name": "B", "conditions": ["on_true -> run"]}]
    parents = [{"name": "A", "remap": []}]
    actions = [GO | {"name": "A", "children": children}, GO | {"name": "B", "parents": parents}]
    ends = {"graph_entry": [{"name": "A"}], "graph_exit": [{"name": "B"}]}
    found = check_reading(reading_of({"graph_name": "g", "actions": actions} | ends))
    assert {p.where.path for p in found if p.code == "wrong-side"} == {
        "/actions/0/children/0/conditions",
        "/actions/1/parents/0/remap",
    }


@pytest.mark.parametrize(
    ("text", "code", "place"),
    [
        ('{"a": {"x": 1,\n "k~/": 2, "k~/": 3}}', "double-key", ("/a/k~0~1", 2, 12)),
        ('{"a": 1, "a": {"b": 1, "b": 2}}', "double-key", ("/a", 1, 10)),
        ('\ufeff{"a": [1,\r\n  1e999]}', "number-too-big", ("/a/1", 2, 3)),
        ('{"graph_name": "g",\n "x": ["\\ud800"]}', "lone-surrogate", ("/x/0", 2, 8)),
        ('{"a": 1,\n }', "not-json", ("", 2, 2)),
        ('[{"graph_name": "g", "actions": []}]', "not-umrf", ("", 1, 1)),
    ],
)
def test_an_unreadable_text_has_the_place_of_the_reason(
    text: str, code: str, place: tuple[str, int, int]
) -> None:
    with pytest.raises(Unreadable) as caught:
        read(text)
    wrong = caught.value
    assert (wrong.code, wrong.path, wrong.line, wrong.column) == (code, *place)


def test_bytes_that_are_no_utf_8_have_their_place() -> None:
    with pytest.raises(Unreadable) as caught:
        read('{"é":\n "'.encode() + b'\xff"}')
    assert (caught.value.line, caught.value.column) == (2, 3)


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=20,
)


@given(JSON_VALUES, st.booleans())
@settings(max_examples=examples(150), deadline=None)
def test_every_pointer_of_a_text_is_found(value: Any, plain: bool) -> None:
    text = json.dumps(value, ensure_ascii=plain)
    every = dict(walk(value))
    found = places_of(text, [*every, "/no/such/0"])
    for path in every:
        assert found[path].path == path
        where = Where(path=path, line=found[path].line, column=found[path].column)
        json.JSONDecoder().raw_decode(text, offset_of(text, where))


def walk(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    yield path, value
    members: Any = ()
    if isinstance(value, dict):
        members = value.items()
    elif isinstance(value, list):
        members = enumerate(value)
    for key, member in members:
        yield from walk(member, path + pointer(key))
