"""The editor and the runner, as far as they run: whether they are ours, of one version and one token."""

import contextlib
import socket
import ssl
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Final
from urllib.parse import urlsplit

import anyio
import httpx
import msgspec
from cryptography import x509

from action_assistant import settings
from action_assistant.commands.doctor.database_checks import span
from action_assistant.commands.doctor.installation import Installation
from action_assistant.editor.people.identity_provider import IdentityProvider
from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal import lock
from action_assistant.settings import reached
from action_assistant.share_links import is_ours
from action_assistant.system.diagnostics import Diagnostic, fine, found
from action_assistant.version import VERSION
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.provider_settings import provider_of
from action_assistant.web.http.refusals import REFUSED_SOCKET
from action_assistant.web.network.certificate import Certificate

_PATIENCE_S: Final = 3.0


class ProcessAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of a process to `/healthz`.

    `base` includes the scheme. `version` is "" for other programs. `clock_s`: how many seconds its
    clock is ahead of ours; None if the answer has no date.
    """

    base: str
    status: int
    text: str = ""
    version: str = ""
    clock_s: float | None = None


class _Health(msgspec.Struct):
    """The fields of `/healthz` that identify the process."""

    version: str


def listens(host: str, port: int) -> bool:
    """Return whether a program accepts connections at this host and port."""
    try:
        socket.create_connection((_reached(host), port), _PATIENCE_S).close()
    except OSError:
        return False
    return True


def at_port(host: str, port: int) -> ProcessAnswer | None:
    """Return the answer of the web server at a host and port to `/healthz`, over http or https;
    None if there is no answer."""
    shown = _reached(host)
    shown = f"[{shown}]" if ":" in shown else shown
    for scheme in ("http", "https"):
        try:
            # Another check reports a wrong certificate; nothing secret is sent.
            with client(verify=False) as asking:
                return health(asking, f"{scheme}://{shown}:{port}")
        except httpx.HTTPError:
            continue
    return None


def client(verify: ssl.SSLContext | bool) -> httpx.Client:
    """Return an HTTP client without proxies and with a short timeout. `verify`: the certificates to
    accept, False for all."""
    return httpx.Client(verify=verify, timeout=_PATIENCE_S, trust_env=False)


def health(asking: httpx.Client, base: str) -> ProcessAnswer:
    """Ask a process for `/healthz` by the client `asking`, and return its answer. `base`: its URL.
    Raise httpx.HTTPError if there is no answer."""
    answer = asking.get(f"{base}/healthz")
    now = time.time()
    try:
        version = msgspec.json.decode(answer.content, type=_Health).version
    except (ValueError, RecursionError):
        version = ""
    return ProcessAnswer(
        base=base,
        status=answer.status_code,
        text=answer.text[:2000],
        version=version if answer.status_code == 200 else "",
        clock_s=_ahead(answer.headers.get("date", ""), now),
    )


def _ahead(date: str, now: float) -> float | None:
    try:
        return parsedate_to_datetime(date).timestamp() - now
    except ValueError:
        return None


def _reached(host: str) -> str:
    """Return the address by which a process that listens at `host` is reached from here: this
    computer's own, if it listens everywhere."""
    return "127.0.0.1" if host in {"*", "0.0.0.0", "::", "localhost"} else host


_HANDSHAKE_S: Final = 2.0
_EXPIRED: Final = 10  # X509_V_ERR_CERT_HAS_EXPIRED
_OTHER_NAME: Final = (62, 64)  # X509_V_ERR_HOSTNAME_MISMATCH, …IP_ADDRESS_MISMATCH


def certificate_fits(where: str, url: str, trust: ssl.SSLContext) -> Iterator[Diagnostic]:
    """Yield a fault if the certificate of the server at `url` is not valid for the host in `url`
    or not signed by a certificate in `trust`; nothing if no server answers. `where`: the address
    as the message names it."""
    host, port = urlsplit(url).hostname or "", urlsplit(url).port or 443
    try:
        _certificate_of(host, port, trust)
    except ssl.SSLCertVerificationError as error:
        yield _wrong(where, host, error, _shown_certificate(host, port))
    except OSError:  # reported by the check that connects there
        return


def _wrong(
    where: str, host: str, error: ssl.SSLCertVerificationError, shown: x509.Certificate | None
) -> Diagnostic:
    ends = shown.not_valid_after_utc if shown is not None else None
    if error.verify_code == _EXPIRED or (ends is not None and ends < datetime.now(UTC)):
        on = f" on {ends:%Y-%m-%d}" if ends is not None else ""
        return found(
            "certificate-expired",
            where,
            f"The certificate expired{on}: browsers refuse the page, or the clock here is ahead.",
            "Renew it (certbot, or the proxy's own way) and reload the proxy; that of --tls is renewed "
            "when the program starts again.",
        )
    if error.verify_code in _OTHER_NAME:
        return found(
            "certificate-names",
            where,
            f"The certificate is not for {host}, but for {_names(shown)}.",
            "Come by one of these names, or get a certificate for this one; that of --tls is for the "
            "names in ACTION_ASSISTANT_HOSTS, too, once the program starts again.",
        )
    return found(
        "certificate-untrusted",
        where,
        f"The certificate is not trusted here: {error.verify_message}.",
        "Let the proxy send the whole chain, or trust its authority (SSL_CERT_FILE); of --tls that is "
        "tls/ca.pem in the data folder.",
    )


