"""`people`: persons, their links, and links of groups; `link`: the owner's own."""

import argparse
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final, get_args

import msgspec

from action_assistant.commands.answers import decoded
from action_assistant.commands.client import (
    Server,
    add_server,
    command,
    names_server,
    print_json,
    running,
)
from action_assistant.errors import CannotStart, Refused, RequestRefused
from action_assistant.private_files import own_folder
from action_assistant.safe_text import one_line
from action_assistant.web.auth.confirmations import Confirmations
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.people_files import PeopleFiles, PersonFile
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Role
from action_assistant.web.auth.session_files import SessionFiles

if TYPE_CHECKING:  # slow to load, and most calls do not need it
    from action_assistant.editor.api.members import Members
    from action_assistant.editor.people.invitations import Invitation
    from action_assistant.editor.people.members import Member


def _add_people(people: argparse.ArgumentParser) -> None:
    people.description = "Persons with a role, and links that let people in without the token."
    people.epilog = "example: action-assistant people invite editor --label Mari"
    words = people.add_subparsers(dest="word", required=True, metavar="WORD")

    listed = command(words, "list", "the links, and who came in by them", "")
    listed.add_argument("--json", action="store_true", help="as JSON, for programs")
    listed.set_defaults(handler=_list)

    invite = command(words, "invite", "make a link", "operator --label 'lab tablet'")
    invite.add_argument("role", choices=["viewer", "editor", "operator"])
    invite.add_argument("--label", default="", help="whom it is for")
    invite.set_defaults(handler=_invite)

    _add_persons(words)

    revoke = command(
        words,
        "revoke",
        "end a link and every session that came in by it, also while no server answers",
        "trlQRDEFzMaX",
    )
    revoke.add_argument("id", metavar="ID", help="as `people list` shows it")
    revoke.set_defaults(handler=_revoke)


