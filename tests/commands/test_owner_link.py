"""`link`: the owner's way in, of a server that has proven to be ours."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from commands.test_client import listening
from support.product import COMMAND, PROGRAM, TOKEN, Product, running

PUBLIC = "https://robots.example.org/temoto"


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A server that finds its settings in its environment, behind a proxy."""
    folder = tmp_path_factory.mktemp("link") / "data"
    with running(folder, "--public-url", f"{PUBLIC}/") as found:
        yield found


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
    environment = {
        name: value for name, value in product.environment.items() if "URL" not in name
    } | {"ACTION_ASSISTANT_PORT": str(product.port), "ACTION_ASSISTANT_DATA": str(product.data)}
    for program in (COMMAND, PROGRAM):
        answer = subprocess.run(
            [*program, "link"], env=environment, capture_output=True, text=True, check=False
        )
        assert answer.stdout.splitlines()[-1] == f"{product.url}/#t={TOKEN}", answer.stderr


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
