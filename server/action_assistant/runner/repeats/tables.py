"""A table of columns as a file: CSV, and Parquet where pyarrow is installed.

A value that is not known is empty in CSV and null in Parquet. In CSV no text is one that a spreadsheet
takes for a formula; Parquet has texts as they are, since its strings are never anything else.
"""

import csv
import io
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime
from importlib.util import find_spec
from typing import Any, Final, Literal, TypeAlias

import msgspec

from action_assistant.errors import Unavailable
from action_assistant.runner.analysis.exports import plain_cell
from action_assistant.umrf.kept_values import as_json
from action_assistant.umrf.start_values import Value

Format: TypeAlias = Literal["csv", "parquet"]
MEDIA: Final[dict[Format, str]] = {
    "csv": "text/csv",
    "parquet": "application/vnd.apache.parquet",
}
#: `seconds`: a duration; `json`: values that have no type in common, each as JSON; the rest are types of
#: engines.
Kind: TypeAlias = (
    Literal["int", "seconds", "time", "string", "number", "bool"]
    | Literal["strings", "numbers", "bools", "json"]
)
_KIND_OF: Final[dict[type, Kind]] = {bool: "bool", float: "number", int: "number", str: "string"}


class Column(msgspec.Struct, frozen=True):
    """A column of a table: its name, the type of its values, and a value for each line, None if it is not
    known."""

    name: str
    kind: Kind
    values: tuple[Any, ...]


def named_once(names: Iterable[str]) -> list[str]:
    """Return names of columns of which no two are the same, and none is taken for a formula: a second one
    has a number."""
    counts: Counter[str] = Counter()
    found: list[str] = []
    for name in map(plain_cell, names):
        counts[name] += 1
        found.append(name if counts[name] == 1 else f"{name} ({counts[name]})")
    return found


def kind_of(values: Iterable[Value | None]) -> Kind:
    """Return the type that all given values of an input have in common."""
    given = [each for each in values if each is not None]
    if any(isinstance(each, tuple) for each in given):
        if not all(isinstance(each, tuple) for each in given):
            return "json"
        members = {_KIND_OF[type(one)] for each in given if isinstance(each, tuple) for one in each}
        lists: dict[Kind, Kind] = {"bool": "bools", "number": "numbers", "string": "strings"}
        return lists[members.pop()] if len(members) == 1 else "json" if members else "strings"
    kinds = {_KIND_OF[type(each)] for each in given}
    return kinds.pop() if len(kinds) == 1 else "json" if kinds else "string"


def csv_of(columns: Sequence[Column]) -> bytes:
    """Return a table as CSV with a line of names."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(each.name for each in columns)
    writer.writerows(zip(*map(_words, columns), strict=True))
    return out.getvalue().encode()


def _words(column: Column) -> Iterator[str]:
    for value in column.values:
        match value:
            case None:
                yield ""
            case str():
                yield plain_cell(value)
            case datetime():
                yield value.isoformat()
            case float() if column.kind == "seconds":
                yield f"{value:.3f}"
            case _:
                yield as_json(value)


def has_parquet() -> bool:
    """Return whether the package that writes Parquet is installed."""
    return find_spec("pyarrow") is not None


def require_parquet() -> None:
    """Raise Unavailable if the package that writes Parquet is not installed."""
    if not has_parquet():
        raise Unavailable(
            "Parquet needs pyarrow in the Python of the runner: pip install "
            "'temoto-action-assistant[parquet]' there. The CSV has the same columns."
        )


def parquet_of(columns: Sequence[Column]) -> bytes:
    """Return a table as Parquet. Loading pyarrow takes half a second: not for an event loop."""
    import pyarrow as pa  # not in every installation
    from pyarrow import parquet

    types = {
        "int": pa.int64(),
        "seconds": pa.float64(),
        "time": pa.timestamp("us", tz="UTC"),
        "number": pa.float64(),
        "bool": pa.bool_(),
        "strings": pa.list_(pa.string()),
        "numbers": pa.list_(pa.float64()),
        "bools": pa.list_(pa.bool_()),
    }
    arrays = [
        pa.array(_plain(each), type=types.get(each.kind, pa.string()), from_pandas=False)
        for each in columns
    ]
    out = pa.BufferOutputStream()
    parquet.write_table(pa.table(arrays, names=[each.name for each in columns]), out)
    written: bytes = out.getvalue().to_pybytes()
    return written


def _plain(column: Column) -> list[Any]:
    if column.kind != "json":
        return list(column.values)
    return [None if each is None else as_json(each) for each in column.values]
