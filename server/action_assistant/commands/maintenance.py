"""Commands that look after journals: verify, rebuild."""

import argparse
import asyncio
import sqlite3
import sys
from collections.abc import Awaitable, Callable, Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from sqlalchemy import make_url
from sqlalchemy.exc import DBAPIError

from action_assistant import settings
from action_assistant.commands.place import add_data, add_database
from action_assistant.errors import CannotStart, Refused, Unavailable
from action_assistant.journal import foreign_schema, heads
from action_assistant.journal.chain import Damage
from action_assistant.journal.copies.before_upgrade import FOLDER
from action_assistant.journal.database import Branch, cause_of
from action_assistant.journal.events import Event, Fold
from action_assistant.journal.journal import Journal
from action_assistant.journal.migrate import recognize, revisions_of
from action_assistant.journal.slots import Cursor
from action_assistant.safe_text import told
from action_assistant.settings import settled

if TYPE_CHECKING:
    from action_assistant.commands import head_line


def _add_verify(verify: argparse.ArgumentParser) -> None:
    verify.epilog = (
        "example: action-assistant verify --data ./data; "
        "action-assistant verify --head --sign ~/heads.pem >> heads.txt; "
        "action-assistant verify --against heads.txt --key ~/heads.pem"
    )
    add_data(verify)
    add_database(verify)
    verify.add_argument(
        "--head",
        action="store_true",
        help="print one line to keep elsewhere, which shows later whether somebody has altered the logs "
        "and made their chain anew",
    )
    verify.add_argument(
        "--sign",
        type=Path,
        metavar="KEY",
        help="sign that line by an ed25519 key (PEM) that is not in the data folder",
    )
    verify.add_argument(
        "--against",
        metavar="LINE",
        help="compare the logs with such a line, or with each line of a file",
    )
    verify.add_argument(
        "--key",
        type=Path,
        metavar="KEY",
        help="with --against: the key, private or public (PEM), that has to have signed each line",
    )
    verify.set_defaults(handler=_verify)


def _add_rebuild(rebuild: argparse.ArgumentParser) -> None:
    rebuild.epilog = "example: action-assistant rebuild --data ./data"
    add_data(rebuild)
    add_database(rebuild)
    rebuild.set_defaults(handler=_rebuild)


COMMANDS: Final = {"verify": _add_verify, "rebuild": _add_rebuild}


def verify_with_head(data: Path, database: str | None, sign: Path | None) -> int:
    """Do as `verify --head` does: check every journal of a data folder, and print the line to keep
    elsewhere. Return 0 if all are sound, else 1."""
    return _verify(
        argparse.Namespace(
            data=data,
            database=database or settings.database(),
            head=True,
            sign=sign,
            against=None,
            key=None,
        )
    )


def _verify(options: argparse.Namespace) -> int:
    data = options.data.resolve()
    makes_line = options.head or options.sign is not None
    if makes_line and options.against is not None:
        raise CannotStart("Make a line by --head, or compare with one by --against, and not both.")
    if options.key is not None and options.against is None:
        raise CannotStart("--key proves lines of --against; a new line is signed by --sign.")
    from action_assistant.commands import head_line  # loads what signs, which takes a while

    signing = None if options.sign is None else head_line.signing_key(options.sign, data)
    proving = None if options.key is None else head_line.proving_key(options.key, data)
    given = [head_line.read(line, proving) for line in _lines(options.against)]
    now: dict[Branch, heads.LogHead] = {}
    journals = journals_of(options)
    strange = {each.branch: _strange(each) for each in journals}
    for branch, sentences in strange.items():
        for sentence in sentences:
            _say(f"{branch}: {sentence}", makes_line)

    async def look(branch: Branch, journal: Journal) -> bool:
        """Return whether the journal of this branch is sound and still has what the given lines name."""
        revision, newest = max(await journal.ask(recognize)), revisions_of(branch)[-1]
        if revision != newest:
            _say(
                f"{branch}: its tables are of schema {revision}, before this version's {newest}; they are "
                "left as they are",
                makes_line,
            )
        moment = await journal.cursor()
        damages = await journal.verify()
        for damage in damages:
            _say(f"{branch}: {_sentence(damage)}", makes_line)
        if damages or strange[branch]:
            return False
        _say(f"{branch}: {moment.events} events, all of them sound", makes_line)
        if makes_line:
            now[branch] = await _head(journal, branch, moment, data)
        outcomes = [await _is_as_then(journal, branch, line, moment, data) for line in given]
        return all(outcomes)

    code = for_each(data, journals, look, upgrades=False)
    for line in given:
        for branch in line.heads.keys() - strange.keys():
            print(f"{branch}: the line of {line.time} speaks of it, and it is not there")
            code = 1
    if makes_line and code == 0:
        at = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        print(head_line.written(at, now, signing))
    return code


def _say(sentence: str, is_aside: bool) -> None:
    """Print a sentence; with `is_aside` to stderr, since stdout then has only a line for programs."""
    print(sentence, file=sys.stderr if is_aside else sys.stdout)


