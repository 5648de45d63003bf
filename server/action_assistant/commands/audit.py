"""`audit`: who did what, when and from where, out of the logs of both processes; `audit verify`,
`audit export` and `audit check` on the data folder."""

import argparse
import csv
import heapq
import io
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, Final

import msgspec
from sqlalchemy import Column, select

from action_assistant import settings
from action_assistant.commands import maintenance
from action_assistant.commands.answers import decoded
from action_assistant.commands.client import Server, add_server, command, running
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.journal.chain import NOTHING, Head, link
from action_assistant.journal.database import Branch
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.private_files import opener
from action_assistant.safe_text import one_line
from action_assistant.schema.editor_tables import editor_event
from action_assistant.web.audit.events import AuditDropped
from action_assistant.web.audit.retention import months_of
from action_assistant.web.audit.rows import AUDIT_KINDS, AuditPage, AuditRow, drops

_PAGE: Final = 500
_DATABASE: Final = "of the editor; default: the one that was served last"
_SAME: Final = "{} events, as they were written"
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
    more = audit.add_subparsers(metavar="verify, export, check")
    verify = command(
        more,
        "verify",
        "prove that both logs are what was written, and print the line to keep elsewhere",
        "--data ./data --sign ~/heads.pem >> heads.txt",
    )
    verify.add_argument("--database", metavar="URL", help=_DATABASE)
    verify.add_argument(
        "--sign", type=Path, metavar="KEY", help="sign the line by an ed25519 key (PEM)"
    )
    verify.set_defaults(handler=_verify)
    example = "audit-2026.jsonl --data ./data"
    told = "write all events that only the audit has, to keep them longer than the server does"
    export = command(more, "export", told, example)
    told = "prove that such a file is what the server has, or what it had when it dropped it"
    check = command(more, "check", told, example)
    for each, handler in ((export, _export), (check, _check)):
        each.add_argument("file", type=Path, metavar="FILE")
        each.add_argument("--database", metavar="URL", default=settings.database(), help=_DATABASE)
        each.set_defaults(handler=handler)


COMMANDS: Final = {"audit": _add_audit}


def _verify(options: argparse.Namespace) -> int:
    """Check the chains of both logs, and print the line that states where they end."""
    return maintenance.verify_with_head(options.data, options.database, options.sign)


class _Line(msgspec.Struct, frozen=True):
    """One event in a file of `audit export`. `chain`: in hex, as the log has it."""

    log: Branch
    stream: str
    seq: int
    kind: str
    author: str
    at: int
    position: int
    chain: str
    body: msgspec.Raw


def _export(options: argparse.Namespace) -> int:
    """Write the events in the audit's streams of both logs into a new file, one in each line."""
    columns: list[Column[Any]] = [
        editor_event.c[name] for name in (*Event.__struct_fields__, "chain")
    ]
    if options.file.exists():
        raise CannotStart(f"{options.file} is there already; name another file.")

    async def write(file: BinaryIO, branch: Branch, journal: Journal) -> bool:
        """Write the audit events of one log, one a line, each with its hash of the chain."""
        count = 0
        for stream in await journal.ask(months_of):
            chosen = select(*columns).where(editor_event.c.stream == stream)
            rows: list[Any] = await journal.query(chosen.order_by(editor_event.c.seq))
            for row in rows:
                event, chain = Event(*row[:7]), bytes(row[7]).hex()
                body = msgspec.Raw(event.body)
                head = (event.kind, event.author, event.at, event.position)
                line = _Line(branch, event.stream, event.seq, *head, chain, body)
                file.write(msgspec.json.encode(line) + b"\n")
                count += 1
        print(f"{branch}: {count} events")
        return True

    try:
        with open(options.file, "xb", opener=opener) as file:
            return maintenance.for_each(
                options.data.resolve(),
                maintenance.journals_of(options),
                partial(write, file),
                upgrades=False,
            )
    except OSError as error:
        raise CannotStart(f"{options.file} cannot be written: {error.strerror}.") from error


