"""People who work on a graph while somebody measures their own page: they move and describe actions.

Run as `python editors.py JSON`, with a `Plan` of the load generator; ends by itself.
"""

import asyncio
import json
import random
import sys
import time
from typing import Any, Final

from load import Clients
from pycrdt import Doc, Map
from yjs_socket import Person, Plan

DESCRIBED: Final = 0.2  # of all edits; the others are moves


class Editor:
    """One of them, with a document of their own."""

    def __init__(self, person: Person) -> None:
        self.person = person
        self.doc: Doc[Any] = Doc(client_id=random.randrange(1 << 21, 1 << 31))
        self.actions = self.doc.get("actions", type=Map)
        self.positions = self.doc.get("positions", type=Map)
        self.doc.apply_update(person.synced.result())
        self.keys = [key for key in self.actions if "|" not in key]
        self._subscription = self.doc.observe(lambda event: person.edit(bytes(event.update)))

    def work(self) -> None:
        """One edit."""
        key = random.choice(self.keys)
        if random.random() < DESCRIBED:
            self.actions[f"{key}|description"] = f"said at {time.time():.2f}"
        else:
            x, y = self.positions.get(key, [0.0, 0.0])
            self.positions[key] = [x + random.randint(-20, 20), y + random.randint(-20, 20)]


async def main(plan: Plan) -> None:
    clients = Clients(plan)
    await clients.come(plan.people)
    editors = [Editor(person) for person in clients.people]
    until = time.monotonic() + plan.seconds
    while time.monotonic() < until:
        random.choice(editors).work()
        await asyncio.sleep(1 / (plan.rate * plan.people))
    clients.leave()


if __name__ == "__main__":
    asyncio.run(main(Plan(**json.loads(sys.argv[1]))))
