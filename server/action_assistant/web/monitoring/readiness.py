"""Checks whether each part of a process can do its work."""

import shutil
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Final, TypeAlias

import msgspec
from anyio import to_thread

from action_assistant.kit.shared_check import SharedCheck

#: The fault of each part of a process; None where it works.
Parts: TypeAlias = Mapping[str, str | None]
Check: TypeAlias = Callable[[], Awaitable[Parts]]

_ROOM: Final = 4 << 20  # bytes: what a log beside a database grows by, as a rule
_PATIENCE_S: Final = 1.0


#: Robots cannot be reached without it, but a Stop, a simulation and all that is stored can.
_OPTIONAL: Final = frozenset({"rclpy"})


class Readiness(msgspec.Struct, frozen=True):
    """The answer to the question whether the process can do its work, with what prevents it.

    `parts`: what each part lacks, null where it works. A missing `rclpy` is no problem here.
    """

    ready: bool
    problems: tuple[str, ...] = ()
    parts: Parts | msgspec.UnsetType = msgspec.UNSET

    @classmethod
    def of(cls, parts: Parts) -> "Readiness":
        """Return the readiness that follows from the faults of parts: a process is ready if only
        optional parts have one."""
        lacking = {name: why for name, why in parts.items() if name not in _OPTIONAL}
        problems = tuple(why for why in lacking.values() if why is not None)
        return cls(not problems, problems, parts)


class DiskCheck:
    """Checks whether the disk of a folder has room."""

    def __init__(self, folder: Path) -> None:
        async def free() -> int | str:
            try:
                return (await to_thread.run_sync(shutil.disk_usage, folder)).free
            except OSError as error:
                return f"The disk of the data folder cannot be looked at: {error.strerror}."

        self._free: SharedCheck[int | str] = SharedCheck(free, patience=_PATIENCE_S)

    async def problem(self) -> str | None:
        """Return a sentence about what is wrong with the disk; None if it is fine."""
        free = await self._free.answer()
        if free is None:
            return f"The disk of the data folder does not answer within {_PATIENCE_S:g} s."
        if isinstance(free, str):
            return free
        if free < _ROOM:
            return f"The disk of the data folder is full: {free >> 20} MiB are left."
        return None
