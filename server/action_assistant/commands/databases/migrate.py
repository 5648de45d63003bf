"""`migrate`: brings the databases of a data folder to this version, and back to a copy from before."""

import argparse
import logging
import sys
from functools import partial
from pathlib import Path
from typing import Final

from action_assistant import paths, settings
from action_assistant.journal.database import Branch, no_copy


def _add_migrate(migrate: argparse.ArgumentParser) -> None:
    migrate.epilog = "example: action-assistant migrate --data ./data"
    migrate.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="default: %(default)s"
    )
    migrate.add_argument(
        "--database",
        metavar="URL",
        default=settings.database(),
        help="of the editor; default: the one that was served last",
    )
    ways = migrate.add_mutually_exclusive_group()
    ways.add_argument(
        "--back",
        nargs="*",
        type=Path,
        metavar="COPY",
        help="put back copies that were made before tables changed, for the version that made them; "
        "without a name, list them",
    )
    ways.add_argument(
        "--without-copy",
        action="store_true",
        help="make none before tables change: where there is no room, and a backup is elsewhere",
    )
    migrate.set_defaults(handler=_migrate)


COMMANDS: Final = {"migrate": _add_migrate}


def _migrate(options: argparse.Namespace) -> int:
    from action_assistant.commands.databases import going_back

    if options.back is not None:
        return going_back.go_back(options.data.resolve(), options.database, options.back)
    return _forward(options)


def _forward(options: argparse.Namespace) -> int:
    from action_assistant.editor.log import database_location
    from action_assistant.journal.copies.before_upgrade import FOLDER, keep_copy
    from action_assistant.journal.databases import database_of
    from action_assistant.journal.migrate import revisions_of

    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(message)s")
    data = settings.data_folder(options.data.resolve())
    before = no_copy if options.without_copy else partial(keep_copy, data / FOLDER)
    database = options.database or database_location.of(data)
    urls: dict[Branch, str] = {"editor": database, "runner": f"sqlite:///{data / 'runner.db'}"}
    for branch, url in urls.items():
        place = database_of(url)
        try:
            # Take the lock of the only writer: a running older version would write to the new tables.
            place.open(branch, before).close()
        finally:
            place.disown()
        name = place.name.removeprefix("The database ")
        print(f"{branch}: {name} is at revision {revisions_of(branch)[-1]}")
    return 0
