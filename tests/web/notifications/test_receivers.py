"""The file of receivers is read, and each fault in it is named with its place."""

from pathlib import Path

import pytest

from action_assistant.errors import CannotStart
from action_assistant.web.notifications.receivers import Mailbox, Webhook, receivers_of, target_of
from web.notifications.receiving import SECRET

CHAT = '[webhooks.chat]\nurl = "https://chat.example.org/hooks/abc"\nsecret_file = "{secret}"\n'
LAB = '[mail.lab]\nhost = "mail.example.org"\nfrom = "r@example.org"\nto = ["lab@example.org"]\n'


def _written(folder: Path, text: str) -> Path:
    secret = folder / "secret"
    secret.write_text(SECRET + "\n")
    file = folder / "notifications.toml"
    file.write_text(text.replace("{secret}", str(secret)))
    return file


def test_receivers_are_read(tmp_path: Path) -> None:
    chosen = 'kinds = ["run.ended"]\nallow = ["192.168.1.0/24"]\n'
    file = _written(tmp_path, CHAT + chosen + LAB)
    chat, lab = receivers_of(file)
    assert isinstance(chat, Webhook)
    assert isinstance(lab, Mailbox)
    assert (chat.shown, lab.shown, lab.port) == ("chat.example.org", "lab@example.org", 587)
    assert chat.kinds == {"run.ended"}
    assert receivers_of(file, ["mention"]) == (lab,)
    assert target_of(chat) != target_of(lab)
    assert receivers_of(None) == ()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[", "cannot be read"),
        ("[hooks.a]", "unknown table 'hooks'"),
        ("[webhooks.Chat]\n", "letters a-z"),
        ("[webhooks.chat]\nurl = 'ftp://a.org'\nsecret_file = '{secret}'", "chat.url: an address"),
        ("[webhooks.chat]\nurl = 'http://a.org'\nsecret_file = '{secret}'", "http is for hosts in"),
        ("[webhooks.chat]\nurl = 'https://u:p@a.org'\nsecret_file = '{secret}'", "chat.url"),
        ("[webhooks.chat]\nurl = 'https://a.org:99999'\nsecret_file = '{secret}'", "chat.url"),
        ("[webhooks.chat]\nurl = 'https://a.org'\n", "chat.secret_file: a text is needed"),
        (CHAT.replace("{secret}", "/none"), "cannot be read: No such file"),
        (CHAT + "kinds = ['x']", "'x' is no kind"),
        (CHAT + "allow = ['300.1.1.1']", "chat.allow"),
        (CHAT + "more = 1", "more: this field is unknown"),
        (CHAT + LAB.replace("mail.lab", "mail.chat"), "two receivers"),
        (LAB + "security = 'ssl'", "lab.security"),
        (LAB + "security = 'none'", "`none` is for hosts"),
        (LAB.replace("lab@example.org", "a@b.c>, <d@e.f"), "is no mail address"),
        (LAB.replace("lab@example.org", "a@b.c\\r\\nBcc: d@e.f"), "is no mail address"),
        (LAB + "port = 0", "lab.port"),
    ],
)
def test_a_fault_is_named_with_its_place(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(CannotStart, match=why):
        receivers_of(_written(tmp_path, text))


def test_a_short_secret_is_refused(tmp_path: Path) -> None:
    file = _written(tmp_path, CHAT)
    (tmp_path / "secret").write_text("whsec_c2hvcnQ=")
    with pytest.raises(CannotStart, match="24 to 64 random bytes"):
        receivers_of(file)
