"""The public address: read strictly, and refused where it would surprise somebody."""

import ipaddress

import pytest

from action_assistant.errors import CannotStart
from action_assistant.public_url import LOOPBACK_PROXIES, PublicUrl, proxies, public_url
from action_assistant.settings import EVERYWHERE, check_host, reached


@pytest.mark.parametrize(
    ("text", "page", "origin"),
    [
        ("https://Robots.Example.org/temoto/", "https://robots.example.org/temoto", None),
        ("https://robots.example.org", "https://robots.example.org", None),
        ("https://robots.example.org:443/", "https://robots.example.org", None),
        ("https://r.example:8443/a/b/", "https://r.example:8443/a/b", "https://r.example:8443"),
        ("http://lab.local/temoto", "http://lab.local/temoto", "http://lab.local"),
        ("http://10.0.0.2/", "http://10.0.0.2", None),
        ("https://[fd00::2]/x/", "https://[fd00::2]/x", "https://[fd00::2]"),
    ],
)
def test_an_address_is_read_as_browsers_write_it(text: str, page: str, origin: str | None) -> None:
    found = public_url(text)
    assert found.page == page
    assert found.runner == f"{page}/runner"
    if origin is not None:
        assert found.origin == origin


@pytest.mark.parametrize(
    "text",
    [
        "robots.example.org",
        "ftp://robots.example.org/",
        "https:///temoto",
        "https://robots.example.org:port/",
        "https://me@robots.example.org/",
        "https://robots.example.org/?a=b",
        "https://robots.example.org/#t=x",
        "https://robots.example.org/a//b/",
        "https://robots.example.org/a b/",
        "https://robots.example.org/%61/",
        "https://robots.example.org/a/../b/",
        "https://robots.example.org/api/",
        "https://robots.example.org/runner/",
        "https://röboter.example.org/",
        "http://robots.example.org/",
        "http://8.8.8.8/",
    ],
)
def test_a_wrong_public_address_is_one_clear_sentence(text: str) -> None:
    with pytest.raises(CannotStart, match=r"public address"):
        public_url(text)


def test_only_the_address_itself_names_it() -> None:
    lab = public_url("https://lab.example:8443/x/")
    assert lab.is_named("lab.example", 8443)
    assert lab.is_named("lab.example", None)  # nginx's $host leaves the port out
    assert not lab.is_named("lab.example", 8000)  # straight to the editor
    assert not lab.is_named("other.example", 8443)


@pytest.mark.parametrize(
    ("text", "is_signed_for"),
    [
        ("https://robots.example.org/temoto/", True),
        ("https://lab.local", False),  # its own authority may end
        ("https://10.0.0.2/", False),
        ("https://[fd00::2]/", False),
        ("http://lab.local/", False),
    ],
)
def test_only_https_at_a_public_name_is_for_ever(text: str, is_signed_for: bool) -> None:
    assert public_url(text).is_signed_for is is_signed_for


def test_behind_a_public_address_the_proxies_of_this_computer_are_believed_unless_others_are() -> (
    None
):
    url = "https://robots.example.org/"
    assert reached(None, None, {}).proxies == ()
    assert reached(url, None, {}).proxies == LOOPBACK_PROXIES
    assert reached(url, "10.0.0.0/8", {}).proxies == (ipaddress.ip_network("10.0.0.0/8"),)
    by_environment = {
        "ACTION_ASSISTANT_PUBLIC_URL": url,
        "ACTION_ASSISTANT_TRUSTED_PROXIES": "10.1.2.3, fd00::/8",
    }
    found = reached(None, None, by_environment)
    assert found.public == PublicUrl("https", "robots.example.org", 443, "")
    assert [str(each) for each in found.proxies] == ["10.1.2.3/32", "fd00::/8"]
    assert reached("https://other.example/", None, by_environment).public != found.public
    with pytest.raises(CannotStart, match=r"10\.0\.0\.1/8"):
        proxies("10.0.0.1/8")


def test_listening_beyond_this_computer_needs_a_name_and_a_public_address_is_one() -> None:
    with pytest.raises(CannotStart, match="--public-url"):
        check_host(EVERYWHERE, ())
    check_host(EVERYWHERE, (), public=public_url("https://robots.example.org/"))
