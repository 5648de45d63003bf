"""Messages reach real receivers, signed and encrypted, and go nowhere that the setting does not name."""

import ipaddress
import socket
import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from action_assistant.kit.clock import utc_us
from action_assistant.web.notifications import delivery
from action_assistant.web.notifications.delivery import NotDelivered, deliver, is_public
from web.notifications.receiving import (
    failed_run,
    http_receiver,
    mail_server,
    mailbox,
    tls,
    webhook,
)

PAGE = "https://robots.example.org/temoto"


def test_a_receiver_can_verify_a_webhook() -> None:
    with http_receiver() as receiver:
        message = failed_run(utc_us())
        deliver(webhook(f"http://127.0.0.1:{receiver.port}/in?room=1"), message, PAGE)
    ((headers, body),) = receiver.got
    assert headers["webhook-id"] == "run/r1:7:chat"
    assert body["type"] == "run.ended"
    assert body["text"] == "Run 12 of Fetch on David has failed: an error."
    assert body["data"]["link"] == f"{PAGE}/runs/r1"
    assert body["data"]["late"] is False


def test_a_webhook_is_encrypted_and_the_certificate_is_checked(tmp_path: Path) -> None:
    context, authority = tls(tmp_path, "localhost")
    with http_receiver(context) as receiver:
        url = f"https://localhost:{receiver.port}/"
        deliver(webhook(url, ca=authority), failed_run(utc_us()), "")
        assert len(receiver.got) == 1
        with pytest.raises(NotDelivered, match="certificate is not trusted"):
            deliver(webhook(url), failed_run(utc_us()), "")
        other = f"https://127.0.0.1:{receiver.port}/"
        with pytest.raises(NotDelivered, match="certificate is not trusted"):
            deliver(webhook(other, ca=authority), failed_run(utc_us()), "")


@pytest.mark.parametrize(
    ("status", "why", "is_final"),
    [
        (410, "wants no messages", True),
        (302, "redirects are not followed", False),
        (500, "It answered 500", False),
    ],
)
def test_other_answers_are_failures(status: int, why: str, is_final: bool) -> None:
    with http_receiver() as receiver, http_receiver() as elsewhere:
        receiver.answers = [status]
        receiver.headers = {"location": f"http://127.0.0.1:{elsewhere.port}/"}
        with pytest.raises(NotDelivered, match=why) as failed:
            deliver(webhook(f"http://127.0.0.1:{receiver.port}/"), failed_run(utc_us()), "")
    assert failed.value.is_final is is_final
    assert not elsewhere.got


def test_a_receiver_that_never_comes_to_an_end_is_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delivery, "TRY_S", 0.3)
    with http_receiver() as receiver:
        receiver.drips = True
        with pytest.raises(NotDelivered):
            deliver(webhook(f"http://127.0.0.1:{receiver.port}/"), failed_run(utc_us()), "")
    assert len(receiver.got) == 1


@pytest.mark.parametrize(
    "address",
    [
        "127.0.0.1", "10.1.2.3", "192.168.0.7", "169.254.169.254", "100.64.0.1", "0.0.0.0", "224.0.0.1",
        "::1", "fe80::1", "fd00::7", "::ffff:10.0.0.1", "2002:0a00:0001::1", "64:ff9b::a00:1", "2001:0:1::1",
    ],
)  # fmt: skip
def test_private_addresses_are_reached_only_where_they_are_listed(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    found = [(family, socket.SOCK_STREAM, 6, "", (address, 443))]
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: found)
    with pytest.raises(NotDelivered, match="does not allow"):
        deliver(webhook("https://example.org/", allow=()), failed_run(), "")


def test_the_internet_is_public_and_plain_http_is_for_listed_hosts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert is_public(ipaddress.ip_address("93.184.216.34"))
    assert is_public(ipaddress.ip_address("2606:2800:220:1::1"))
    found = [(socket.AF_INET, socket.SOCK_STREAM, 6, "", ("93.184.216.34", 80))]
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: found)
    with pytest.raises(NotDelivered, match="does not allow"):
        deliver(webhook("http://example.org/"), failed_run(), "")


