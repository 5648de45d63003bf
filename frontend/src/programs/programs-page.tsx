/** Programs that act in a person's name: their tokens, made, listed and revoked. */
import { Button, TextInput } from "@mantine/core";
import { IconCheck, IconCopy } from "@tabler/icons-react";
import { useEffect, useState } from "react";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { useMay, usePerson } from "../api/people";
import { ConfirmRow } from "../ui/confirm-row";
import { copyText } from "../ui/copy-text";
import { ago, dateText, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import { LoginCard } from "./login-card";
import style from "./programs.module.css";
import { LifeField, ScopeFields } from "./scope-fields";
import {
  codeIn,
  completed,
  isOver,
  type MadeToken,
  placeWords,
  SCOPES,
  type Scope,
  type TokenShown,
  useMakeToken,
  useRevokeToken,
  useTokens,
} from "./tokens";

export function ProgramsPage() {
  const { runner } = useLive();
  const found = useTokens(runner);
  const code = useCode();
  const ofAll = useMay("share");
  const mostDays = found.data?.mostDays ?? 90;
  return (
    <main className="page">
      <div className={style.inner}>
        <h2 className="page-title">Programs</h2>
        <p className={style.intro}>
          A token lets a script, the command line or a monitor act in your name, with the rights
          that you choose and never more than you have. Nobody needs your link for that.
        </p>
        <LoginCard code={code} mostDays={mostDays} />
        <NewToken mostDays={mostDays} />
        <section className="page-card" aria-label="Tokens">
          <h3 className={style.heading}>
            {ofAll ? "Tokens of everybody" : "Your tokens"}
            {found.data && found.data.tokens.length > 0 && `: ${found.data.tokens.length}`}
          </h3>
          {found.isError && <p className="m-0 ink-error text-13">{errorText(found.error)}</p>}
          {found.data?.tokens.length === 0 && (
            <p className="m-0 ink2 text-13">No program has a token yet.</p>
          )}
          {found.data && found.data.atRunner !== "" && (
            <p className="m-0 ink-error text-13" role="alert">
              The runner may not know all of these: {found.data.atRunner}
            </p>
          )}
          {found.data && <TokenRows tokens={found.data.tokens} />}
        </section>
      </div>
    </main>
  );
}

/** The code in the address, which stays while the page is open. */
function useCode(): string {
  const [code, setCode] = useState(() => codeIn(location.hash));
  useEffect(() => {
    const take = () => setCode((now) => codeIn(location.hash) || now);
    window.addEventListener("hashchange", take);
    return () => window.removeEventListener("hashchange", take);
  }, []);
  return code;
}

function NewToken({ mostDays }: { mostDays: number }) {
  const make = useMakeToken();
  const [name, setName] = useState("");
  const [chosen, setChosen] = useState<Scope[]>(["read"]);
  const [days, setDays] = useState(Math.min(90, mostDays));
  return (
    <section className="page-card" aria-label="New token">
      <h3 className={style.heading}>New token</h3>
      {make.data !== undefined && <Secret made={make.data} onDone={make.reset} />}
      {make.data === undefined && (
        <form
          className={style.question}
          aria-label="New token"
          onSubmit={(event) => {
            event.preventDefault();
            make.mutate({ name: name.trim(), scopes: completed(chosen), days });
            setName("");
            setChosen(["read"]);
          }}
        >
          <div className={style.row}>
            <TextInput
              flex={1}
              label="Name of the program"
              placeholder="nightly tests"
              maxLength={60}
              value={name}
              error={make.isError ? errorText(make.error) : undefined}
              onChange={(event) => setName(event.currentTarget.value)}
            />
            <LifeField days={days} most={mostDays} onChange={setDays} />
          </div>
          <ScopeFields
            offered={SCOPES.map(({ scope }) => scope)}
            chosen={chosen}
            onChange={setChosen}
          />
          <div>
            <Button
              type="submit"
              variant="filled"
              loading={make.isPending}
              disabled={name.trim() === "" || chosen.length === 0}
            >
              Make the token
            </Button>
          </div>
        </form>
      )}
    </section>
  );
}

function Secret({ made, onDone }: { made: MadeToken; onDone: () => void }) {
  const [state, setState] = useState<"idle" | "done" | "failed">("idle");
  const words = { idle: "Copy", done: "Copied", failed: "Select and copy it by hand" }[state];
  const copy = async () => setState((await copyText(made.token)) ? "done" : "failed");
  return (
    <div className={style.question} role="status">
      <p className="m-0">
        <b>Copy the token of {isolated(made.record.name)} now: it is shown only here.</b> The
        program sends it as <code>Authorization: Bearer …</code>; our command line finds it in{" "}
        <code>ACTION_ASSISTANT_TOKEN</code>. Keep it out of addresses and of files that others read.
      </p>
      <div className={style.row}>
        <TextInput
          readOnly
          className={style.secret ?? ""}
          aria-label={`Token of ${isolated(made.record.name)}`}
          value={made.token}
          onFocus={(event) => event.currentTarget.select()}
        />
        <Button
          leftSection={state === "done" ? <IconCheck size={15} /> : <IconCopy size={15} />}
          onClick={() => void copy()}
        >
          {words}
        </Button>
        <Button variant="filled" onClick={onDone}>
          I have it
        </Button>
      </div>
    </div>
  );
}

function TokenRows({ tokens }: { tokens: TokenShown[] }) {
  const revoke = useRevokeToken(useLive().runner);
  return (
    <>
      {revoke.isError && (
        <p className="m-0 ink-error text-13" role="alert">
          {errorText(revoke.error)}{" "}
          <Button
            size="compact-sm"
            loading={revoke.isPending}
            onClick={() => revoke.mutate(revoke.variables)}
          >
            Try again
          </Button>
        </p>
      )}
      <ul className="list-reset" aria-label={counted(tokens.length, "token")}>
        {tokens.map((token) => (
          <TokenRow key={token.record.id} token={token} revoke={revoke} />
        ))}
      </ul>
    </>
  );
}

interface RowProps {
  token: TokenShown;
  /** The mutation of the list, which also shows its errors: a revoked token leaves the list. */
  revoke: ReturnType<typeof useRevokeToken>;
}

function TokenRow({ token, revoke }: RowProps) {
  const now = useNow(20_000);
  const { person } = usePerson();
  const [asking, setAsking] = useState(false);
  const { record, used } = token;
  const over = isOver(token, now);
  const maker = record.person.id === person.id ? "" : ` · by ${isolated(record.person.name)}`;
  return (
    <li className={style.token}>
      <div className={style.head}>
        <b className="break-anywhere">{record.name}</b>
        <span className="break-anywhere faint-12">
          {record.scopes.join(", ")}
          {maker} · made {ago(1000 * record.made_at, now)}
        </span>
        <span className="faint-12" data-over={over || undefined}>
          {over ? "Expired: it may still stop runs" : `Until ${dateText(1000 * record.expires)}`}
          {" · "}
          {used == null
            ? "never used"
            : `used ${ago(1000 * used.at, now)} from ${placeWords(used.address)}`}
        </span>
      </div>
      {!asking && (
        <Button
          color="red"
          variant="subtle"
          className="ink-error"
          aria-label={`Revoke the token ${isolated(record.name)}`}
          onClick={() => setAsking(true)}
        >
          Revoke
        </Button>
      )}
      {asking && (
        <ConfirmRow
          action="Revoke now"
          loading={revoke.isPending && revoke.variables === record.id}
          onCancel={() => setAsking(false)}
          onConfirm={() => revoke.mutate(record.id)}
        >
          The program is shut out at once. Runs that it has started go on.
        </ConfirmRow>
      )}
    </li>
  );
}