def _names(shown: x509.Certificate | None) -> str:
    if shown is None:
        return "other names"
    try:
        held = shown.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return "no name at all"
    return ", ".join(str(each.value) for each in held) or "no name at all"


def _certificate_of(host: str, port: int, trust: ssl.SSLContext) -> bytes | None:
    """Make a TLS handshake with a server and return its certificate (DER), None if it has none.
    Raise OSError if it does not answer, ssl.SSLCertVerificationError if the certificate is not
    trusted."""
    with (
        socket.create_connection((host, port), _HANDSHAKE_S) as wire,
        trust.wrap_socket(wire, server_hostname=host) as secured,
    ):
        return secured.getpeercert(binary_form=True)


def _shown_certificate(host: str, port: int) -> x509.Certificate | None:
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    try:
        raw = _certificate_of(host, port, context)
        return x509.load_der_x509_certificate(raw) if raw else None
    except (OSError, ValueError):
        return None


_FILES: Final = "docs/proxy has the files for nginx and Caddy."
_REPLACED: Final = "wrong-host"
_UPGRADE: Final = {
    "connection": "Upgrade",
    "upgrade": "websocket",
    "sec-websocket-version": "13",
    "sec-websocket-key": "dGhlIHNhbXBsZSBub25jZQ==",
}


def proxy_leads_here(place: Installation) -> Iterator[Diagnostic]:
    """Check that the public address of `place` leads to both processes; yield the findings. No
    secret is sent."""
    try:
        public = reached(place.public_url, None).public
    except CannotStart as error:
        if place.public_url is not None:  # that of the environment is reported with the settings
            yield found("setting-wrong", "--public-url", str(error), "Correct it.")
        return
    if public is None:
        return
    trust = Certificate(place.data).trusting_too()
    if public.is_secure:
        problems = [*certificate_fits(public.page, public.origin, trust)]
        yield from problems
        if problems:
            return
    # The request has the page's origin, as one of a browser.
    headers = {**_UPGRADE, "origin": public.origin}
    with client(verify=trust) as asking:
        yield _shown(asking, "page", public.page, headers)
        yield _shown(asking, "runner", public.runner, headers)


def provider_answers(place: Installation) -> Iterator[Diagnostic]:
    """Check that the identity provider of the settings answers, and that others have an address at
    which they can sign in by it; yield the findings. No secret is sent."""
    try:
        known = provider_of(settings.oidc())
    except CannotStart as error:
        yield found(
            "setting-wrong", "ACTION_ASSISTANT_OIDC_…", str(error), "Correct or complete it."
        )
        return
    if known is None:
        return
    try:
        anyio.run(IdentityProvider(known).metadata)
    except Unavailable as error:
        yield found(
            "provider-unusable",
            known.issuer,
            f"Nobody can sign in by the provider: {error.detail}",
            "Look whether it runs and this computer reaches it; ACTION_ASSISTANT_OIDC_ISSUER has to "
            "be what its .well-known/openid-configuration calls `issuer`. Links go on working.",
        )
    else:
        yield fine(known.issuer, "The identity provider answers.")
    with contextlib.suppress(CannotStart):  # reported with the settings
        public = reached(place.public_url, None).public
        if settings.share() == "tls" or (public is not None and public.is_secure):
            return
        yield found(
            "provider-address",
            "ACTION_ASSISTANT_PUBLIC_URL",
            "An identity provider is set, and others reach the page by no https address: it is offered "
            "on this computer only.",
            "Serve the page by https (--public-url, or --share --tls), and register the address "
            "with /signed-in at its end as a redirect address at the provider.",
        )


def _shown(asking: httpx.Client, name: str, url: str, headers: dict[str, str]) -> Diagnostic:
    try:
        answer = health(asking, url)
        live = asking.get(f"{url}/api/live", headers=headers) if answer.version else None
    except httpx.HTTPError as error:
        return found(
            "proxy-unreachable",
            url,
            f"The public address does not answer: {error}.",
            f"Start the proxy, or correct the address or its name's entry. {_FILES}",
        )
    if live is None or _REPLACED in live.text:
        return _led_astray(name, url, answer.text if live is None else live.text, answer.status)
    if REFUSED_SOCKET[0].decode() not in live.headers:
        return found(
            "proxy-sockets",
            url,
            f"The proxy passes no WebSockets on to the {name}: nobody sees what others do, and Stop "
            "takes its slower way.",
            f"nginx: pass on the headers Upgrade and Connection, with HTTP/1.1. {_FILES}",
        )
    return fine(url, f"The public address leads to the {name}, and passes WebSockets on.")


