"""`audit`: who did what, when and from where, out of the logs of both processes; `audit verify`."""

import argparse
import csv
import heapq
import io
import sys
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import msgspec

from action_assistant.commands import maintenance
from action_assistant.commands.client import Server, add_server, command, decoded, running
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.web.audit.rows import AUDIT_KINDS, AuditPage, AuditRow

_PAGE: Final = 500
_SHOWN: Final = 200  # rows that are printed without --limit, --csv or --json
_TIME: Final = "%Y-%m-%d %H:%M:%S"
#: A spreadsheet takes a cell that begins with one of these for a formula.
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r", "\n")
CSV_COLUMNS: Final = (
    *("time", "id", "kind", "event", "person", "person_id", "text", "graph", "graph_name", "seq"),
    *("run", "run_number", "robots", "address", "session", "token"),
)


def _add_audit(audit: argparse.ArgumentParser) -> None:
    add_server(audit, "--person Mari --since 2026-11-20 --csv > audit.csv")
    audit.add_argument("--person", metavar="WHO", help="id or name")
    audit.add_argument("--robot", metavar="NAME")
    audit.add_argument("--graph", metavar="GRAPH", help="id or name")
    audit.add_argument(
        "--kind", metavar="KIND", help=f"one or more with commas: {', '.join(AUDIT_KINDS)}"
    )
    audit.add_argument("--since", metavar="TIME", help="a day or a time, ISO 8601")
    audit.add_argument("--until", metavar="TIME", help="likewise; a day is over at its end")
    audit.add_argument("--text", metavar="TEXT", help="words that a row holds")
    audit.add_argument("--limit", type=int, metavar="N", help="of rows, the newest")
    form = audit.add_mutually_exclusive_group()
    form.add_argument("--csv", action="store_true", help="as CSV, for a spreadsheet")
    form.add_argument("--json", action="store_true", help="as JSON, a row in each line")
    audit.set_defaults(handler=_audit)
    more = audit.add_subparsers(metavar="verify")
    verify = command(
        more,
        "verify",
        "prove that both logs are what was written, and print the line to keep elsewhere",
        "--data ./data --sign ~/heads.pem >> heads.txt",
    )
    verify.add_argument(
        "--database", metavar="URL", help="of the editor; default: the one that was served last"
    )
    verify.add_argument(
        "--sign", type=Path, metavar="KEY", help="sign the line by an ed25519 key (PEM)"
    )
    verify.set_defaults(handler=_verify)


COMMANDS: Final = {"audit": _add_audit}


def _verify(options: argparse.Namespace) -> int:
    """Check the chains of both logs, and print the line that states where they end."""
    return maintenance.verify_with_head(options.data, options.database, options.sign)


def _audit(options: argparse.Namespace) -> int:
    everything = options.csv or options.json
    limit = options.limit if options.limit is not None else None if everything else _SHOWN
    with running(options) as server:
        rows, away = _rows(server, _query(server, options))
        if limit is not None:
            rows = (row for _, row in zip(range(limit), rows, strict=False))
        if options.csv:
            _print_csv(rows)
        elif options.json:
            for row in rows:
                sys.stdout.write(msgspec.json.encode(row).decode() + "\n")
        else:
            for row in rows:
                print(one_line(_line(row)))
    for sentence in away:
        print(f"action-assistant: {sentence}", file=sys.stderr)
    return 1 if away else 0


def _query(server: Server, options: argparse.Namespace) -> dict[str, Any]:
    """Return the filters of the command as the query of the route."""
    query: dict[str, Any] = {"limit": _PAGE}
    if options.person:
        query["person"] = _person(server, options.person)
    for name in ("robot", "graph", "kind", "text"):
        if getattr(options, name):
            query[name] = getattr(options, name)
    for name in ("since", "until"):
        given = getattr(options, name)
        if given:
            query[name] = _moment(given, is_end=name == "until").isoformat()
    return query


def _person(server: Server, asked: str) -> str:
    """Return the id of a person. Raise RequestRefused if no person, or several, have this name."""
    try:
        people = server.editor("GET", "/api/people").json()
    except CannotStart:
        return asked
    if any(each["id"] == asked for each in people):
        return asked
    named = [each["id"] for each in people if each["name"] == asked]
    if len(named) > 1:
        raise RequestRefused(f"{len(named)} people are called {asked!r}: {', '.join(named)}.")
    return str(named[0]) if named else asked


def _moment(text: str, *, is_end: bool) -> datetime:
    """Parse a day or a time of this computer's zone. Raise CannotStart for any other text."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError as error:
        raise CannotStart(
            f"{text!r} is no day or time, such as 2026-11-28 or 2026-11-28T14:30."
        ) from error
    if is_end and len(text) == len("2026-11-28"):
        moment = moment.replace(hour=23, minute=59, second=59, microsecond=999_999)
    return moment.astimezone()


def _rows(server: Server, query: dict[str, Any]) -> tuple[Iterator[AuditRow], list[str]]:
    """Return the rows of both processes, the newest first, and a list that gets a sentence for each
    process that does not answer. Raise RequestRefused if a process refuses the query."""
    away: list[str] = []
    logs = [
        _log(lambda **asked: server.editor("GET", "/api/audit", **asked), query, "editor", away),
        _log(lambda **asked: server.runner("GET", "/api/audit", **asked), query, "runner", away),
    ]
    return heapq.merge(*logs, key=lambda row: row.at, reverse=True), away


def _log(
    ask: Callable[..., Any], query: dict[str, Any], name: str, away: list[str]
) -> Iterator[AuditRow]:
    before: int | None = None
    while True:
        cursor = {} if before is None else {"before": before}
        try:
            page = decoded(ask(params={**query, **cursor}), AuditPage)
        except CannotStart:
            away.append(f"The {name} does not answer: its part of the audit is missing.")
            return
        yield from page.rows
        if page.before is None:
            return
        before = page.before


def _line(row: AuditRow) -> str:
    who = "" if row.person is None else (row.person.name or row.person.id) + " "
    return f"{row.at.astimezone().strftime(_TIME)}  {who}{row.text}  ({_whence(row)})"


def _whence(row: AuditRow) -> str:
    """Return the connection of a row in words."""
    if row.origin is None:
        return "" if row.person is None else "connection not recorded"
    where = f"from {row.origin.address}" if row.origin.address else "from this computer"
    if row.origin.token:
        return f"{where}, token {row.origin.token}"
    return f"{where}, session {row.origin.session}" if row.origin.session else where


def _print_csv(rows: Iterable[AuditRow]) -> None:
    sys.stdout.write(csv_text([CSV_COLUMNS]))
    for row in rows:
        sys.stdout.write(csv_text([cells_of(row)]))


def csv_text(lines: Iterable[Iterable[object]]) -> str:
    """Return CSV in which no cell is taken for a formula."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for line in lines:
        writer.writerow([_cell(cell) for cell in line])
    return out.getvalue()


def cells_of(row: AuditRow) -> tuple[object, ...]:
    """Return the cells of a row, in the order of `CSV_COLUMNS`."""
    at = row.at.astimezone(UTC).isoformat().replace("+00:00", "Z")
    person, origin = row.person, row.origin
    who = ("", "") if person is None else (person.name, person.id)
    about = (row.graph, row.graph_name, row.seq, row.run, row.run_number, ", ".join(row.robots))
    whence = ("", "", "") if origin is None else (origin.address, origin.session, origin.token)
    return (at, row.id, row.kind, row.event, *who, row.text, *about, *whence)


def _cell(value: object) -> str:
    text = "" if value is None else str(value)
    return f"'{text}" if text.startswith(_FORMULA) else text
