"""Tables as files: the same columns in CSV and Parquet, typed, with null for what is not known."""

import csv
import importlib.util
import io
from datetime import UTC, datetime
from typing import Any

import pytest

from action_assistant.errors import Unavailable
from action_assistant.runner.repeats import tables
from action_assistant.runner.repeats.tables import Column, csv_of, kind_of, named_once, parquet_of

AT = datetime(2026, 11, 30, 12, 0, 0, 250_000, tzinfo=UTC)
COLUMNS = (
    Column("cell", "int", (1, 2)),
    Column("state", "string", ("finished", None)),
    Column("started_at", "time", (AT, None)),
    Column("seconds_most", "seconds", (1.25, None)),
    Column("Work_1.place", "string", ("=cmd|' /C calc'!A0", "")),
    Column("Work_1.torque", "number", (6.5, None)),
    Column("Work_1.fast", "bool", (True, None)),
    Column("Work_1.points", "numbers", ((1.0, 2.5), None)),
    Column("Work_1.odd", "json", ("a", 1.5)),
)


def test_in_csv_what_is_not_known_is_empty_and_no_text_is_a_formula() -> None:
    first, second = csv.DictReader(io.StringIO(csv_of(COLUMNS).decode()))
    assert first == {
        "cell": "1",
        "state": "finished",
        "started_at": "2026-11-30T12:00:00.250000+00:00",
        "seconds_most": "1.250",
        "Work_1.place": "'=cmd|' /C calc'!A0",
        "Work_1.torque": "6.5",
        "Work_1.fast": "true",
        "Work_1.points": "[1.0,2.5]",
        "Work_1.odd": "a",
    }
    unknown = {name for name, word in second.items() if word == ""}
    assert unknown == {*first} - {"cell", "Work_1.odd"}


def test_no_two_columns_have_one_name_and_none_is_a_formula() -> None:
    assert named_once(["a.b", "=a.b", "a.b"]) == ["a.b", "'=a.b", "a.b (2)"]


def test_an_input_has_the_type_that_all_of_its_values_have() -> None:
    assert kind_of([None, "a"]) == "string"
    assert kind_of([1.0, 2.5, None]) == "number"
    assert kind_of([True, False]) == "bool"
    assert kind_of([(), (1.0,)]) == "numbers"
    assert kind_of([(True,), ("a",)]) == kind_of([True, 1.0]) == kind_of(["a", ("a",)]) == "json"
    assert kind_of([None]) == "string"


def test_without_its_package_parquet_is_refused_with_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tables, "find_spec", lambda _: None)
    with pytest.raises(Unavailable, match=r"pip install 'temoto-action-assistant\[parquet\]'"):
        tables.require_parquet()


@pytest.mark.skipif(
    importlib.util.find_spec("pyarrow") is None, reason="pyarrow is not here; `make soak` has it"
)
def test_parquet_has_the_columns_of_the_csv_with_their_types() -> None:
    from pyarrow import parquet

    found: Any = parquet.read_table(io.BytesIO(parquet_of(COLUMNS)))
    assert {each.name: str(each.type) for each in found.schema} == {
        "cell": "int64",
        "state": "string",
        "started_at": "timestamp[us, tz=UTC]",
        "seconds_most": "double",
        "Work_1.place": "string",
        "Work_1.torque": "double",
        "Work_1.fast": "bool",
        "Work_1.points": "list<element: double>",
        "Work_1.odd": "string",
    }
    rows = found.to_pylist()
    known = {each.name: [each.values[0], each.values[1]] for each in COLUMNS}
    known["Work_1.points"] = [[1.0, 2.5], None]
    known["Work_1.odd"] = ['"a"', "1.5"]
    assert {name: [row[name] for row in rows] for name in known} == known
    assert list(found.column_names) == csv_of(COLUMNS).decode().splitlines()[0].split(",")