def _led_astray(name: str, url: str, said: str, status: int) -> Diagnostic:
    if _REPLACED in said:
        return found(
            "proxy-host",
            url,
            f"The {name} is asked by a name that it does not have: the proxy replaces the Host header.",
            "nginx: `proxy_set_header Host $http_host`; Apache: `ProxyPreserveHost On`; and the server "
            f"needs the same --public-url. {_FILES}",
        )
    if name == "runner" and ("misrouted" in said or status == 401):
        return found(
            "proxy-path",
            url,
            "The proxy leads what is below runner/ to the editor: Stop would not reach the runner.",
            f"Lead it to the runner's port, before the rest goes to the editor's. {_FILES}",
        )
    return found(
        "proxy-target",
        url,
        f"What answers there is not the {name} (status {status}).",
        f"Start the {name}, and lead the address to its port, with the path as it is. {_FILES}",
    )


_CLOCK_S: Final = 5.0


def processes_fit(place: Installation) -> Iterator[Diagnostic]:
    """Check which programs listen at the ports of the editor and the runner, and which hold the
    databases of `place`. Yield the findings."""
    for name, port in place.processes:
        where = f"{place.host}:{port}"
        answer = at_port(place.host, port)
        if answer is not None and answer.version:
            problems = [*_ours(place, name, where, answer)]
            yield from problems
            if not problems:
                yield fine(where, f"The {name} runs there.")
        elif answer is not None or listens(place.host, port):
            yield found(
                "port-taken",
                where,
                f"Another program listens where the {name} should.",
                f"End it (`ss -ltnp 'sport = {port}'` names it), or serve on another --port.",
            )
        else:
            yield fine(where, f"The port is free; no {name} runs there.")
        yield from _held(place, name, runs=bool(answer and answer.version))


def _ours(
    place: Installation, name: str, where: str, answer: ProcessAnswer
) -> Iterator[Diagnostic]:
    if answer.version != VERSION:
        yield found(
            "version-differs",
            where,
            f"The {name} that runs is version {answer.version}, this program is {VERSION}: they may not "
            "understand each other.",
            "Once no robot moves, start it again, so that editor, runner and commands are of one installation.",
        )
    if answer.clock_s is not None and abs(answer.clock_s) > _CLOCK_S:
        yield clock_differs(name, where, answer.clock_s)
    if answer.base.startswith("https"):
        yield from certificate_fits(where, answer.base, Certificate(place.data).trusting_too())
    try:
        keys = Keys.known(place.data)
    except CannotStart:  # reported by the check of the token
        return
    if not is_ours(answer.base, keys, _any_certificate()):
        yield found(
            "token-differs",
            where,
            f"The {name} that runs does not know the token of {place.data}: it has another data "
            "folder, or another ACTION_ASSISTANT_TOKEN.",
            "Name its folder with --data; editor and runner need the same token.",
        )


def clock_differs(name: str, where: str, ahead_s: float) -> Diagnostic:
    """Return the finding that the clock of a process is `ahead_s` seconds ahead of (negative:
    behind) the clock of this computer. `name`, `where`: the process and its address."""
    way = "ahead of" if ahead_s > 0 else "behind"
    return found(
        "clock-differs",
        where,
        f"The clock of the {name} is {span(ahead_s)} {way} the one here: times of edits, runs and "
        "sessions do not fit together.",
        "Set both clocks by one source (`timedatectl set-ntp true`, chrony), here and there.",
    )


def _held(place: Installation, name: str, *, runs: bool) -> Iterator[Diagnostic]:
    """Yield a finding if the process that holds the lock of the database `name` is of another
    program, or is of this program but does not answer at its port. `runs`: this program answers
    there."""
    file = place.data / f"{name}.db"
    holder = lock.holder(file)
    if holder is None:
        return
    if not lock.is_program(holder.pid):
        yield found(
            "journal-held",
            f"{file}.lock",
            f"Process {holder}, which is not this program, holds the lock of the database: the {name} "
            "does not start.",
            f"Look what it is (`ps -p {holder.pid}`), and end it.",
        )
    elif not runs:
        yield found(
            "served-elsewhere",
            f"{file}.lock",
            f"Process {holder} of this program holds the database, and does not answer at port "
            f"{dict(place.processes)[name]}: it serves at another one, or hangs.",
            f"Name its port with --port; if it hangs, see that no robot moves, end it (`kill {holder.pid}`) "
            "and start anew.",
        )


def _any_certificate() -> ssl.SSLContext:
    """Return a TLS context that accepts every certificate, for a challenge that sends no secret."""
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context
