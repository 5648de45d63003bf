/** One's own passkeys: registered, renamed, removed; for owners also when they are asked for again. */
import { Button, NumberInput, TextInput } from "@mantine/core";
import { IconKey, IconPlus } from "@tabler/icons-react";
import { useState } from "react";
import { errorText } from "../api/http";
import {
  offersPasskeys,
  type Passkey,
  useOwnerAsked,
  usePasskeys,
  useRegisterPasskey,
  useRemovePasskey,
  useRenamePasskey,
} from "../api/passkeys";
import { useMay } from "../api/people";
import { usePendingText } from "../ui/drafts";
import { ago, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./people-page.module.css";

const NAME_LIMIT = 60;

export function Passkeys() {
  const passkeys = usePasskeys();
  const found = passkeys.data?.passkeys ?? [];
  if (!offersPasskeys() && found.length === 0) return null;
  return (
    <section className="page-card min-w-0" aria-label="Your passkeys">
      <div className={style.head}>
        <h3>Your passkeys</h3>
      </div>
      <p className="m-0 ink2 text-13">
        A passkey of this device or of a security key confirms that it is you, where a robot asks
        for that before a start. Signing in goes on as before.
      </p>
      {passkeys.isError && (
        <p className="m-0 ink-error text-13" role="alert">
          {errorText(passkeys.error)}
        </p>
      )}
      <ul className={style.list}>
        {found.map((passkey) => (
          <Row key={passkey.id} passkey={passkey} />
        ))}
      </ul>
      {offersPasskeys() && <NewPasskey />}
      {found.length > 0 && <AskAgain minutes={passkeys.data?.ask_again ?? 0} />}
    </section>
  );
}

function NewPasskey() {
  const register = useRegisterPasskey();
  const [name, setName] = useState("");
  usePendingText(name, null);
  return (
    <form
      className={style.form}
      aria-label="New passkey"
      onSubmit={(event) => {
        event.preventDefault();
        register.mutate(name.trim(), { onSuccess: () => setName("") });
      }}
    >
      <TextInput
        label="Name"
        placeholder="Tablet in the lab"
        value={name}
        maxLength={NAME_LIMIT}
        error={register.isError ? errorText(register.error) : undefined}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Button
        type="submit"
        leftSection={<IconPlus size={15} aria-hidden />}
        loading={register.isPending}
        disabled={name.trim() === ""}
      >
        Register a passkey
      </Button>
    </form>
  );
}

function Row({ passkey }: { passkey: Passkey }) {
  const rename = useRenamePasskey();
  const remove = useRemovePasskey();
  const [name, setName] = useState<string | null>(null);
  usePendingText(name === passkey.name ? "" : (name ?? ""), null);
  const now = useNow(30_000);
  const counts = instant(passkey.counts_at) ?? 0;
  const words = [
    passkey.rp === location.hostname ? "" : `at ${isolated(passkey.rp)}`,
    `registered ${ago(instant(passkey.made_at) ?? now, now)}`,
    counts > now ? `confirms from ${new Date(counts).toLocaleString()} on` : "",
  ].filter((each) => each !== "");
  const failed = [rename, remove].find((each) => each.isError);
  return (
    <li>
      <div className={style.row}>
        {name === null ? (
          <span>
            <IconKey size={15} aria-hidden /> <b>{isolated(passkey.name)}</b> · {words.join(" · ")}
          </span>
        ) : (
          <TextInput
            size="xs"
            aria-label={`Name of ${isolated(passkey.name)}`}
            value={name}
            maxLength={NAME_LIMIT}
            data-autofocus
            onChange={(event) => setName(event.currentTarget.value)}
          />
        )}
        {name === null ? (
          <Button
            size="compact-sm"
            aria-label={`Rename ${isolated(passkey.name)}`}
            onClick={() => setName(passkey.name)}
          >
            Rename
          </Button>
        ) : (
          <Button
            size="compact-sm"
            disabled={name.trim() === ""}
            onClick={() =>
              rename.mutate(
                { passkey: passkey.id, name: name.trim() },
                { onSuccess: () => setName(null) },
              )
            }
          >
            Save
          </Button>
        )}
        <Button
          size="compact-sm"
          aria-label={`Remove ${isolated(passkey.name)}`}
          loading={remove.isPending}
          onClick={() => remove.mutate(passkey.id)}
        >
          Remove
        </Button>
      </div>
      {failed !== undefined && (
        <p className="m-0 ink-error text-13" role="alert">
          {errorText(failed.error)}
        </p>
      )}
    </li>
  );
}

/** For owners: after how many minutes what only they do asks them to confirm who they are. */
function AskAgain({ minutes }: { minutes: number }) {
  const isOwner = useMay("share");
  const save = useOwnerAsked();
  const [wanted, setWanted] = useState<number | string>(minutes || "");
  usePendingText((Number(wanted) || 0) === minutes ? "" : String(wanted), null);
  if (!isOwner) return null;
  return (
    <form
      className={style.form}
      aria-label="Ask me again"
      onSubmit={(event) => {
        event.preventDefault();
        save.mutate(Number(wanted) || 0);
      }}
    >
      <NumberInput
        label="Ask me again before what only owners do, after so many minutes"
        description="Links, people, rights and restoring; reading never asks. Empty: never."
        min={0}
        max={1440}
        allowDecimal={false}
        value={wanted}
        error={save.isError ? errorText(save.error) : undefined}
        onChange={setWanted}
      />
      <Button type="submit" loading={save.isPending} disabled={(Number(wanted) || 0) === minutes}>
        Save
      </Button>
    </form>
  );
}