def _check(options: argparse.Namespace) -> int:
    """Prove the chain through the events in a file, and compare its ends with both logs."""
    streams: dict[tuple[str, str], list[_Line]] = {}
    try:
        with options.file.open("rb") as file:
            for text in file:
                line = msgspec.json.decode(text, type=_Line)
                streams.setdefault((line.log, line.stream), []).append(line)
    except (OSError, ValueError, RecursionError) as error:
        raise CannotStart(f"{options.file} cannot be read: {error}.") from error

    async def compare(branch: Branch, journal: Journal) -> bool:
        dropped = await journal.ask(drops)
        is_same = True
        for (log, stream), lines in streams.items():
            if log == branch:
                fault = await _fault(journal, stream, lines, [each for _, each in dropped])
                print(one_line(f"{branch}: {stream}: {fault or _SAME.format(len(lines))}"))
                is_same = is_same and not fault
        return is_same

    journals = maintenance.journals_of(options)
    code = maintenance.for_each(options.data.resolve(), journals, compare, upgrades=False)
    for log in {log for log, _ in streams} - {each.branch for each in journals}:
        print(one_line(f"{log}: there is no such log here"))
        code = 1
    return code


async def _fault(
    journal: Journal, stream: str, lines: Sequence[_Line], dropped: Sequence[AuditDropped]
) -> str:
    """Return how the lines of one stream differ from the log, or from what it says that it has
    dropped; "" if they are the same."""
    ends = {each.seq: each.chain for each in dropped if each.stream == stream}
    first, last = lines[0], lines[-1]
    if first.seq == 1:
        head = NOTHING
    elif first.seq - 1 in ends:
        head = Head(first.seq - 1, bytes.fromhex(ends[first.seq - 1]))
    else:
        return f"the events before {first.seq} are not in the file"
    for line in lines:
        fields = (line.seq, line.kind, line.author, line.at, bytes(line.body), line.position)
        written = Event(stream, *fields)
        is_next = written.seq == head.seq + 1
        head = Head(written.seq, link(head.chain, written)) if is_next else NOTHING
        if head.chain.hex() != line.chain:
            return f"event {line.seq} is not what was written"
    event = editor_event.c
    chosen = select(event.chain).where(event.stream == stream, event.seq == last.seq)
    rows = await journal.query(chosen)
    stored = bytes(rows[0].chain).hex() if rows else ends.get(last.seq)
    if stored is None:
        return (
            f"the log does not say how it was at event {last.seq}: it had more when it was dropped"
        )
    return "" if stored == last.chain else f"event {last.seq} is another one in the log"


def _audit(options: argparse.Namespace) -> int:
    everything = options.csv or options.json
    limit = options.limit if options.limit is not None else None if everything else _SHOWN
    with running(options) as server:
        rows, away, notes = _rows(server, _query(server, options))
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
    for sentence in (*away, *notes):
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


def _rows(server: Server, query: dict[str, Any]) -> tuple[Iterator[AuditRow], list[str], list[str]]:
    """Return the rows of all processes, the newest first, and two lists that get sentences: for each
    process that does not answer, and for each that has dropped old rows. Raise RequestRefused if a
    process refuses the query."""
    away: list[str] = []
    notes: list[str] = []
    logs = [
        _log(
            lambda **asked: server.editor("GET", "/api/audit", **asked),
            query,
            "editor",
            away,
            notes,
        ),
        *(
            _log(
                partial(server.at(site).runner, "GET", "/api/audit"),
                query,
                f"runner of {site.name}" if site.name else "runner",
                away,
                notes,
            )
            for site in server.runners.sites
        ),
    ]
    return heapq.merge(*logs, key=lambda row: row.at, reverse=True), away, notes


def _log(
    ask: Callable[..., Any], query: dict[str, Any], name: str, away: list[str], notes: list[str]
) -> Iterator[AuditRow]:
    before: int | None = None
    while True:
        cursor = {} if before is None else {"before": before}
        try:
            page = decoded(ask(params={**query, **cursor}), AuditPage)
        except CannotStart:
            away.append(f"The {name} does not answer: its part of the audit is missing.")
            return
        if before is None and page.dropped is not None:
            gone = page.dropped
            notes.append(
                f"The {name} has dropped rows up to {gone.until.astimezone().strftime(_TIME)} that only "
                f"the audit had: on {gone.at.astimezone().strftime(_TIME)}, since it keeps them for "
                f"{gone.days:g} days."
            )
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
    """Return CSV in which a spreadsheet takes no cell for a formula."""
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