def _lines(given: str | None) -> list[str]:
    """Return the lines of `verify --head` that the option --against names. `given` is one such line
    itself, or the path of a file of such lines; None stands for an absent option and gives no
    lines. Raise CannotStart if the file cannot be read or has no line."""
    if given is None:
        return []
    if "action-assistant-heads" in given:
        return [given]
    try:
        lines = [line for line in Path(given).read_text().splitlines() if line.strip()]
    except (OSError, ValueError) as error:
        raise CannotStart(
            f"{given} is neither a line of `verify --head` nor a file of them."
        ) from error
    if not lines:
        raise CannotStart(f"{given} holds no line of `verify --head`.")
    return lines


def _strange(journal: "KnownJournal") -> list[str]:
    """Return sentences about objects in the schema of a journal that are not this program's. A
    database on a server is not checked, since it may have other users."""
    if not journal.url.startswith("sqlite:"):
        return []
    path = Path(make_url(journal.url).database or "")
    try:
        return foreign_schema.look(path, journal.branch).sentences()
    except sqlite3.Error as error:
        return [f"its schema cannot be read: {error}"]


async def _head(journal: Journal, branch: Branch, cursor: Cursor, data: Path) -> heads.LogHead:
    """Return the end of the log of a branch at the moment `cursor`, with a digest over the
    ends of all its streams then, also of archived ones. `data`: the data folder. Raise OSError or
    Refused if an archive cannot be read."""
    from action_assistant.runner.archives import archive_file

    folder = settings.keep(data).folder

    def kept(place: str) -> Iterable[Event]:
        path = folder / place
        if not path.resolve().is_relative_to(folder):
            raise OSError(f"{place} leads out of {folder}")
        return archive_file.read(path)

    return await heads.head_at(journal, branch, cursor, kept)


async def _is_as_then(
    journal: Journal, branch: Branch, line: "head_line.HeadLine", now: Cursor, data: Path
) -> bool:
    """Return whether the log of a branch, which has come to the moment `now`, still begins as a line of
    `verify --head` says, and print the result. `data`: the data folder."""
    then = line.heads.get(branch)
    if then is None:
        print(f"{branch}: the line of {line.time} does not speak of it")
        return True
    count = then.cursor.events
    if not now.covers(then.cursor):
        print(
            f"{branch}: it had {count} events at {line.time}, and has {now.events}: the others were "
            "removed, or an older backup was restored"
        )
        return False
    try:
        found = await _head(journal, branch, then.cursor, data)
    except (OSError, Refused) as error:
        why = error.detail if isinstance(error, Refused) else str(error)
        print(told(f"{branch}: cannot be compared with the line of {line.time}: {why}"))
        return False
    if found.digest != then.digest:
        print(
            f"{branch}: is NOT what it was at {line.time}: one of its first {count} events was "
            "altered since, and the chain was made anew"
        )
        return False
    print(f"{branch}: its first {count} events are those of {line.time}")
    return True


def _rebuild(options: argparse.Namespace) -> int:
    async def again(branch: Branch, journal: Journal) -> bool:
        print(f"{branch}: tables made again from {await journal.rebuild()} events")
        return True

    return for_each(options.data.resolve(), journals_of(options), again)


class KnownJournal(NamedTuple):
    """One journal of a data folder, and the fold that computes its tables."""

    branch: Branch
    url: str
    fold: Fold


def journals_of(options: argparse.Namespace) -> list[KnownJournal]:
    """Return all journals of the data folder. Raise CannotStart if there are none."""
    from action_assistant.editor.log import database_location
    from action_assistant.editor.log.graph_events import fold as editor_fold
    from action_assistant.runner.projection import fold as runner_fold

    data = options.data.resolve()
    settled(data)
    found: list[KnownJournal] = []
    url = database_location.journal_of(data, options.database)
    if url is not None:
        found.append(KnownJournal("editor", url, editor_fold))
    if (data / "runner.db").is_file():
        found.append(KnownJournal("runner", f"sqlite:///{data / 'runner.db'}", runner_fold))
    if not found:
        raise CannotStart(f"There is no journal in {data}.")
    return found


def for_each(
    data: Path,
    journals: Sequence[KnownJournal],
    handler: Callable[[Branch, Journal], Awaitable[bool]],
    *,
    upgrades: bool = True,
) -> int:
    """Open each journal in turn and call `handler` with it; return the exit code: 0 if each call
    returned True, else 1. `data`: the data folder. Without `upgrades` tables stay as they are. Raise
    CannotStart if a journal cannot be opened."""

    async def one(branch: Branch, url: str, fold: Fold) -> bool:
        journal = await Journal.open(
            url, branch=branch, fold=fold, copies=data / FOLDER, upgrades=upgrades
        )
        try:
            return await handler(branch, journal)
        except Unavailable as error:
            print(told(f"{branch}: {error.detail}"))
            return False
        finally:
            await journal.close()

    outcomes = []
    for each in journals:
        try:
            outcomes.append(asyncio.run(one(*each)))
        except DBAPIError as error:
            raise CannotStart(
                f"Cannot open the journal of the {each.branch}: {cause_of(error)}."
            ) from error
    return 0 if all(outcomes) else 1


def _sentence(damage: Damage) -> str:
    if not damage.stream:
        return f"the file is damaged: {damage.why}"
    good = f"sound up to {damage.seq - 1}" if damage.seq > 1 else "not sound from its beginning"
    return f"{damage.stream} is {good}; at event {damage.seq}: {damage.why}"
