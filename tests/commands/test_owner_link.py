"""`link`: the owner's way in, of a server that has proven to be ours."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from action_assistant.system.served_addresses import published
from commands.test_client import listening
from support.product import COMMAND, PROGRAM, TOKEN, Product, running

PUBLIC = "https://robots.example.org/temoto"


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A server that finds its settings in its environment, behind a proxy."""
    folder = tmp_path_factory.mktemp("link") / "data"
    with running(folder, "--public-url", f"{PUBLIC}/") as found:
        yield found


def command(
    environment: dict[str, str], *words: str, program: tuple[str, ...] = COMMAND
) -> subprocess.CompletedProcess[str]:
    """Run a command in an environment."""
    return subprocess.run(
        [*program, *words],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def test_the_link_signs_in_at_the_pages_address(product: Product) -> None:
    answer = product.cli("link")
    assert answer.stdout.splitlines() == [f"{PUBLIC}/#t={TOKEN}", f"{product.url}/#t={TOKEN}"]
    with httpx.Client(base_url=product.url, trust_env=False) as browser:
        signed = browser.post(
            "/api/session",
            json={"token": answer.stdout.rstrip().rpartition("#t=")[2]},
            headers={"origin": product.url},
        )
        assert signed.status_code in {200, 201, 204}, signed.text
        assert browser.get("/api/config").status_code == 200


def test_without_any_option_the_environment_says_which_server(product: Product) -> None:
    where = {
        "ACTION_ASSISTANT_PORT": str(product.port),
        "ACTION_ASSISTANT_DATA": str(product.data),
    }
    for program in (COMMAND, PROGRAM):
        answer = command(without_address(product) | where, "link", program=program)
        assert answer.stdout.splitlines()[-1] == f"{product.url}/#t={TOKEN}", answer.stderr


def without_address(product: Product) -> dict[str, str]:
    """Return an environment that names no server."""
    return {name: value for name, value in product.environment.items() if "URL" not in name}


@pytest.mark.parametrize("port", [False, True])
def test_the_folder_says_where_its_server_is(product: Product, *, port: bool) -> None:
    where = ["--port", str(product.port)] if port else ["--data", str(product.data)]
    answer = command(without_address(product), "link", *where)
    assert answer.stdout.splitlines()[-1] == f"{product.url}/#t={TOKEN}", answer.stderr


def test_the_folder_counts_before_the_environment(product: Product) -> None:
    with listening() as stranger:
        environment = product.environment | {"ACTION_ASSISTANT_URL": stranger.url}
        answer = command(environment, "stop", "--all", "--data", str(product.data))
    assert answer.returncode == 0, answer.stderr
    assert not stranger.heard


def test_a_stop_goes_to_no_other_server_than_that_of_the_folder(
    product: Product, tmp_path: Path
) -> None:
    """A copy has the token, too, so that the server proves itself to it."""
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("token", "runner.db"):
        (copy / name).write_bytes(TOKEN.encode())
    environment = without_address(product) | {"ACTION_ASSISTANT_PORT": str(product.port)}
    told = []
    for more in ((), ("--port", str(product.port + 1))):
        folder = product.data if more else copy
        answer = command(environment, "stop", "--all", "--data", str(folder), *more)
        assert (answer.returncode, answer.stdout) == (2, "")
        assert "NOTHING WAS STOPPED" in answer.stderr
        told.append(answer.stderr)
    assert f"No server serves {copy} now" in told[0]
    assert f"not served at port {product.port + 1} but at {product.url}" in told[1]


def test_an_address_says_for_which_network_it_is_and_holds_no_secret(
    product: Product, tmp_path: Path
) -> None:
    for process in ("editor", "runner"):
        file = product.data / f"{process}.address"
        assert file.stat().st_mode & 0o077 == 0
        assert TOKEN not in file.read_text()
    with published(tmp_path, "runner", product.runner_url):
        found = tmp_path / "runner.address"
        found.write_text(found.read_text().replace("/", "/1", 4))  # of another container
        answer = command(without_address(product), "stop", "--all", "--data", str(tmp_path))
    assert answer.returncode == 2
    assert "in a container with a network of its own" in answer.stderr
    assert not found.exists()


def test_a_stop_needs_no_editor_of_the_folder(product: Product, tmp_path: Path) -> None:
    with published(tmp_path, "runner", product.runner_url):
        stopped, listed = (
            command(without_address(product), *words, "--data", str(tmp_path))
            for words in (("stop", "--all"), ("graphs",))
        )
    assert (stopped.returncode, stopped.stdout) == (0, "nothing was running\n"), stopped.stderr
    assert listed.returncode == 2
    assert f"No editor serves {tmp_path} now" in listed.stderr


def test_no_link_leads_to_what_is_not_ours(product: Product) -> None:
    with listening() as stranger:
        answer = product.cli("link", "--url", stranger.url)
        assert (answer.returncode, answer.stdout) == (2, "")
        assert "does not know the token" in answer.stderr
    assert not stranger.learned


def test_no_link_leads_to_a_server_that_does_not_run(tmp_path: Path) -> None:
    stopped = Product(tmp_path / "data")
    answer = stopped.cli("link")
    assert (answer.returncode, answer.stdout) == (2, "")
    assert "Is it running?" in answer.stderr
