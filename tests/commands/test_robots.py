"""`robots`: registered, listed and forgotten from the command line, as on the page."""

import json
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from action_assistant.cli import main
from support.product import TOKEN, Product, running


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """One server for the module."""
    with running(tmp_path_factory.mktemp("robots") / "data") as found:
        yield found


@pytest.fixture(autouse=True)
def there(product: Product, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command line finds this server."""
    monkeypatch.setenv("ACTION_ASSISTANT_URL", product.url)
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", TOKEN)


def known(product: Product) -> dict[str, dict[str, object]]:
    headers = {"authorization": f"Bearer {TOKEN}"}
    answer = httpx.get(f"{product.runner_url}/api/robots", headers=headers, trust_env=False)
    return {each["name"]: each for each in answer.json() if not each["simulated"]}


def test_a_robot_is_registered_listed_and_forgotten(
    product: Product, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    profile = tmp_path / "david.json"
    profile.write_text('{"commit": "5819055"}')
    words = ["robots", "add", "David", "--domain", "181", "--get-service", "lab/get"]
    assert main([*words, "--profile", str(profile), "--second-person"]) == 0
    assert capfd.readouterr().out.startswith("David  domain 181  ")
    david = known(product)["David"]
    assert (david["domain"], david["get_service"]) == (181, "lab/get")
    assert david["profile"] == {"commit": "5819055", "second_person": True}
    assert main(["robots", "list"]) == 0
    listed = capfd.readouterr().out.splitlines()
    assert [line.split()[0] for line in listed] == ["simulator", "David"]
    assert main(["robots", "list", "--json"]) == 0
    assert json.loads(capfd.readouterr().out)[1]["name"] == "David"
    assert main(["robots", "remove", "David"]) == 0
    assert capfd.readouterr().out == "David is not registered any more\n"
    assert known(product) == {}
    assert main(["robots", "remove", "David"]) == 1
    assert "David" in capfd.readouterr().err


def test_a_robot_that_is_registered_is_changed_only_when_that_is_said(
    product: Product, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["robots", "add", "Carol", "--domain", "182", "--second-person"]) == 0
    assert main(["robots", "add", "Carol", "--domain", "183"]) == 1
    assert "registered already" in capfd.readouterr().err
    assert known(product)["Carol"]["domain"] == 182
    assert main(["robots", "add", "Carol", "--domain", "183", "--replace"]) == 0
    assert (known(product)["Carol"]["domain"], known(product)["Carol"]["profile"]) == (183, {})
    assert main(["robots", "remove", "Carol"]) == 0


@pytest.mark.parametrize(
    ("words", "code", "why"),
    [
        (["add", "Eve", "--domain", "233"], 1, "/domain"),
        (["add", "a/b"], 1, "/name"),
        (["add", ""], 1, ""),
        (["add", "simulator"], 1, "simulator"),
        (["add", "Eve", "--profile", "/nowhere.json"], 2, "Cannot read the profile"),
        (["remove", "../runs"], 1, "../runs"),
        (["remove", "simulator"], 1, "simulator"),
    ],
)
def test_a_wrong_registration_or_removal_is_refused_in_one_sentence(
    product: Product, words: list[str], code: int, why: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["robots", *words]) == code
    told = capfd.readouterr().err
    assert why in told
    assert "Traceback" not in told
    assert known(product) == {}


def test_a_name_is_printed_as_one_line(product: Product, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["robots", "add", "line\nfeed"]) in {0, 1}
    told = capfd.readouterr()
    assert len((told.out + told.err).splitlines()) == 1
    main(["robots", "remove", "line\nfeed"])
