"""A certificate of our own for `--tls`: a small authority in the data folder signs it.

`tls/` holds `ca.pem`, which people may trust in their browsers, and what only this user may read:
`ca-key.pem`, `server.pem`, `server-key.pem`. The authority can sign for this computer's names and for
private networks alone, so that whoever steals its key cannot stand in for the rest of the web.
"""

import contextlib
import ipaddress
import platform
import ssl
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final, TypeAlias

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from action_assistant.errors import CannotStart
from action_assistant.private_files import opener, replace_file
from action_assistant.system import posix

FOLDER: Final = "tls"
_AUTHORITY_DAYS: Final = 3650
_SERVER_DAYS: Final = 397  # browsers accept no more
_RENEWED_BEFORE: Final = timedelta(days=30)
_LOCAL: Final = ("localhost", "local")
_PRIVATE: Final = tuple(
    ipaddress.ip_network(text)
    for text in (
        "127.0.0.0/8", "10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "169.254.0.0/16",
        "::1/128", "fc00::/7",
    )
)  # fmt: skip

Signer: TypeAlias = tuple[x509.Certificate, ec.EllipticCurvePrivateKey]


class Certificate:
    """The authority and the certificate of this server, as files in a data folder. Several
    processes may call it at once."""

    def __init__(self, data: Path) -> None:
        self._folder = data / FOLDER
        self.authority: Final = self._folder / "ca.pem"
        self.chain: Final = self._folder / "server.pem"
        self.key: Final = self._folder / "server-key.pem"

    def renew(self, names: Sequence[str], *, now: datetime | None = None) -> bool:
        """Issue a certificate for these host names unless there is one that is valid for a while;
        return True if a new one was issued. `now`: the present time, for tests. Raise CannotStart
        if the folder cannot be written."""
        now = now or datetime.now(UTC)
        try:
            with self._alone():
                if self._serves(names, now):
                    return False
                self._issue(names, now)
                return True
        except OSError as error:
            raise CannotStart(
                f"Cannot keep a certificate in {self._folder}: {error.strerror}."
            ) from error

    def trusting(self) -> ssl.SSLContext:
        """Return a TLS context that trusts this server's own authority only, for clients on this
        computer."""
        return ssl.create_default_context(cafile=str(self.authority))

    def trusting_too(self) -> ssl.SSLContext:
        """Return a TLS context that trusts the system's authorities, and this server's own if it
        exists."""
        context = ssl.create_default_context()
        if self.authority.exists():
            context.load_verify_locations(cafile=str(self.authority))
        return context

    def fingerprint(self) -> str:
        """Return the SHA-256 fingerprint of the authority as browsers show it."""
        found = x509.load_pem_x509_certificate(self.authority.read_bytes())
        return found.fingerprint(hashes.SHA256()).hex(":").upper()

    @contextlib.contextmanager
    def _alone(self) -> Iterator[None]:
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with open(self._folder / "lock", "w", opener=opener) as lock:
            posix.wait_for_lock(lock.fileno())
            yield

    def _serves(self, names: Sequence[str], now: datetime) -> bool:
        try:
            found = x509.load_pem_x509_certificate(self.chain.read_bytes())
            authority = x509.load_pem_x509_certificate(self.authority.read_bytes())
            own = self.key.exists()
        except (OSError, ValueError):
            return False
        known = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        return (
            own
            and found.issuer == authority.subject
            and found.not_valid_after_utc - now > _RENEWED_BEFORE
            and all(_name_of(name) in known for name in names)
        )

    def _issue(self, names: Sequence[str], now: datetime) -> None:
        authority, signing = self._authority(names, now)
        key = ec.generate_private_key(ec.SECP256R1())
        certificate = (
            _begun(authority.subject, now, _SERVER_DAYS)
            .subject_name(_called("Action Assistant"))
            .public_key(key.public_key())
            .add_extension(x509.SubjectAlternativeName([_name_of(n) for n in names]), False)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), True)
            .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_public_key(signing.public_key()), False
            )
            .sign(signing, hashes.SHA256())
        )
        _write(self.key, _pem(key))
        _write(self.chain, _text(certificate) + _text(authority))

    def _authority(self, names: Sequence[str], now: datetime) -> Signer:
        """Return the existing authority (its certificate and key) if it may sign for these host
        names for long enough after `now`, else a new one."""
        kept = self._folder / "ca-key.pem"
        try:
            found = x509.load_pem_x509_certificate(self.authority.read_bytes())
            key = serialization.load_pem_private_key(kept.read_bytes(), None)
        except (OSError, ValueError):
            return self._new_authority(names, now)
        lasts = found.not_valid_after_utc - now > timedelta(days=_SERVER_DAYS)
        if (
            not lasts
            or not _permits(found, names)
            or not isinstance(key, ec.EllipticCurvePrivateKey)
        ):
            return self._new_authority(names, now)
        return found, key

    def _new_authority(self, names: Sequence[str], now: datetime) -> Signer:
        key = ec.generate_private_key(ec.SECP256R1())
        name = _called(f"Action Assistant on {platform.node()} ({now:%Y-%m-%d %H:%M:%S})")
        certificate = (
            _begun(name, now, _AUTHORITY_DAYS)
            .subject_name(name)
            .public_key(key.public_key())
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), True)
            .add_extension(x509.NameConstraints(_permitted(names), None), True)
            .add_extension(_SIGNS, True)
            .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), False)
            .sign(key, hashes.SHA256())
        )
        _write(self._folder / "ca-key.pem", _pem(key))
        _write(self.authority, _text(certificate))
        return certificate, key


