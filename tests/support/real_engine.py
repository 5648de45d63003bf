"""The real engine behind the whole product: what its actions' code did, as that wrote it down itself.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from support.product import TOKEN, Product

PROGRAM = Path(os.environ.get("UMRF_SHARED", "/nonexistent")) / "engine-lab" / "engine"
IS_HERE = bool(os.environ.get("ENGINE_LAB")) and PROGRAM.exists()
needs_engine = pytest.mark.skipif(
    not IS_HERE, reason="the real engine is not here (ENGINE_LAB, UMRF_SHARED)"
)


def browser(product: Product, name: str, *, is_named: bool = False) -> httpx.Client:
    """Return an HTTP client of the runner with the session of a person: by the link of the owner, or
    with `is_named` of an operator by a personal link."""
    body = {"token": TOKEN, "name": name}
    if is_named:
        with product.editor() as owner:
            made = owner.post("/api/members", json={"name": name, "role": "operator"}).json()
        body = {"invitation": made["links"][0]["path"].removeprefix("/#i=")}
    answer = httpx.post(
        f"{product.url}/api/session", json=body, headers={"origin": product.url}, trust_env=False
    )
    assert answer.is_success, answer.text
    cookie = answer.headers["set-cookie"].partition(";")[0]
    headers = {"cookie": cookie, "origin": product.url}
    return httpx.Client(base_url=product.runner_url, headers=headers, trust_env=False, timeout=30)


@contextmanager
def real_engine(
    folder: Path, domain: int, name: str = "David"
) -> Iterator[Callable[[], list[str]]]:
    """Yield what the code of the engine's action has done so far, as it wrote it down itself."""
    truth = folder / f"truth-{name}"
    command = [sys.executable, str(PROGRAM), name, str(domain), "--truth", str(truth)]

    def events() -> list[str]:
        lines = truth.read_text().splitlines() if truth.exists() else []
        return [line.split()[2] for line in lines]

    with (folder / f"engine-{name}.log").open("w") as log:
        engine = subprocess.Popen(command, stdout=log, stderr=log)
    try:
        yield events
    finally:
        engine.kill()
        engine.wait()


def answers(runner: httpx.Client, name: str) -> bool:
    """Return whether the robot of that name answers the runner."""
    robots = {each["name"]: each for each in runner.get("/api/robots").json()}
    return robots.get(name, {}).get("state") == "answering"
