"""The setting of several runners for one page."""

import pytest

from action_assistant.errors import CannotStart
from action_assistant.public_url import public_url
from action_assistant.settings import Site
from action_assistant.sites import sites
from action_assistant.web.network.addresses import Addresses

A = "Hall A=http://127.0.0.1:8001"
B = "Hall B=http://127.0.0.1:8011"
PUBLIC = public_url("https://robots.example.org/temoto/")


def test_two_runners_have_their_names_and_urls() -> None:
    found = sites([A, f" {B}/ "], page_port=8000, runner_port=8001)
    assert found == (
        Site("Hall A", "http://127.0.0.1:8001"),
        Site("Hall B", "http://127.0.0.1:8011"),
    )


@pytest.mark.parametrize("given", [[], [""]])
def test_one_runner_needs_no_name(given: list[str]) -> None:
    assert sites(given, page_port=8000, runner_port=8001) == ()


@pytest.mark.parametrize("only", [A, B])
def test_a_lone_name_is_refused_since_a_runner_may_have_been_forgotten(only: str) -> None:
    with pytest.raises(CannotStart, match="is the only runner that is named"):
        sites([only, ""], page_port=8000, runner_port=8001)


@pytest.mark.parametrize(
    ("second", "why"),
    [
        ("http://127.0.0.1:8011", "is written NAME=URL"),
        ("=http://127.0.0.1:8011", "is written NAME=URL"),
        ("Hall\x1b B=http://127.0.0.1:8011", "is written NAME=URL"),
        (f"{'B' * 41}=http://127.0.0.1:8011", "at most 40 letters"),
        ("HALL A=http://127.0.0.1:8011", "Two runners are called 'HALL A'"),
        ("Hall B=http://127.0.0.1:8001", "'Hall A' and 'Hall B' have one URL"),
        ("Hall B=http://localhost:8001", "'Hall A' and 'Hall B' have one URL"),
        (
            "Hall B=http://127.0.0.1:8000",
            "is at http://127.0.0.1:8000, the port of the editor itself",
        ),
        ("Hall B=http://localhost:8000", "the port of the editor itself"),
        ("Hall B=http://[::1]:8001", "'Hall A' and 'Hall B' have one URL"),
        ("Hall B=127.0.0.1:8011", "The URL of the runner 'Hall B' is none"),
        ("Hall B=ftp://127.0.0.1:8011", "The URL of the runner 'Hall B' is none"),
        ("Hall B=http://me@127.0.0.1:8011", "The URL of the runner 'Hall B' is none"),
        ("Hall B=http://127.0.0.1:8011?x=1", "The URL of the runner 'Hall B' is none"),
        ("Hall B=http://127.0.0.1:x", "cannot be read"),
        ("Hall B=http://127.0.0.1", "a port of this computer"),
        ("Hall B=http://hall-b.lan:8001", "put a proxy before all"),
    ],
)
def test_a_runner_that_the_page_could_not_use_is_refused_by_its_name(second: str, why: str) -> None:
    with pytest.raises(CannotStart, match=why):
        sites([A, second], page_port=8000, runner_port=8001)


def test_the_first_runner_is_the_one_beside_the_editor() -> None:
    with pytest.raises(CannotStart, match=r"beside the editor, at http://127\.0\.0\.1:8001"):
        sites([B, A], page_port=8000, runner_port=8001)


def test_runners_behind_a_proxy_are_below_the_public_address() -> None:
    first = "Hall A=https://robots.example.org/temoto/runner"
    found = sites(
        [first, "Hall B=https://robots.example.org/temoto/hall-b/"],
        page_port=8000,
        runner_port=8001,
        public=PUBLIC,
    )
    assert found[1] == Site("Hall B", "https://robots.example.org/temoto/hall-b")
    for elsewhere in ("https://hall-b.example.org", "https://robots.example.org/temotob", B[7:]):
        with pytest.raises(CannotStart, match="outside of the public address"):
            sites([first, f"Hall B={elsewhere}"], page_port=8000, runner_port=8001, public=PUBLIC)


def test_several_runners_are_refused_with_certificates_of_their_own() -> None:
    with pytest.raises(CannotStart, match="put a proxy before them"):
        sites([A, B], page_port=8000, runner_port=8001, tls=True)


def test_a_port_of_this_computer_is_named_as_the_page_was_asked_for() -> None:
    addresses = Addresses(host="*", page_port=8000, hosts=["lab.lan"])
    found = addresses.sites_at("lab.lan:8000", sites([A, B], page_port=8000, runner_port=8001))
    assert [each.url for each in found] == ["http://lab.lan:8001", "http://lab.lan:8011"]
