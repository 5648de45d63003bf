"""Routes that run `action-assistant doctor` and return what it finds, for owners."""

import os
import subprocess
import sys
from typing import Final

import anyio
import msgspec
from litestar import get
from litestar.types import ControllerRouterHandler

from action_assistant.errors import Refused, Unavailable
from action_assistant.kit.shared_check import SharedCheck
from action_assistant.settings import EditorSettings
from action_assistant.system.diagnostics import Diagnostic
from action_assistant.web.auth.access import Needs

_PATIENCE_S: Final = 90.0  # it looks for robots, too
_FRESH_S: Final = 5.0
_NICE: Final = 5  # as of workers for which a person waits


class LastExamination(msgspec.Struct, frozen=True):
    """The last result of `doctor`. `age_s`: seconds since it was made, and `took_s`: seconds that it took; both
    are null, as `found` is, before the first one. `running_s`: seconds for which the next examination has been
    running, null where none is. `failed`: why the last attempt failed; the result before it stays."""

    found: tuple[Diagnostic, ...] | None
    age_s: float | None
    took_s: float | None
    running_s: float | None
    failed: str | None


def routes(settings: EditorSettings) -> list[ControllerRouterHandler]:
    """Return the routes that run the command `doctor`, once at a time for all requests, and that
    give its last result."""

    examination = SharedCheck(lambda: _examined(settings), patience=_PATIENCE_S, fresh=_FRESH_S)

    @get(
        "/api/doctor",
        guards=[Needs("restore")],
        summary="What `doctor` finds wrong with this installation; takes some seconds",
        operation_id="examine",
    )
    async def doctor() -> list[Diagnostic]:
        found = await examination.answer()
        if found is None:
            raise Unavailable(f"It has not looked at everything within {_PATIENCE_S:g} s.")
        return found

    @get(
        "/api/doctor/last",
        guards=[Needs("restore")],
        summary="What `doctor` found last, and how long ago, at once; with `look` it begins to look again",
        operation_id="getLastExamination",
    )
    async def last_examination(look: bool = False) -> LastExamination:
        if look:
            examination.begin()
        last, failure = examination.last, examination.failure
        found, age, took = (None, None, None) if last is None else last
        return LastExamination(
            found=None if found is None else tuple(found),
            age_s=age,
            took_s=took,
            running_s=examination.under_way,
            failed=None if failure is None else _told(failure),
        )

    return [doctor, last_examination]


def _told(failure: BaseException) -> str:
    return (
        failure.detail
        if isinstance(failure, Refused)
        else "The last look failed; the log says why."
    )


async def _examined(settings: EditorSettings) -> list[Diagnostic]:
    """Run the command `doctor` in a process of low priority, since it loads much and may hang, wait
    for it, and return what it found. Raise Unavailable if its output cannot be read."""
    command = [sys.executable, "-m", "action_assistant", "doctor", "--json"]
    command += ["--data", str(settings.data), "--port", str(settings.port)]
    async with await anyio.open_process(
        command, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        os.setpriority(os.PRIO_PROCESS, process.pid, _NICE)
        assert process.stdout is not None
        said = b"".join([piece async for piece in process.stdout])
        code = await process.wait()
    try:
        return msgspec.json.decode(said, type=list[Diagnostic])
    except msgspec.DecodeError as error:
        raise Unavailable(f"`action-assistant doctor` ended with exit code {code}.") from error
