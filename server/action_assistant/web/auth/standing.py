"""The present standing of a session or token: what its person is now, and whether it has expired.

A cookie says what was true at sign-in. Files of persons and the last use of sessions say what is true
now, to either process by itself.
"""

import time
from collections.abc import Callable, Mapping
from typing import Final

import msgspec

from action_assistant.web.auth.confirmations import Confirmations
from action_assistant.web.auth.identity import Credential, Identity, Standing, Token, View
from action_assistant.web.auth.keys import Person, Session
from action_assistant.web.auth.passkeys import PasskeyFiles
from action_assistant.web.auth.people_files import PeopleFiles
from action_assistant.web.auth.roles import OWNER, Role, rank
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.auth.session_limits import DEFAULTS, Limit


class Standings:
    """Knows the present standing of all credentials. `confirmations`, `passkeys`: None where nobody is
    asked to confirm anything."""

    def __init__(
        self,
        people: PeopleFiles,
        browsers: SessionFiles,
        limits: Mapping[Role, Limit] = DEFAULTS,
        clock: Callable[[], float] = time.time,
        confirmations: Confirmations | None = None,
        passkeys: PasskeyFiles | None = None,
    ) -> None:
        self.passkeys: Final = passkeys
        self.confirmations: Final = confirmations
        self.people: Final = people
        self.browsers: Final = browsers
        self.limits: Final = limits
        self._clock = clock
        browsers.judge_by(lambda session: self.of(session).expired)

    def of(self, credential: Credential) -> Standing:
        """Return the present standing of a session, token or link."""
        if isinstance(credential, View):
            return Standing(credential.person, frozenset(), credential.expired)
        person = credential.person
        now = self._clock()
        over = credential.expired
        file = None
        if isinstance(credential, Token) or credential.personal:
            file = self.people.get(person.id)
        if file is not None:
            # A token has at most the role that it was made with.
            capped = isinstance(credential, Token) and rank(file.role) > rank(person.role)
            name = file.name or person.name  # nothing is known of one who cannot be read
            person = Person(person.id, name, person.role if capped else file.role)
            over = over or (file.until is not None and now >= file.until)
        if not over and not isinstance(credential, Token):
            over = self._is_idle(credential, person.role, now)
        confirmed_at = None
        if self.confirmations is not None and not isinstance(credential, Token):
            confirmed_at = self.confirmations.confirmed_at(credential.id)
        ask_again = 0
        if self.passkeys is not None and person.role == OWNER and not isinstance(credential, Token):
            ask_again = self.passkeys.of(person.id).ask_again
        groups = frozenset(file.groups if file is not None else ())
        return Standing(person, groups, over, confirmed_at, ask_again)

    def known(self, identity: Identity) -> Identity | None:
        """Return an identity without a credential with the role and groups that its person has now; as it
        is, if nothing is known of the person; None if the time of the person is over."""
        file = self.people.get(identity.person.id)
        if file is None:
            return identity
        if file.until is not None and self._clock() >= file.until:
            return None
        person = Person(file.id, file.name or identity.person.name, file.role)
        return msgspec.structs.replace(identity, person=person, groups=frozenset(file.groups))

    def _is_idle(self, session: Session, role: Role, now: float) -> bool:
        """Return whether a session was not used for too long. One whose last use is unknown, as on
        a full disk, is not idle."""
        if session.begun == 0.0:
            return False
        used = self.browsers.used_at(session)
        return used is not None and now - used >= self.limits[role].idle