def _add_persons(words: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    link = command(
        words,
        "link",
        "make a link for one person, who is added if they are new; it works once, also while no "
        "server answers",
        "Mari --role owner",
    )
    link.add_argument("name", metavar="NAME")
    link.add_argument("--role", choices=get_args(Role), help="of a new person; default: operator")
    link.add_argument(
        "--hours", type=float, default=72.0, help="until it expires; default: %(default)s"
    )
    link.set_defaults(handler=_link_person)

    end = command(
        words,
        "end",
        "end a person: all devices, links and tokens, also while no server answers",
        "Mari",
    )
    end.add_argument("person", metavar="NAME_OR_ID")
    end.set_defaults(handler=_end_person)

    confirm = command(
        words,
        "confirm",
        "confirm that all open sessions of a person are theirs, where they have lost every passkey "
        "and other device; on the computer with the data folder",
        "Mari",
    )
    confirm.add_argument("person", metavar="NAME_OR_ID")
    confirm.set_defaults(handler=_confirm_person)


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

        sharing, people = decoded(answer, Sharing), _members(server).people
        if not people and not sharing.invitations:
            print("nobody was invited yet: `people invite ROLE` makes a link", file=sys.stderr)
        for person in people:
            _show_person(person, sharing.origins)
        for each in sharing.invitations:
            _show(sharing.origins, each)
    return 0


def _members(server: Server) -> "Members":
    from action_assistant.editor.api.members import Members

    return decoded(server.editor("GET", "/api/members"), Members)


def _show_person(person: "Member", origins: Sequence[str]) -> None:
    over = "  (ended)" if person.ended_at is not None else ""
    print(one_line(f"{person.id}  {person.role}  {person.name}{over}"))
    for link in person.links:
        if link.used_at is not None:
            place = f" at {link.address}" if link.address else ""
            used = msgspec.to_builtins(link.used_at)
            print(one_line(f"    came in by a link with {link.browser}{place}, {used}"))
        elif link.path is not None:
            _show_path(link.path, origins)


def _show_path(path: str, origins: Sequence[str]) -> None:
    for origin in origins[:1] or [""]:
        print(f"    {origin}{path}")


def _link_person(options: argparse.Namespace) -> int:
    """Make a link for one person by the server, or in the data folder where no server answers."""
    try:
        with running(options) as server:
            return _link_at(server, options)
    except CannotStart:
        data = options.data.resolve()
        if names_server(options) or not data.is_dir():
            raise
        from action_assistant.editor.people.offline_links import make_offline

        keys = Keys.known(data)
        try:
            path = make_offline(own_folder(data), keys, options.name, options.role, options.hours)
        except OSError as error:
            raise CannotStart(f"Cannot write to {data}: {error.strerror}.") from error
        print("No server answers. When it runs, this path behind its address lets one browser in:")
        _show_path(path, ())
        return 0


def _link_at(server: Server, options: argparse.Namespace) -> int:
    from action_assistant.editor.people.members import Member

    members = _members(server)
    known = [each for each in members.people if _is_meant(each, options.name)]
    if not known:
        wanted = {
            "name": options.name,
            "role": options.role or "operator",
            "hours": options.hours,
        }
        answer = server.editor("POST", "/api/members", json=wanted)
    else:
        path = f"/api/members/{known[0].id}"
        if options.role is not None and options.role != known[0].role:
            server.editor("PATCH", path, json={"role": options.role})
        answer = server.editor("POST", f"{path}/link", json={"hours": options.hours})
    person = decoded(answer, Member)
    _tell_runner(server, person)
    print(one_line(f"{person.id}  {person.role}  {person.name}"))
    for link in person.links:
        if link.path is not None:
            _show_path(link.path, members.origins or (server.url,))
    return 0


def _tell_runner(server: Server, person: "Member") -> None:
    """Store a person at a runner that may have a data folder of its own."""
    until = None if person.until is None else person.until.timestamp()
    file = PersonFile(person.id, person.name, person.role, person.groups, until)
    try:
        server.runners.tell("PUT", f"/api/members/{person.id}", json=msgspec.to_builtins(file))
    except (RequestRefused, CannotStart) as error:
        raise RequestRefused(
            f"Done, but a runner with a data folder of its own has not been told: {error}"
        ) from error


def _is_meant(person: "Member", text: str) -> bool:
    same = person.name.casefold() == text.casefold()
    return person.ended_at is None and (person.id == text or same)


def _end_person(options: argparse.Namespace) -> int:
    """End a person on both processes, or in the data folder where no server answers."""
    try:
        with running(options) as server:
            meant = [each for each in _members(server).people if _is_meant(each, options.person)]
            if len(meant) != 1:
                raise RequestRefused(f"No person is called {options.person!r}.")
            person = meant[0].id
            server.editor("POST", f"/api/members/{person}/end")
            try:
                server.runners.tell("POST", "/api/revocations", json={"person": person})
            except (RequestRefused, CannotStart) as error:
                raise RequestRefused(
                    f"Ended, but a runner with a data folder of its own has not been told: {error}"
                ) from error
    except CannotStart as silent:
        data = options.data.resolve()
        if names_server(options) or not data.is_dir():
            raise
        from action_assistant.editor.people.offline_links import known_offline

        persons = known_offline(data, options.person)
        if not persons:
            raise CannotStart(
                f"{silent} No person in {data} is called {options.person!r}."
            ) from silent
        marks = Revocations(own_folder(data))
        failed = [why for each in persons if (why := _refusal(marks.end_person, each.id))]
        if failed:
            raise CannotStart(f"{silent} {failed[0]}") from silent
        print(
            one_line(
                f"No server answers; {options.person} is ended in the data folder, for good. A runner "
                "with a data folder of its own has not been told."
            )
        )
        return 0
    print(one_line(f"{options.person} is out on all devices, for good."))
    return 0


def _refusal(act: Callable[[str], object], id_: str) -> str:
    """Return why an act about this id was refused; "" if it was done."""
    try:
        act(id_)
    except Refused as error:
        return error.detail
    return ""


def _confirm_person(options: argparse.Namespace) -> int:
    """Confirm all open sessions of a person in the data folder, which each process reads by itself."""
    data = options.data.resolve()
    confirmations = Confirmations(data, Keys.known(data))
    wanted = options.person.casefold()
    people = PeopleFiles(data)
    found = []
    for each in SessionFiles(data, Revocations(data)).every():
        file = people.get(each.person.id)
        name = each.person.name if file is None else file.name
        if wanted in {name.casefold(), each.person.id.casefold()}:
            found.append(each)
    if not found:
        raise CannotStart(f"No session in {data} is of a person called {options.person!r}.")
    if len({each.person.id for each in found}) > 1:
        ids = ", ".join(sorted({each.person.id for each in found}))
        raise CannotStart(f"Several people are called {options.person!r}: say which one: {ids}.")
    confirm = partial(confirmations.confirm, how="command", is_stored=True)
    outcomes = [(each, _refusal(confirm, each.id)) for each in found]
    for each, why in outcomes:
        said = f"  NOT CONFIRMED: {why}" if why else ""
        since = f"{each.since:%Y-%m-%d}"
        print(one_line(f"{each.id}  {each.browser or 'a browser'}, since {since}{said}"))
    number = sum(bool(why) for _, why in outcomes)
    if number:
        raise RequestRefused(
            f"{options.person} is not confirmed on {number} of {len(found)} devices: "
            f"{next(why for _, why in outcomes if why)}"
        )
    print(one_line(f"{options.person} is confirmed on these devices now."))
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
        if names_server(options) or not data.is_dir():
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
        server.runners.tell("POST", "/api/revocations", json={"invitation": invitation})
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