def test_the_host_is_resolved_once_and_that_address_is_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with http_receiver() as receiver:
        asked: list[str] = []

        def resolve(host: str, port: int, **_: object) -> object:
            asked.append(host)
            address = "127.0.0.1" if len(asked) == 1 else "192.0.2.1"
            return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, port))]

        real = socket.getaddrinfo
        monkeypatch.setattr(
            socket,
            "getaddrinfo",
            lambda host, *args, **kw: (
                resolve(host, *args[:1]) if host == "hook.test" else real(host, *args, **kw)
            ),
        )
        deliver(webhook(f"http://hook.test:{receiver.port}/"), failed_run(utc_us()), "")
    assert asked == ["hook.test"]
    assert receiver.got[0][0]["host"] == f"hook.test:{receiver.port}"


def test_a_mail_arrives_encrypted(tmp_path: Path) -> None:
    context, authority = tls(tmp_path, "localhost")
    with mail_server(context) as (mails, port):
        deliver(mailbox(port, ca=authority), failed_run(why="It fell.\nBcc: all@example.org"), PAGE)
        (mail,) = mails.read
        assert mail["to"] == "lab@example.org, night@example.org"
        assert mail["bcc"] is None
        assert mail["auto-submitted"] == "auto-generated"
        assert f"{PAGE}/runs/r1" in mail.get_content()
        with pytest.raises(NotDelivered, match="certificate is not trusted"):
            deliver(mailbox(port), failed_run(), "")
        mails.refuses = "552 too much"
        with pytest.raises(NotDelivered, match="It answered 552"):
            deliver(mailbox(port, ca=authority), failed_run(), "")


def test_a_mail_server_that_does_not_encrypt_gets_nothing() -> None:
    with mail_server() as (mails, port):
        with pytest.raises(NotDelivered, match="does not encrypt"):
            deliver(mailbox(port), failed_run(), "")
        deliver(mailbox(port, security="none"), failed_run(), "")
    assert len(mails.raw) == 1


# The server does not see that its socket is encrypted from the first byte.
@pytest.mark.filterwarnings("ignore:Requiring AUTH while not requiring TLS:UserWarning")
@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize("password", ["s3cret word", "schlüssel-€"])
def test_a_mail_server_gets_user_and_password_encrypted_alone(
    tmp_path: Path, password: str, implicit: bool
) -> None:
    context, ca = tls(tmp_path, "localhost")
    known = {"security": "tls" if implicit else "starttls", "ca": ca, "user": "robots"}
    with mail_server(context, passwords={"robots": password}, implicit=implicit) as (mails, port):
        deliver(mailbox(port, **known, password=password), failed_run(), "")
        assert mails.signed_in == [("PLAIN", True)]
        with pytest.raises(NotDelivered, match=r"does not take the user or the password \(535\)"):
            deliver(mailbox(port, **known, password=password + "?"), failed_run(), "")
        mails.no_check = "454 4.7.0 Temporary authentication failure"
        with pytest.raises(NotDelivered, match=r"cannot check the password now \(454\)"):
            deliver(mailbox(port, **known, password=password), failed_run(), "")
        with pytest.raises(NotDelivered, match="certificate is not trusted"):
            deliver(mailbox(port, **(known | {"ca": None}), password=password), failed_run(), "")
        with pytest.raises(NotDelivered, match="It answered 530"):
            deliver(mailbox(port, **(known | {"user": ""})), failed_run(), "")
    assert len(mails.raw) == 1


def test_a_password_goes_to_no_server_that_does_not_encrypt() -> None:
    with mail_server() as (mails, port), pytest.raises(NotDelivered, match="does not encrypt"):
        deliver(mailbox(port, user="robots", password="schlüssel"), failed_run(), "")
    assert not mails.raw


def test_nobody_there_is_a_failure_with_a_reason() -> None:
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        port = closed.getsockname()[1]
    begun = time.monotonic()
    with pytest.raises(NotDelivered, match="cannot be reached: Connection refused"):
        deliver(webhook(f"http://127.0.0.1:{port}/secret-path"), failed_run(), "")
    assert time.monotonic() - begun < delivery.TRY_S
    assert webhook("https://example.org/secret-path").shown == "example.org"
    assert urlsplit("https://example.org/secret-path").path not in webhook("https://a.org/").shown