_SIGNS: Final = x509.KeyUsage(
    digital_signature=False,
    content_commitment=False,
    key_encipherment=False,
    data_encipherment=False,
    key_agreement=False,
    key_cert_sign=True,
    crl_sign=True,
    encipher_only=False,
    decipher_only=False,
)


def _begun(issuer: x509.Name, now: datetime, days: int) -> x509.CertificateBuilder:
    """Return the builder of a certificate that `issuer` signs, valid from an hour before `now`,
    since the clock of a tablet may be late, until `days` after it."""
    return (
        x509.CertificateBuilder()
        .issuer_name(issuer)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(hours=1))
        .not_valid_after(now + timedelta(days=days))
    )


def _called(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name[:64])])


def _name_of(name: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(name))
    except ValueError:
        return x509.DNSName(name)


def _permitted(names: Sequence[str]) -> list[x509.GeneralName]:
    found: list[x509.GeneralName] = [x509.DNSName(name) for name in _LOCAL]
    found += [x509.IPAddress(network) for network in _PRIVATE]
    for name in names:
        if not _is_permitted(name, found):
            own = _name_of(name)
            if isinstance(own, x509.IPAddress):
                own = x509.IPAddress(ipaddress.ip_network(name))
            found.append(own)
    return found


def _permits(authority: x509.Certificate, names: Sequence[str]) -> bool:
    limits = authority.extensions.get_extension_for_class(x509.NameConstraints).value
    permitted = list(limits.permitted_subtrees or ())
    return all(_is_permitted(name, permitted) for name in names)


def _is_permitted(name: str, permitted: Sequence[x509.GeneralName]) -> bool:
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        domains = [each.value for each in permitted if isinstance(each, x509.DNSName)]
        return any(name == domain or name.endswith(f".{domain}") for domain in domains)
    networks = [each.value for each in permitted if isinstance(each, x509.IPAddress)]
    return any(
        address in network
        for network in networks
        if isinstance(network, ipaddress.IPv4Network | ipaddress.IPv6Network)
    )


def _text(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def _write(path: Path, content: bytes) -> None:
    """Replace the content of a file, which only this user can read from its creation on."""
    replace_file(path, content, part=path.with_suffix(".new"))
