/** A program waits at a terminal with a code: a person looks at what it asks for, and answers. */
import { Button, TextInput } from "@mantine/core";
import { useEffect, useState } from "react";
import { errorText } from "../api/http";
import { isolated } from "../words/isolated";
import style from "./programs.module.css";
import { LifeField, ScopeFields, useGivable } from "./scope-fields";
import {
  completed,
  type LoginRequest,
  placeWords,
  type Scope,
  useAnswer,
  useLogin,
  useRenewTokens,
} from "./tokens";

export function LoginCard({ code, mostDays }: { code: string; mostDays: number }) {
  const [typed, setTyped] = useState(code);
  const [asked, setAsked] = useState(code);
  const login = useLogin(asked);
  useEffect(() => {
    if (code !== "") {
      setTyped(code);
      setAsked(code);
    }
  }, [code]);
  return (
    <section className="page-card" aria-label="Sign a program in">
      <h3 className={style.heading}>Sign a program in</h3>
      <form
        className={style.row}
        aria-label="Code"
        onSubmit={(event) => {
          event.preventDefault();
          const next = typed.trim().toUpperCase();
          if (next === asked) void login.refetch();
          setAsked(next);
        }}
      >
        <TextInput
          className={style.code ?? ""}
          label="The code that action-assistant login shows"
          placeholder="BCDF-GHJK"
          autoComplete="off"
          autoCapitalize="characters"
          spellCheck={false}
          maxLength={20}
          value={typed}
          error={login.isError && login.fetchStatus === "idle" ? errorText(login.error) : undefined}
          onChange={(event) => setTyped(event.currentTarget.value)}
        />
        <Button type="submit" disabled={typed.trim() === ""} loading={login.isLoading}>
          Look
        </Button>
      </form>
      {login.data && <Waiting key={login.data.code} login={login.data} mostDays={mostDays} />}
    </section>
  );
}

function Waiting({ login, mostDays }: { login: LoginRequest; mostDays: number }) {
  const renew = useRenewTokens();
  const fetched = login.state === "fetched";
  useEffect(() => {
    if (fetched) void renew();
  }, [fetched, renew]);
  if (login.state === "waiting") return <Question login={login} mostDays={mostDays} />;
  return (
    <p className={style.said} role="status">
      {fetched
        ? `${isolated(login.name)} is signed in.`
        : `Confirmed. ${isolated(login.name)} fetches its token in a moment.`}
    </p>
  );
}

function Question({ login, mostDays }: { login: LoginRequest; mostDays: number }) {
  const givable = useGivable();
  const { confirm, refuse } = useAnswer();
  const [name, setName] = useState(login.name);
  // Robots move only for whoever ticks it: what a program asks for is no reason.
  const [chosen, setChosen] = useState<Scope[]>(() =>
    login.scopes.filter((scope) => scope !== "operate" && givable.includes(scope)),
  );
  const [days, setDays] = useState(Math.min(login.days ?? 90, mostDays));
  if (refuse.isSuccess) {
    return (
      <p className={style.said} role="status">
        {isolated(login.name)} was refused. Nothing was given to it.
      </p>
    );
  }
  return (
    <form
      className={style.question}
      aria-label="Program that asks"
      onSubmit={(event) => {
        event.preventDefault();
        confirm.mutate({ code: login.code, name: name.trim(), scopes: completed(chosen), days });
      }}
    >
      <p className="m-0">
        <b>{isolated(login.name)}</b> asks from {placeWords(login.address)} to act in your name.
        Confirm only if you have just started <code>action-assistant login</code> there yourself,
        and it shows <b>{login.code}</b>.
      </p>
      <ScopeFields offered={login.scopes} chosen={chosen} onChange={setChosen} />
      <div className={style.row}>
        <TextInput
          flex={1}
          label="Name in lists and runs"
          maxLength={60}
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <LifeField days={days} most={mostDays} onChange={setDays} />
      </div>
      {(confirm.isError || refuse.isError) && (
        <p className="m-0 ink-error text-13" role="alert">
          {errorText(confirm.error ?? refuse.error)}
        </p>
      )}
      <div className={style.row}>
        <Button
          type="submit"
          variant="filled"
          loading={confirm.isPending}
          disabled={chosen.length === 0 || name.trim() === ""}
        >
          Let it in
        </Button>
        <Button loading={refuse.isPending} onClick={() => refuse.mutate(login.code)}>
          Refuse
        </Button>
      </div>
    </form>
  );
}
