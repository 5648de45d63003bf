"""Three editors behind the proxy: what a killed one had open is changed at another one."""

import ssl
from functools import partial
from pathlib import Path

import httpx

from containers.engine import podman
from containers.stack import client, running
from support.waiting import until

ORIGIN = "https://192.168.77.1"


def test_a_killed_editor_of_three_is_not_missed(tmp_path: Path) -> None:
    settings = {"ACTION_ASSISTANT_PUBLIC_URL": f"{ORIGIN}/", "EDITORS": "3"}
    with running("several", "db", "editor", "proxy", settings=settings) as stack:
        addresses = set()
        for number in (1, 2, 3):
            stack.wait("editor", number)
            name = stack.container("editor", number)
            addresses.add(podman("exec", name, "cat", "/tmp/editor-address").strip())
        assert addresses == {"127.0.0.1", "127.0.0.2", "127.0.0.3"}
        authority = tmp_path / "authority.pem"
        root = "/data/caddy/pki/authorities/local/root.crt"
        authority.write_text(podman("exec", stack.container("proxy"), "cat", root))
        trust = ssl.create_default_context(cafile=str(authority))
        with client(ORIGIN, stack.token(), verify=trust) as page:
            graphs = [
                page.post("/api/graphs", json={"name": f"g{n}"}).json()["id"] for n in range(6)
            ]
            podman("kill", "--signal", "KILL", stack.container("editor", 2))
            for graph in graphs:
                until("a graph is renamed", partial(_changed, page, graph), 60)
            listed = {each["id"]: each["name"] for each in page.get("/api/graphs").json()}
            assert {listed[graph] for graph in graphs} == {"changed"}


def _changed(page: httpx.Client, graph: str) -> bool:
    return page.patch(f"/api/graphs/{graph}", json={"name": "changed"}).is_success
