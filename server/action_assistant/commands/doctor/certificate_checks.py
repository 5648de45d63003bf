"""The certificate that is shown at an address: in time, and for the name by which one comes."""

import socket
import ssl
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Final
from urllib.parse import urlsplit

from cryptography import x509

from action_assistant.system.diagnostics import Diagnostic, found

_PATIENCE_S: Final = 2.0
_EXPIRED: Final = 10  # X509_V_ERR_CERT_HAS_EXPIRED
_OTHER_NAME: Final = (62, 64)  # X509_V_ERR_HOSTNAME_MISMATCH, …IP_ADDRESS_MISMATCH


def certificate_fits(where: str, url: str, trust: ssl.SSLContext) -> Iterator[Diagnostic]:
    """What is wrong with the certificate at an address; nothing where nobody answers."""
    host, port = urlsplit(url).hostname or "", urlsplit(url).port or 443
    try:
        _shake(host, port, trust)
    except ssl.SSLCertVerificationError as error:
        yield _wrong(where, host, error, _shown(host, port))
    except OSError:  # told by whoever asks there
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


def _shake(host: str, port: int, trust: ssl.SSLContext) -> bytes | None:
    """The certificate that is shown. Raises OSError, ssl.SSLCertVerificationError."""
    with (
        socket.create_connection((host, port), _PATIENCE_S) as wire,
        trust.wrap_socket(wire, server_hostname=host) as secured,
    ):
        return secured.getpeercert(binary_form=True)


def _shown(host: str, port: int) -> x509.Certificate | None:
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    try:
        raw = _shake(host, port, context)
        return x509.load_der_x509_certificate(raw) if raw else None
    except (OSError, ValueError):
        return None
