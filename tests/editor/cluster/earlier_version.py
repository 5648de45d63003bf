"""The command of the version before 0020: its rooms know no turns, and it neither writes nor clears who is in a graph.
`earlier_version.py WORDS …`."""

import contextlib
import sys
from collections.abc import AsyncIterator

from sqlalchemy import text

from action_assistant.cli import main
from action_assistant.editor.api import entrance
from action_assistant.editor.cluster import same_folder, shared_owners
from action_assistant.editor.rooms.others_people import OthersPeople


@contextlib.asynccontextmanager
async def _unmarked(*_: object) -> AsyncIterator[None]:
    yield


async def _exchange(_: OthersPeople) -> None:
    return


if __name__ == "__main__":
    show = shared_owners._SHOW.text
    assert ", people = NULL" in show
    for module, name, value in (
        (entrance, "TURN", ""),
        (shared_owners, "_SHOW", text(show.replace(", people = NULL", ""))),
        (same_folder, "in_one_folder", _unmarked),
        (OthersPeople, "exchange", _exchange),
    ):
        setattr(module, name, value)
    sys.exit(main())
