"""`people`: who may come in by which link, and the end of a link; `link`: the owner's own."""

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import msgspec

from action_assistant.commands.client import (
    Server,
    add_server,
    command,
    decoded,
    print_json,
    running,
)
from action_assistant.errors import CannotStart, Refused, RequestRefused
from action_assistant.private_files import own_folder
from action_assistant.safe_text import one_line
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.revocations import Revocations

if TYPE_CHECKING:  # slow to load, and most calls do not need it
    from action_assistant.editor.people.invitations import Invitation


def _add_people(people: argparse.ArgumentParser) -> None:
    people.description = "Links that let people in without the token, each with a role."
    people.epilog = "example: action-assistant people invite editor --label Mari"
    words = people.add_subparsers(dest="word", required=True, metavar="WORD")

    listed = command(words, "list", "the links, and who came in by them", "")
    listed.add_argument("--json", action="store_true", help="as JSON, for programs")
    listed.set_defaults(handler=_list)

    invite = command(words, "invite", "make a link", "operator --label 'lab tablet'")
    invite.add_argument("role", choices=["viewer", "editor", "operator"])
    invite.add_argument("--label", default="", help="whom it is for")
    invite.set_defaults(handler=_invite)

    revoke = command(
        words,
        "revoke",
        "end a link and every session that came in by it, also while no server answers",
        "trlQRDEFzMaX",
    )
    revoke.add_argument("id", metavar="ID", help="as `people list` shows it")
    revoke.set_defaults(handler=_revoke)


def _add_link(link: argparse.ArgumentParser) -> None:
    add_server(link, "--data ./data")
    link.set_defaults(handler=_link)


COMMANDS: Final = {"people": _add_people, "link": _add_link}


def _list(options: argparse.Namespace) -> int:
    with running(options) as server:
        answer = server.editor("GET", "/api/invitations")
        if options.json:
            print_json(answer.json())
            return 0
        from action_assistant.editor.api.invitations import Sharing

        sharing = decoded(answer, Sharing)
        for each in sharing.invitations:
            _show(sharing.origins, each)
    return 0


def _invite(options: argparse.Namespace) -> int:
    from action_assistant.editor.api.invitations import Sharing
    from action_assistant.editor.people.invitations import Invitation

    with running(options) as server:
        wanted = {"role": options.role, "label": options.label}
        made = decoded(server.editor("POST", "/api/invitations", json=wanted), Invitation)
        _show(decoded(server.editor("GET", "/api/invitations"), Sharing).origins, made)
    return 0


def _show(origins: Sequence[str], invitation: "Invitation") -> None:
    label = f"  {invitation.label}" if invitation.label else ""
    over = "  (revoked)" if invitation.revoked_at is not None else ""
    print(one_line(f"{invitation.id}  {invitation.role}{label}{over}"))
    for guest in invitation.guests:
        who = one_line(guest.person.name) or "somebody without a name"
        print(f"    {who}, since {msgspec.to_builtins(guest.at)}")
    if invitation.path is not None:
        for origin in origins[:1]:
            print(f"    {origin}{invitation.path}")


def _revoke(options: argparse.Namespace) -> int:
    """Revoke a link on both processes, or in the data folder if no server answers. Return the exit
    code."""
    try:
        with running(options) as server:
            return _revoke_at(server, options.id)
    except CannotStart as silent:
        data = options.data.resolve()
        if options.url or not data.is_dir():
            raise
        try:
            Revocations(own_folder(data)).add(options.id)
        except (ValueError, Refused) as error:
            raise CannotStart(f"{silent} {error}") from error
        print("No server answers; the link is marked as revoked in the data folder.")
        return 0


def _revoke_at(server: Server, invitation: str) -> int:
    answer = server.editor("POST", f"/api/invitations/{invitation}/revoke")
    try:
        server.runner("POST", "/api/revocations", json={"invitation": invitation})
    except (RequestRefused, CannotStart) as error:
        raise RequestRefused(
            f"Revoked, but a runner with a data folder of its own has not been told: {error}"
        ) from error
    from action_assistant.editor.people.invitations import Invitation

    gone = decoded(answer, Invitation)
    print(f"{gone.id}  {gone.role} is revoked; {len(gone.guests)} came in by it.")
    if gone.unrecorded:
        print("The log could not take that up yet; the server tries again until it can.")
    return 0


def _link(options: argparse.Namespace) -> int:
    """Print links by which the owner signs in, the likeliest address first. The link holds the
    token, so only addresses of a server that has proven to know it are printed."""
    with running(options) as server:
        answer = server.editor("GET", "/api/invitations")
    from action_assistant.editor.api.invitations import Sharing

    sharing = decoded(answer, Sharing)
    public = sharing.origins[:1] if sharing.proxied else ()
    token = Keys.known(options.data.resolve()).token
    for address in dict.fromkeys([*public, server.url]):
        print(f"{address}/#t={token}")
    return 0
