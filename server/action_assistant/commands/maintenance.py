"""Commands that look after journals: verify, rebuild."""

import argparse
import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Final

from action_assistant import paths, settings
from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal.chain import Damage
from action_assistant.journal.copies.before_upgrade import FOLDER
from action_assistant.journal.database import Branch
from action_assistant.journal.events import Fold
from action_assistant.journal.journal import Journal
from action_assistant.settings import settled


def _add_verify(verify: argparse.ArgumentParser) -> None:
    verify.epilog = "example: action-assistant verify --data ./data"
    _where(verify)
    verify.set_defaults(handler=_verify)


def _add_rebuild(rebuild: argparse.ArgumentParser) -> None:
    rebuild.epilog = "example: action-assistant rebuild --data ./data"
    _where(rebuild)
    rebuild.set_defaults(handler=_rebuild)


COMMANDS: Final = {"verify": _add_verify, "rebuild": _add_rebuild}


def _where(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="default: %(default)s"
    )
    parser.add_argument(
        "--database",
        metavar="URL",
        default=settings.database(),
        help="of the editor; default: the one that was served last",
    )


def _verify(options: argparse.Namespace) -> int:
    async def look(branch: Branch, journal: Journal) -> bool:
        events = await journal.position()
        damages = await journal.verify()
        for damage in damages:
            print(f"{branch}: {_sentence(damage)}")
        if not damages:
            print(f"{branch}: {events} events, all of them sound")
        return not damages

    return _for_each(options, look)


def _rebuild(options: argparse.Namespace) -> int:
    async def again(branch: Branch, journal: Journal) -> bool:
        print(f"{branch}: tables made again from {await journal.rebuild()} events")
        return True

    return _for_each(options, again)


def _for_each(
    options: argparse.Namespace, handler: Callable[[Branch, Journal], Awaitable[bool]]
) -> int:
    """Do it to every journal that there is; 1 unless all went well. Raises CannotStart."""
    from action_assistant.editor.log import database_location
    from action_assistant.editor.log.graph_events import fold as editor_fold
    from action_assistant.runner.projection import fold as runner_fold

    data = options.data.resolve()
    settled(data)
    found: list[tuple[Branch, str, Fold]] = []
    url = database_location.journal_of(data, options.database)
    if url is not None:
        found.append(("editor", url, editor_fold))
    if (data / "runner.db").is_file():
        found.append(("runner", f"sqlite:///{data / 'runner.db'}", runner_fold))
    if not found:
        raise CannotStart(f"There is no journal in {data}.")

    async def one(branch: Branch, url: str, fold: Fold) -> bool:
        journal = await Journal.open(url, branch=branch, fold=fold, copies=data / FOLDER)
        try:
            return await handler(branch, journal)
        except Unavailable as error:
            print(f"{branch}: {error.detail}")
            return False
        finally:
            await journal.close()

    outcomes = [asyncio.run(one(*each)) for each in found]
    return 0 if all(outcomes) else 1


def _sentence(damage: Damage) -> str:
    if not damage.stream:
        return f"the file is damaged: {damage.why}"
    good = f"sound up to {damage.seq - 1}" if damage.seq > 1 else "not sound from its beginning"
    return f"{damage.stream} is {good}; at event {damage.seq}: {damage.why}"
