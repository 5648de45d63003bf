"""Finds the words of runs of earlier versions, some at a time: nothing waits for it."""

import logging
from collections.abc import Callable
from functools import partial
from typing import Any, Final, Protocol

import anyio
from sqlalchemy import Connection

from action_assistant.errors import Refused
from action_assistant.runner.runs.word_index import index_some

log: Final = logging.getLogger(__name__)

_AT_ONCE: Final = 10  # runs, while which the journal writes nothing else: milliseconds
_BREATH_S: Final = 0.05
_PATIENCE_S: Final = 5.0  # where nothing can be stored at the moment


class Deriving(Protocol):
    """A journal whose tables may be added to."""

    async def derive(self, work: Callable[[Connection], Any]) -> Any:
        """Write to tables that follow from events. Raises Unavailable."""
        ...


async def index_words(journal: Deriving) -> None:
    """Until the words of all runs are in the index. Raises nothing: the process goes on without."""
    while True:
        try:
            if not await journal.derive(partial(index_some, most=_AT_ONCE)):
                return
        except Refused as refused:
            log.warning("the words of runs cannot be stored now: %s", refused.detail)
            await anyio.sleep(_PATIENCE_S)
        except Exception:  # such as a damaged row; a search reads what is not in the index
            log.exception("the words of earlier runs are not looked for until the next start")
            return
        await anyio.sleep(_BREATH_S)
