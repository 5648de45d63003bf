"""A way to a server that can be cut, also in the middle of a commit."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from typing import Final, Literal, TypeAlias

#: The treatment of bytes that a client sends: pass them on; drop them and cut; pass them on and cut
#: before any answer; pass them on and fall silent, as a network does that loses everything.
Verdict: TypeAlias = Literal["pass", "cut before", "cut after", "silence"]
Judge: TypeAlias = Callable[[bytes], Verdict]

_CHUNK: Final = 1 << 16


class Proxy:
    """Forwards connections on loopback."""

    def __init__(self, target: int, judge: Judge) -> None:
        self._target = target
        self._judge = judge
        self._tasks: set[asyncio.Task[None]] = set()
        self.port = 0
        self.cuts = 0
        self.delay = 0.0  # seconds until a new connection reaches the server

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """One connection, until either side ends it."""
        await asyncio.sleep(self.delay)
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self._target)
        except OSError:
            writer.close()
            return
        answers = asyncio.create_task(_pump(there, writer))
        self._tasks.add(answers)
        answers.add_done_callback(self._tasks.discard)
        try:
            await self._judged(reader, back, answers)
        except OSError:
            pass  # one side is gone; so is the other, now
        finally:
            answers.cancel()
            writer.transport.abort()
            back.transport.abort()

    async def _judged(
        self,
        reader: asyncio.StreamReader,
        back: asyncio.StreamWriter,
        answers: "asyncio.Task[None]",
    ) -> None:
        while data := await reader.read(_CHUNK):
            verdict = self._judge(data)
            self.cuts += verdict != "pass"
            if verdict == "cut before":
                return
            if verdict != "pass":
                answers.cancel()
            back.write(data)
            await back.drain()
            if verdict == "cut after":
                await asyncio.sleep(0.02)  # the server has read it by then
                return
            if verdict == "silence":
                await asyncio.sleep(3600)


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await reader.read(_CHUNK):
            writer.write(data)
            await writer.drain()
    writer.close()


@contextlib.asynccontextmanager
async def proxy(target: int, judge: Judge) -> AsyncIterator[Proxy]:
    """A proxy in front of a port."""
    one = Proxy(target, judge)
    served: set[asyncio.Task[None]] = set()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        served.add(task)
        with contextlib.suppress(asyncio.CancelledError):
            await one.serve(reader, writer)
        served.discard(task)

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    one.port = server.sockets[0].getsockname()[1]
    try:
        yield one
    finally:
        server.close()
        for task in list(served):
            task.cancel()
        await asyncio.gather(*served, return_exceptions=True)
