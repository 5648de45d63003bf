"""The command `robots`: which robots are registered, registering one, forgetting one; who may start there,
who holds its baton, and who has put it out of service."""

import argparse
from datetime import datetime, timedelta
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote

import msgspec

from action_assistant.commands.answers import decoded
from action_assistant.commands.client import Server, command, print_json, running
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.runner.links.hardware_stop import HardwareStop
from action_assistant.runner.links.health import HealthCheck
from action_assistant.safe_text import one_line
from action_assistant.umrf.facts import SECOND_PERSON

if TYPE_CHECKING:  # slow to load, and most calls do not need it
    from action_assistant.runner.robots.registration import Robot


def _add_robots(robots: argparse.ArgumentParser) -> None:
    robots.epilog = "example: action-assistant robots add David --domain 7"
    words = robots.add_subparsers(dest="word", required=True, metavar="WORD")

    listed = command(words, "list", "the simulator and each robot, and whether it answers", "")
    listed.add_argument("--json", action="store_true", help="as JSON, for programs")
    listed.set_defaults(handler=_list)

    add = command(words, "add", "register a robot", "David --domain 7")
    add.add_argument("name", metavar="NAME", help="the engine's --actor-name, letter for letter")
    add.add_argument(
        "--domain", type=int, default=0, metavar="N", help="its ROS_DOMAIN_ID; default: 0"
    )
    add.add_argument(
        "--rmw", default="", metavar="RMW", help="its middleware; default: that of the runner"
    )
    add.add_argument(
        "--get-service",
        metavar="PATH",
        help="the path of its get, where that is not umrf_graph_get",
    )
    add.add_argument(
        "--profile",
        metavar="FILE",
        help="a JSON file that says what is true of its engine (docs/robots.md)",
    )
    add.add_argument(
        "--second-person",
        action="store_true",
        help="it takes only what a second person has said yes to",
    )
    add.add_argument(
        "--led",
        action="store_true",
        help="the runner may lead it step by step, in runs that several robots share",
    )
    add.add_argument(
        "--site",
        metavar="NAME",
        help="of several runners, the one that leads it; default: the first",
    )
    add.add_argument(
        "--replace", action="store_true", help="register it anew, if it is registered already"
    )
    add.set_defaults(handler=_add)

    remove = command(words, "remove", "forget a robot; its runs stay in the history", "David")
    remove.add_argument("name", metavar="NAME")
    remove.add_argument("--site", metavar="NAME", help="where several sites have one of this name")
    remove.set_defaults(handler=_remove)
    _add_rights(words)
    _add_drill(words)
    _add_baton(words)
    _add_service(words)


