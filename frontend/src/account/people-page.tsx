/** People and devices: one's own devices; for owners also persons, their links and groups. */
import { Button, MultiSelect, NativeSelect, TextInput } from "@mantine/core";
import { IconDevices, IconPlus } from "@tabler/icons-react";
import { useState } from "react";
import { errorText } from "../api/http";
import {
  type Group,
  type Member,
  memberCodeUrl,
  type OpenSession,
  useAddMember,
  useChangeMember,
  useDevices,
  useEndMember,
  useEndSession,
  useEndSessionsOf,
  useLinkMember,
  useMakeGroup,
  useMembers,
  useRemoveGroup,
  useSessions,
} from "../api/members";
import { useLive } from "../api/page-link";
import { pageUrl } from "../api/page-url";
import { useMay, usePerson } from "../api/people";
import { ROLE_WORDS, type Role } from "../api/session";
import { ConfirmRow } from "../ui/confirm-row";
import { copyText } from "../ui/copy-text";
import { usePendingText } from "../ui/drafts";
import { ago, dateText, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import { AddDevice } from "./add-device";
import { Passkeys } from "./passkeys";
import style from "./people-page.module.css";
import { originsOf } from "./share-dialog";

const ROLES: readonly { value: Role; label: string }[] = [
  { value: "viewer", label: "Viewer" },
  { value: "editor", label: "Editor" },
  { value: "operator", label: "Operator" },
  { value: "owner", label: "Owner" },
];
/** The roles that an owner may give to a person: one who comes by a provider has at most what it says. */
const rolesFor = ({ provider }: Member) =>
  provider ? ROLES.slice(0, ROLES.findIndex(({ value }) => value === provider.role) + 1) : ROLES;
/** Returns the host of the provider by which a person signs in. */
const providerHost = (issuer: string) => issuer.replace(/^https?:\/\//, "").replace(/\/.*/, "");
const roleOf = (text: string): Role => ROLES.find(({ value }) => value === text)?.value ?? "viewer";

export function PeoplePage() {
  const shares = useMay("share");
  return (
    <main className="page">
      <div className={style.inner}>
        <h2 className="page-title">{shares ? "People and devices" : "Your devices"}</h2>
        <Devices />
        <Passkeys />
        {shares && <Persons />}
      </div>
    </main>
  );
}

/** Says an error of a change, below the list that it concerns. */
function Trouble({ of }: { of: readonly { isError: boolean; error: unknown }[] }) {
  const failed = of.find((each) => each.isError);
  if (failed === undefined) return null;
  return (
    <p className="m-0 ink-error text-13" role="alert">
      {errorText(failed.error)}
    </p>
  );
}

/** Returns one line about a device: its browser, where it signed in, and its last use. */
export function deviceWords(session: OpenSession, now: number): string {
  const used = instant(session.used_at);
  const place = session.address ? ` at ${session.address}` : "";
  const last = used === null ? "" : `, used ${ago(used, now)}`;
  return `${session.browser || "A browser"}${place}${last}`;
}

function Devices() {
  const devices = useDevices();
  const end = useEndSession(useLive().runner);
  const now = useNow(30_000);
  const [adding, setAdding] = useState(false);
  const here = { page: pageUrl(), hostname: location.hostname };
  const origins = devices.data
    ? originsOf({ ...devices.data, secure: false, proxied: false, invitations: [] }, here)
    : [];
  return (
    <section className="page-card min-w-0" aria-label="Your devices">
      <div className={style.head}>
        <h3>Your devices</h3>
        <Button leftSection={<IconPlus size={15} aria-hidden />} onClick={() => setAdding(true)}>
          Add a device
        </Button>
      </div>
      {devices.isError && <Trouble of={[devices]} />}
      <ul className={style.list}>
        {devices.data?.sessions.map((session) => (
          <li key={session.id}>
            <div className={style.row}>
              <span>
                <IconDevices size={15} aria-hidden /> {deviceWords(session, now)}
                {session.id === devices.data.this && <b> · this one</b>}
              </span>
              {session.id !== devices.data.this && (
                <Button
                  size="compact-sm"
                  aria-label={`Sign out ${session.browser || "this browser"}`}
                  onClick={() => end.mutate({ session: session.id, own: true })}
                >
                  Sign out
                </Button>
              )}
            </div>
          </li>
        ))}
      </ul>
      <Trouble of={[end]} />
      <AddDevice opened={adding} onClose={() => setAdding(false)} origins={origins} />
    </section>
  );
}

function Persons() {
  const members = useMembers();
  const sessions = useSessions();
  if (members.isError) return <Trouble of={[members]} />;
  if (!members.data) return <div className={style.waiting} aria-busy="true" />;
  const { people, groups } = members.data;
  const present = people.filter((each) => !each.ended_at);
  const ended = people.filter((each) => each.ended_at);
  const known = new Set(people.map((each) => each.id));
  const others = (sessions.data ?? []).filter((each) => !known.has(each.person.id));
  const here = { page: pageUrl(), hostname: location.hostname };
  const { origins } = members.data;
  const [origin = pageUrl()] = originsOf(
    { origins, secure: false, proxied: false, invitations: [] },
    here,
  );
  return (
    <>
      <section className="page-card min-w-0" aria-label="Persons">
        <div className={style.head}>
          <h3>{counted(present.length, "person")}</h3>
        </div>
        <NewPerson groups={groups} />
        <ul className={style.list}>
          {present.map((member) => (
            <Person
              key={member.id}
              member={member}
              groups={groups}
              origin={origin}
              sessions={(sessions.data ?? []).filter((each) => each.person.id === member.id)}
            />
          ))}
        </ul>
        {ended.length > 0 && (
          <p className="m-0 ink2 text-13">
            Ended: {ended.map((each) => isolated(each.name)).join(", ")}
          </p>
        )}
      </section>
      <Groups groups={groups} people={present} />
      <OtherSessions sessions={others} />
    </>
  );
}

function NewPerson({ groups }: { groups: readonly Group[] }) {
  const add = useAddMember(useLive().runner);
  const [name, setName] = useState("");
  const [role, setRole] = useState<Role>("operator");
  const [chosen, setChosen] = useState<string[]>([]);
  usePendingText(name, null);
  return (
    <form
      className={style.form}
      aria-label="New person"
      onSubmit={(event) => {
        event.preventDefault();
        add.mutate(
          { name: name.trim(), role, groups: chosen },
          {
            onSuccess: () => {
              setName("");
              setChosen([]);
            },
          },
        );
      }}
    >
      <TextInput
        label="Name"
        value={name}
        maxLength={60}
        error={add.isError ? errorText(add.error) : undefined}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <NativeSelect
        label="Role"
        title={`May ${ROLE_WORDS[role]}`}
        data={ROLES}
        value={role}
        onChange={(event) => setRole(roleOf(event.currentTarget.value))}
      />
      {groups.length > 0 && (
        <MultiSelect
          label="Groups"
          data={groups.map(({ id, name }) => ({ value: id, label: name }))}
          value={chosen}
          onChange={setChosen}
        />
      )}
      <Button type="submit" variant="filled" loading={add.isPending} disabled={name.trim() === ""}>
        Add
      </Button>
    </form>
  );
}

interface PersonProps {
  member: Member;
  groups: readonly Group[];
  origin: string;
  sessions: readonly OpenSession[];
}

function Person({ member, groups, origin, sessions }: PersonProps) {
  const { runner } = useLive();
  const { person: me } = usePerson();
  const change = useChangeMember(runner);
  const link = useLinkMember();
  const end = useEndMember(runner);
  const endSession = useEndSession(runner);
  const signOut = useEndSessionsOf();
  const now = useNow(30_000);
  const [open, setOpen] = useState(false);
  const [asking, setAsking] = useState(false);
  const fresh = member.links?.find((each) => each.path !== undefined);
  const until = instant(member.until);
  const isMe = member.id === me.id;
  const named = groups.filter(({ id }) => member.groups.includes(id)).map((each) => each.name);
  const facts = [
    member.role,
    ...named.map(isolated),
    ...(member.provider ? [`by ${providerHost(member.provider.issuer)}`] : []),
    ...(until === null ? [] : [`until ${dateText(until)}`]),
    sessions.length > 0 ? counted(sessions.length, "device") : fresh ? "invited" : "not signed in",
  ];
  return (
    <li>
      <div className={style.row}>
        <span>
          <b>
            <bdi>{member.name}</bdi>
          </b>{" "}
          · {facts.join(" · ")}
          {isMe && " · you"}
        </span>
        <Button
          size="compact-sm"
          aria-expanded={open}
          aria-label={`More about ${isolated(member.name)}`}
          onClick={() => setOpen(!open)}
        >
          {open ? "Less" : "More"}
        </Button>
      </div>
      {fresh?.path && (
        <FreshLink
          member={member}
          link={origin + fresh.path}
          origin={origin}
          until={fresh.expires_at}
        />
      )}
      {open && (
        <>
          <div className={style.form}>
            <NativeSelect
              label="Role"
              disabled={isMe}
              data={rolesFor(member)}
              value={member.role}
              onChange={(event) => {
                const body = { role: roleOf(event.currentTarget.value) };
                change.mutate({ person: member.id, body });
              }}
            />
            {groups.length > 0 && (
              <MultiSelect
                label="Groups"
                data={groups.map(({ id, name }) => ({ value: id, label: name }))}
                value={[...member.groups]}
                onChange={(chosen) =>
                  change.mutate({ person: member.id, body: { groups: chosen } })
                }
              />
            )}
            <TextInput
              label="May start until"
              type="date"
              value={until === null ? "" : new Date(until).toISOString().slice(0, 10)}
              onChange={(event) => {
                const day = event.currentTarget.value;
                const body = { until: day === "" ? null : `${day}T23:59:59Z` };
                change.mutate({ person: member.id, body });
              }}
            />
          </div>
          {sessions.map((session) => (
            <div className={style.row} key={session.id}>
              <span>{deviceWords(session, now)}</span>
              <Button
                size="compact-sm"
                aria-label={`Sign out ${session.browser || "a browser"} of ${isolated(member.name)}`}
                onClick={() => endSession.mutate({ session: session.id, own: false })}
              >
                Sign out
              </Button>
            </div>
          ))}
          <div className={style.link}>
            <Button
              size="compact-sm"
              loading={link.isPending}
              onClick={() => link.mutate(member.id)}
            >
              New link
            </Button>
            {sessions.length > 1 && (
              <Button size="compact-sm" onClick={() => signOut.mutate(member.id)}>
                Sign out everywhere
              </Button>
            )}
            {!isMe && (
              <Button
                size="compact-sm"
                color="red"
                variant="subtle"
                className="ink-error"
                aria-label={`End ${isolated(member.name)}`}
                onClick={() => setAsking(true)}
              >
                End this person
              </Button>
            )}
          </div>
        </>
      )}
      {asking && (
        <ConfirmRow
          action="End now"
          loading={end.isPending}
          onCancel={() => setAsking(false)}
          onConfirm={() => end.mutate(member.id)}
        >
          All devices, links and programs of this person are out at once, for good. Runs go on;
          whoever is here can stop them.
        </ConfirmRow>
      )}
      <Trouble of={[change, link, end, endSession, signOut]} />
    </li>
  );
}

interface FreshLinkProps {
  member: Member;
  link: string;
  origin: string;
  until: string;
}

function FreshLink({ member, link, origin, until }: FreshLinkProps) {
  const [copied, setCopied] = useState(false);
  const [code, setCode] = useState(false);
  const expires = instant(until);
  return (
    <>
      <div className={style.link}>
        <TextInput
          readOnly
          aria-label={`Link for ${isolated(member.name)}`}
          description={`Works once${expires === null ? "" : `, until ${dateText(expires)}`}`}
          value={link}
          onFocus={(event) => event.currentTarget.select()}
        />
        <Button size="compact-sm" onClick={() => void copyText(link).then(setCopied)}>
          {copied ? "Copied" : "Copy"}
        </Button>
        <Button size="compact-sm" aria-expanded={code} onClick={() => setCode(!code)}>
          QR code
        </Button>
      </div>
      {code && (
        <div className={style.code}>
          <img
            src={memberCodeUrl(member.id, origin)}
            alt={`QR code of the link for ${isolated(member.name)}`}
            width={200}
            height={200}
          />
        </div>
      )}
    </>
  );
}

function Groups({ groups, people }: { groups: readonly Group[]; people: readonly Member[] }) {
  const make = useMakeGroup();
  const remove = useRemoveGroup();
  const [name, setName] = useState("");
  usePendingText(name, null);
  const [asking, setAsking] = useState<string | null>(null);
  return (
    <section className="page-card min-w-0" aria-label="Groups">
      <div className={style.head}>
        <h3>Groups</h3>
      </div>
      <form
        className={style.form}
        aria-label="New group"
        onSubmit={(event) => {
          event.preventDefault();
          make.mutate(name.trim(), { onSuccess: () => setName("") });
        }}
      >
        <TextInput
          label="Name of a group"
          value={name}
          maxLength={60}
          error={make.isError ? errorText(make.error) : undefined}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <Button type="submit" loading={make.isPending} disabled={name.trim() === ""}>
          Make a group
        </Button>
      </form>
      <ul className={style.list}>
        {groups.map((group) => {
          const inside = people.filter((each) => each.groups.includes(group.id));
          return (
            <li key={group.id}>
              <div className={style.row}>
                <span>
                  <b>
                    <bdi>{group.name}</bdi>
                  </b>{" "}
                  · {inside.map((each) => isolated(each.name)).join(", ") || "nobody yet"}
                </span>
                <Button
                  size="compact-sm"
                  aria-label={`Remove the group ${isolated(group.name)}`}
                  onClick={() => setAsking(group.id)}
                >
                  Remove
                </Button>
              </div>
              {asking === group.id && (
                <ConfirmRow
                  action="Remove"
                  loading={remove.isPending}
                  onCancel={() => setAsking(null)}
                  onConfirm={() => remove.mutate(group.id)}
                >
                  Its persons stay. What only this group may do, they may do no more.
                </ConfirmRow>
              )}
            </li>
          );
        })}
      </ul>
      <Trouble of={[remove]} />
    </section>
  );
}

/** People who came in by a group link or the token, by their devices. */
function OtherSessions({ sessions }: { sessions: readonly OpenSession[] }) {
  const end = useEndSession(useLive().runner);
  const now = useNow(30_000);
  if (sessions.length === 0) return null;
  return (
    <section className="page-card min-w-0" aria-label="Others who are signed in">
      <div className={style.head}>
        <h3>By a group link or the token</h3>
      </div>
      <ul className={style.list}>
        {sessions.map((session) => (
          <li key={session.id}>
            <div className={style.row}>
              <span>
                <b>
                  <bdi>{session.person.name || "Guest"}</bdi>
                </b>{" "}
                · {session.person.role} · {deviceWords(session, now)}
              </span>
              <Button
                size="compact-sm"
                aria-label={`Sign out ${isolated(session.person.name || "Guest")}`}
                onClick={() => end.mutate({ session: session.id, own: false })}
              >
                Sign out
              </Button>
            </div>
          </li>
        ))}
      </ul>
      <Trouble of={[end]} />
    </section>
  );
}
