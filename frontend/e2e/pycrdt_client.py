"""pycrdt's own client in a room: adds an action, prints the names it sees whenever they change.

Usage: pycrdt_client.py ROOM_URL TOKEN NAME. Ends when its input ends; exit code 1 if the room dropped it.
"""

import sys

import anyio
import httpx
from httpx_ws import aconnect_ws
from pycrdt import Doc, Map, Provider
from pycrdt.websocket.websocket import HttpxWebsocket

from action_assistant.editor.documents import document


async def main(address: str, token: str, name: str) -> None:
    """Join, add, and tell what is there."""
    doc: Doc = Doc()  # type: ignore[type-arg]
    headers = {"authorization": f"Bearer {token}"}
    async with (
        httpx.AsyncClient(trust_env=False) as client,
        aconnect_ws(address, client, headers=headers) as socket,
        Provider(doc, HttpxWebsocket(socket, address)),
        anyio.create_task_group() as tasks,
    ):
        tasks.start_soon(tell, doc)
        await anyio.sleep(0.5)
        doc.get("actions", type=Map)[document.new_aid()] = name
        await anyio.to_thread.run_sync(sys.stdin.read, abandon_on_cancel=True)
        tasks.cancel_scope.cancel()


async def tell(doc: Doc) -> None:  # type: ignore[type-arg]
    """One line for every change of the names."""
    before = None
    while True:
        names = " ".join(sorted(action.name for action in document.read(doc).actions))
        if names != before:
            print(names, flush=True)
            before = names
        await anyio.sleep(0.05)


anyio.run(main, *sys.argv[1:])