def _add_rights(words: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    rights = command(
        words,
        "rights",
        "say who may start on a robot, and what is asked before; without options, show it",
        "David --operator gY2kq=2027-01-31 --baton on",
    )
    rights.add_argument("name", metavar="NAME")
    rights.add_argument("--all", action="store_true", help="every operator may start there")
    rights.add_argument(
        "--operator",
        action="append",
        metavar="ID[=DATE]",
        help="only people and groups with these ids may, until "
        "the end of that day if it is given; again for each",
    )
    rights.add_argument(
        "--baton", choices=["on", "off"], help="only the person who holds its baton may start there"
    )
    rights.add_argument(
        "--watched",
        choices=["on", "off"],
        help="whoever starts there confirms that they watch the robot",
    )
    rights.add_argument(
        "--drill-days",
        type=int,
        metavar="N",
        help="its last Stop drill passed, and is so many days old at most; 0: nobody asks for one",
    )
    rights.add_argument(
        "--released-only",
        choices=["on", "off"],
        help="only versions start there that an owner has released",
    )
    rights.add_argument(
        "--ask-again",
        type=int,
        metavar="MINUTES",
        help="whoever starts there confirms again after so many minutes that it is they, by another "
        "device or a passkey; 0 for never. Programs cannot start there then",
    )
    rights.add_argument(
        "--limit",
        action="append",
        metavar="[ACTION.]PARAMETER=[LEAST]..[MOST]",
        help="numbers that are sent there as this input are in this range, as torque=..60; again for "
        "each, and all others are dropped",
    )
    rights.add_argument("--no-limits", action="store_true", help="drop all limits")
    rights.add_argument(
        "--stop-topic",
        metavar="TOPIC",
        help="its hardware stop is reported there: information, no safety function; '' for nowhere",
    )
    rights.add_argument(
        "--stop-kind",
        choices=["bool", "diagnostics"],
        help="a std_msgs/Bool (the default), or a diagnostic_msgs/DiagnosticArray",
    )
    rights.add_argument(
        "--stop-age",
        type=float,
        metavar="SECONDS",
        help="an older message counts as pressed; default: 1",
    )
    rights.add_argument(
        "--stop-pressed",
        choices=["true", "false"],
        help="the Bool that means pressed; default: true",
    )
    rights.add_argument(
        "--stop-status", metavar="NAME", help="the status that counts, of diagnostics"
    )
    rights.add_argument(
        "--stop-level", type=int, metavar="N", help="the level from which it does; default: 2"
    )
    rights.add_argument(
        "--page-present",
        metavar="WAIT..STOP",
        help="whoever starts there, or holds its baton, keeps a page visible: without one for so many "
        "seconds a led run waits, and each run is stopped, as 10..60; no enabling device; '' for off",
    )
    rights.add_argument(
        "--health",
        action="append",
        metavar="TOPIC=PERCENT%|TOPIC:STATUS=LEVEL[,block][,unknown-warns][,SECONDSs]",
        help="looked at before a start: a battery (sensor_msgs/BatteryState) below so many percent, as "
        "/battery=30%%,block, or a status of diagnostics from a level on, as /diagnostics:motors=2. It "
        "warns, or blocks the start; where it blocks, unknown does too. An older message than 30 s is "
        "unknown. Again for each, and all others are dropped; information, no safety function",
    )
    rights.add_argument("--no-health", action="store_true", help="look at no health any more")
    rights.set_defaults(handler=_rights)


def _add_drill(words: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    drill = command(
        words,
        "drill",
        "record a Stop drill with a run that was stopped, and what you saw; without --run, list them",
        "David --run RUN --saw-it-stop yes --hardware-stop yes",
    )
    drill.add_argument("name", metavar="NAME")
    drill.add_argument("--run", metavar="RUN", help="id of the run")
    drill.add_argument("--saw-it-stop", choices=["yes", "no"], help="you saw the robot stop")
    drill.add_argument("--hardware-stop", choices=["yes", "no"], help="you tried its hardware stop")
    drill.set_defaults(handler=_drill)


def _add_baton(words: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    baton = words.add_parser(
        "baton",
        help="take the baton of a robot, hand it over, or drop it",
        description="The baton.",
    )
    baton.add_argument("name", metavar="NAME")
    does = baton.add_subparsers(dest="does", required=True, metavar="show | take | hand | drop")
    shown = command(does, "show", "say who holds the baton of a robot", "")
    shown.set_defaults(handler=_show_baton)
    take = command(does, "take", "take the baton of a robot", '--reason "Ann is at lunch."')
    take.add_argument("--reason", default="", help="why it is taken over from its holder")
    take.set_defaults(handler=_take_baton)
    hand = command(does, "hand", "hand it to somebody who has a page open", "--to Ben")
    hand.add_argument("--to", required=True, metavar="PERSON", help="name or id")
    hand.add_argument(
        "--run",
        metavar="RUN",
        help="hand over this led run with all batons of its robots: it goes on",
    )
    hand.set_defaults(handler=_hand_baton)
    drop = command(
        does, "drop", "drop the baton of a robot: whoever may start there can take it", ""
    )
    drop.set_defaults(handler=_drop_baton)


def _add_service(words: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    lock = command(
        words,
        "lock",
        "put a robot out of service: nothing starts or goes on there; what runs is not stopped",
        'David --reason "It leaks oil."',
    )
    lock.add_argument("name", metavar="NAME")
    lock.add_argument("--reason", required=True)
    lock.set_defaults(handler=_lock)
    unlock = command(
        words, "unlock", "take your lock off a robot; owners also those of others", "David"
    )
    unlock.add_argument("name", metavar="NAME")
    unlock.add_argument("--of", default="", metavar="PERSON", help="whose lock it is: name or id")
    unlock.set_defaults(handler=_unlock)


COMMANDS: Final = {"robots": _add_robots}


def _list(options: argparse.Namespace) -> int:
    with running(options) as server:
        found = server.runners.gathered("/api/robots")
    if options.json:
        print_json(found.json())
        return found.code
    from action_assistant.runner.robots.registration import Robot

    for site, answer in found.answers:
        at = f"  {one_line(site.name)}" if site.name else ""
        for each in decoded(answer, list[Robot]):
            print(_line(each) + at)
    return found.code


def _add(options: argparse.Namespace) -> int:
    profile = {} if options.profile is None else _profile(Path(options.profile))
    if options.second_person:
        profile[SECOND_PERSON] = True
    wanted: dict[str, Any] = {"name": options.name, "domain": options.domain, "profile": profile}
    if options.led:
        wanted["led"] = True
    if options.rmw:
        wanted["rmw"] = options.rmw
    if options.get_service is not None:
        wanted["get_service"] = options.get_service
    with running(options) as lab:
        from action_assistant.runner.robots.registration import Robot

        site = lab.runners.named(options.site)
        lab.runners.robots_elsewhere(options.name, site)
        server = lab.at(site)
        robots = decoded(server.runner("GET", "/api/robots"), list[Robot])
        if options.name in {each.name for each in robots} and not options.replace:
            raise RequestRefused(
                f"{options.name} is registered already. --replace registers it anew."
            )
        print(_line(decoded(server.runner("POST", "/api/robots", json=wanted), Robot)))
    return 0


def _remove(options: argparse.Namespace) -> int:
    with running(options) as lab:
        server = lab if options.site is None else lab.at(lab.runners.named(options.site))
        server.runner("DELETE", f"/api/robots/{quote(options.name, safe='')}")
    print(one_line(f"{options.name} is not registered any more"))
    return 0


def _rights(options: argparse.Namespace) -> int:
    """Change the rights that the options name, and show them."""
    with running(options) as server:
        robot = _robot(server, options.name)
        if options.all and options.operator:
            raise RequestRefused("Say --all or --operator, not both.")
        stop = (options.stop_topic, *_stop_details(options).values())
        rules = (
            *(options.baton, options.watched, options.released_only, options.drill_days),
            options.ask_again,
            options.limit,
            options.no_limits or None,
            *stop,
            options.page_present,
            options.health,
            options.no_health or None,
        )
        if options.all or options.operator or any(each is not None for each in rules):
            operators: Any = robot.operators
            if options.all:
                operators = "all"
            elif options.operator:
                operators = [_operator(each, server) for each in options.operator]
            wanted = {
                "operators": operators,
                "baton": _switched(options.baton, robot.baton),
                "watched": _switched(options.watched, robot.watched),
                "released_only": _switched(options.released_only, robot.released_only),
                "drill_days": robot.drill_days
                if options.drill_days is None
                else options.drill_days or None,
                "ask_again": robot.ask_again if options.ask_again is None else options.ask_again,
            }
            if options.limit or options.no_limits:
                wanted["limits"] = [_limit(each) for each in options.limit or ()]
            if any(each is not None for each in stop):
                wanted["hardware_stop"] = _hardware_stop(options, robot)
            if options.page_present is not None:
                wanted["page_presence"] = _page_presence(options.page_present)
            if options.health or options.no_health:
                wanted["health"] = [_health(each) for each in options.health or ()]
            body = msgspec.to_builtins(wanted)
            robot = _changed(server, "PUT", f"{_path(options)}/rights", body)
    print(one_line(f"{robot.name}: {_operators_text(robot)}"))
    print(one_line(_baton_text(robot)))
    for said in _rules_texts(robot):
        print(one_line(said))
    if robot.ask_again:
        print(f"whoever starts there confirms again after {robot.ask_again} min that it is they")
    return 0


def _switched(asked: str | None, before: bool) -> bool:
    return before if asked is None else asked == "on"


def _rules_texts(robot: "Robot") -> list[str]:
    """Return a sentence for each further rule of a robot about starts."""
    said = []
    if robot.watched:
        said.append(f"whoever starts on {robot.name} confirms that they watch it")
    if robot.released_only:
        said.append(f"only released versions start on {robot.name}")
    said += [f"{each.words()} on {robot.name}" for each in robot.limits]
    if robot.hardware_stop is not None:
        rule = HardwareStop(**msgspec.structs.asdict(robot.hardware_stop))
        said.append(f"the hardware stop of {robot.name} is pressed: {rule.words()}")
        said.append(robot.pressed or "it is not pressed")
    if robot.page_presence is not None:
        page = robot.page_presence
        said.append(
            f"without a visible page of its person a led run on {robot.name} waits after "
            f"{page.wait_s:g} s, and each run is stopped after {page.stop_s:g} s; no enabling device"
        )
    for check in robot.health_checks:
        said.append(HealthCheck(**msgspec.structs.asdict(check)).words())
    for each in robot.health:
        heard = "" if each.heard_at is None else f", heard {each.heard_at.astimezone():%H:%M:%S}"
        said.append(f"{each.text} ({each.topic}{heard})")
    if robot.drill_days is not None:
        said.append(f"a Stop drill of {robot.name} counts for {robot.drill_days} days")
    return said


def _drill(options: argparse.Namespace) -> int:
    """Record a Stop drill of a robot, or list those that were made. Return 1 if the last one failed
    or was never made."""
    with running(options) as server:
        if options.run is not None:
            if options.saw_it_stop is None or options.hardware_stop is None:
                raise RequestRefused(
                    "Say what you saw: --saw-it-stop and --hardware-stop, yes or no."
                )
            body = {
                "run": options.run,
                "saw_it_stop": options.saw_it_stop == "yes",
                "hardware_stop": options.hardware_stop == "yes",
            }
            _changed(server, "POST", f"{_path(options)}/drills", body)
        from action_assistant.runner.robots.registration import DrillShown

        drills = decoded(server.runner("GET", f"{_path(options)}/drills"), list[DrillShown])
    for each in drills:
        how = (
            f"failed: {each.failure}"
            if each.failure
            else f"passed, proven after {each.proof_ms} ms"
        )
        when = each.stopped_at.astimezone()
        print(one_line(f"{when:%Y-%m-%d %H:%M}  run {each.number}  {each.by.name}  {how}"))
    return 0 if drills and not drills[0].failure else 1


def _operator(asked: str, server: Server) -> dict[str, Any]:
    """Return a right from ID[=DATE]. Raise RequestRefused if the date is none."""
    id_, _, day = asked.partition("=")
    names = _names(server)
    right: dict[str, Any] = {"id": id_, "name": names.get(id_, id_)}
    if day:
        try:
            end = datetime.fromisoformat(day) + timedelta(days=1)
        except ValueError as wrong:
            raise RequestRefused(f"{day!r} is no date; write it as 2027-01-31.") from wrong
        right["until"] = end.astimezone().isoformat()
    return right


def _limit(asked: str) -> dict[str, Any]:
    """Return a limit from [ACTION.]PARAMETER=[LEAST]..[MOST]. Raise RequestRefused if it is none."""
    place, _, bounds = asked.rpartition("=")
    action, _, parameter = place.rpartition(".")
    least, dots, most = bounds.partition("..")
    try:
        found = {
            name: float(text) for name, text in (("least", least), ("most", most)) if text.strip()
        }
        if not parameter or not dots or not all(map(isfinite, found.values())):
            raise ValueError
    except ValueError as wrong:
        raise RequestRefused(
            f"{asked!r} is no limit; write it as torque=..60 or Grip.torque=5..60."
        ) from wrong
    return {"parameter": parameter, "action": action, **found}


def _health(asked: str) -> dict[str, Any]:
    """Return something of a robot's health from TOPIC=PERCENT% or TOPIC:STATUS=LEVEL, with what follows.
    Raise RequestRefused if it is neither."""
    place, _, said = asked.rpartition("=")
    topic, _, status = place.partition(":")
    bound, *more = said.split(",")
    check: dict[str, Any] = {"topic": topic}
    try:
        if bound.endswith("%") and not status:
            check["below"] = float(bound[:-1])
        elif not status:
            raise ValueError
        else:
            check |= {"kind": "diagnostics", "status": status, "level": int(bound)}
        for each in more:
            if each in {"warn", "block"}:
                check["poor"] = each
            elif each in {"unknown-warns", "unknown-blocks"}:
                check["unknown"] = each.removeprefix("unknown-").removesuffix("s")
            else:
                check["age_s"] = float(each.removesuffix("s"))
        if not topic or not all(isfinite(check.get(name, 0)) for name in ("below", "age_s")):
            raise ValueError
    except ValueError as wrong:
        raise RequestRefused(
            f"{asked!r} is no such check; write it as /battery=30%,block or /diagnostics:motors=2,5s."
        ) from wrong
    return check


def _stop_details(options: argparse.Namespace) -> dict[str, Any]:
    """Return what the options say of a hardware stop besides its topic; None for what they leave out."""
    return {
        "kind": options.stop_kind,
        "age_s": options.stop_age,
        "pressed": None if options.stop_pressed is None else options.stop_pressed == "true",
        "status": options.stop_status,
        "level": options.stop_level,
    }


def _hardware_stop(options: argparse.Namespace, robot: "Robot") -> dict[str, Any] | None:
    """Return where the hardware stop of a robot is reported from now on, None for nowhere: what the options
    leave out stays as it is. Raise RequestRefused if there is no topic."""
    if options.stop_topic == "":
        return None
    now = robot.hardware_stop
    before = {} if now is None else msgspec.structs.asdict(now)
    named = {name: value for name, value in _stop_details(options).items() if value is not None}
    topic = options.stop_topic or before.get("topic")
    if topic is None:
        raise RequestRefused(f"Name the topic of the hardware stop of {robot.name}: --stop-topic.")
    return {**before, **named, "topic": topic}


def _page_presence(asked: str) -> dict[str, float] | None:
    """Return for how long pages may be missing, from WAIT..STOP; None for "". Raise RequestRefused if it
    is neither."""
    if not asked:
        return None
    wait, _, stop = asked.partition("..")
    try:
        found = {"wait_s": float(wait), "stop_s": float(stop)}
        if not all(map(isfinite, found.values())):
            raise ValueError
    except ValueError as wrong:
        raise RequestRefused(f"{asked!r} is no such time; write it as 10..60.") from wrong
    return found


def _names(server: Server) -> dict[str, str]:
    """Return the names of people and groups by id, as far as the editor knows them."""
    try:
        found = server.editor("GET", "/api/members").json()
    except RequestRefused:
        return {}
    return {each["id"]: each["name"] for each in (*found["people"], *found["groups"])}


def _show_baton(options: argparse.Namespace) -> int:
    with running(options) as server:
        print(one_line(_baton_text(_robot(server, options.name))))
    return 0


def _take_baton(options: argparse.Namespace) -> int:
    with running(options) as server:
        body = {"reason": options.reason}
        print(one_line(_baton_text(_changed(server, "POST", f"{_path(options)}/baton/take", body))))
    return 0


def _hand_baton(options: argparse.Namespace) -> int:
    with running(options) as lab:
        server = lab.at(lab.runners.of_robot(options.name))
        here = server.runner("GET", "/api/rights").json()["people"]
        found = [each for each in here if options.to in {each["id"], each["name"]}]
        if len(found) != 1:
            names = ", ".join(f"{each['name']} ({each['id']})" for each in here) or "nobody"
            raise RequestRefused(
                f"{len(found) or 'No'} person{'s' * (len(found) != 1)} called {options.to!r} can get it. Here "
                f"are: {names}."
            )
        body = {"to": found[0]["id"]}
        if options.run is not None:
            server.runner("POST", f"/api/runs/{options.run}/hand_over", json=body)
            print(one_line(f"run {options.run} goes on; it was handed over to {found[0]['name']}"))
        else:
            robot = _changed(server, "POST", f"{_path(options)}/baton/hand", body)
            print(one_line(_baton_text(robot)))
    return 0


def _drop_baton(options: argparse.Namespace) -> int:
    with running(options) as server:
        print(one_line(_baton_text(_changed(server, "POST", f"{_path(options)}/baton/drop"))))
    return 0


def _lock(options: argparse.Namespace) -> int:
    with running(options) as server:
        robot = _changed(server, "POST", f"{_path(options)}/lock", {"reason": options.reason})
    print(one_line(f"{robot.name} is out of service. What runs there was not stopped."))
    return 0


def _unlock(options: argparse.Namespace) -> int:
    with running(options) as server:
        locks = _robot(server, options.name).locks
        named = [each.by.id for each in locks if options.of in {each.by.id, each.by.name}]
        of = named[0] if options.of and len(named) == 1 else options.of
        robot = _changed(server, "POST", f"{_path(options)}/unlock", {"of": of})
    left = ", ".join(f"{each.by.name} ({each.reason})" for each in robot.locks)
    print(one_line(f"{robot.name} is {f'still locked by {left}' if left else 'in service'}"))
    return 0


def _path(options: argparse.Namespace) -> str:
    return f"/api/robots/{quote(options.name, safe='')}"


def _robot(server: Server, name: str) -> "Robot":
    from action_assistant.runner.robots.registration import Robot

    return decoded(server.runner("GET", f"/api/robots/{quote(name, safe='')}"), Robot)


def _changed(server: Server, method: str, path: str, body: Any = None) -> "Robot":
    """Send a change of a robot, and return the robot after it."""
    from action_assistant.runner.robots.registration import Robot

    sent = {} if body is None else {"json": body}
    return decoded(server.runner(method, path, **sent), Robot)


def _operators_text(robot: "Robot") -> str:
    if robot.operators == "all":
        return "every operator may start there"
    named = [
        f"{each.name} ({each.id})"
        + (f" until {each.until.astimezone():%Y-%m-%d %H:%M}" if each.until else "")
        for each in robot.operators
    ]
    return f"only {', '.join(named) or 'nobody'} may start there"


def _baton_text(robot: "Robot") -> str:
    if not robot.baton:
        return f"{robot.name} has no baton: every operator who may start there can"
    if robot.holder is None:
        return f"nobody holds the baton of {robot.name}, and nothing starts there until somebody takes it"
    is_here = "" if robot.holder.here else ", and has no page open"
    return f"{robot.holder.person.name} holds the baton of {robot.name}{is_here}"


def _line(robot: "Robot") -> str:
    """Return one robot as a line: its name, domain and state, why it does not answer, who holds its baton,
    and who has put it out of service."""
    domain = "" if robot.domain is None else f"  domain {robot.domain}"
    why = f": {robot.why}" if robot.why else ""
    baton = ""
    if robot.baton:
        baton = f"  baton: {robot.holder.person.name if robot.holder else 'nobody'}"
    locks = "".join(f"  OUT OF SERVICE ({each.by.name}: {each.reason})" for each in robot.locks)
    return one_line(f"{robot.name}{domain}  {robot.state}{why}{baton}{locks}")


def _profile(path: Path) -> dict[str, Any]:
    """Read a robot's profile from the JSON file `path`. Raise CannotStart if it cannot be read or
    is no JSON object."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, Any])
    except OSError as error:
        raise CannotStart(f"Cannot read the profile {path}: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        raise CannotStart(f"The profile {path} is no JSON object: {error}.") from error
