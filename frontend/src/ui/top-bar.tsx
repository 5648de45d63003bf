/** The bar on top of every page: where one is, what one may do, and room for STOP at its right end. */

import { Fragment, type ReactNode, useState } from "react";
import { Link } from "wouter";
import { isolated } from "../words/isolated";
import { useDraft } from "./drafts";
import { keyOf } from "./keys";
import style from "./top-bar.module.css";

export interface Crumb {
  label: ReactNode;
  to?: string;
  /** Set if the crumb is a part of the page, not the page itself. */
  part?: boolean;
  /** Gives the page another name. Returns false where it has none any more. */
  rename?: (name: string) => boolean;
}

interface Props {
  crumbs: readonly Crumb[];
  /** Beside the crumbs: states in words. */
  status?: ReactNode;
  actions?: ReactNode;
  /** Beside STOP. */
  start?: ReactNode;
  account: ReactNode;
}

/** The mark is in index.html, so that it needs no request. */
export function Logo() {
  const icon = document.querySelector<HTMLLinkElement>('link[rel="icon"]');
  return <img src={icon?.href} alt="" width={24} height={24} className="block" />;
}

/** The focus goes past the bar. */
function toContent(): void {
  const main = document.querySelector<HTMLElement>("main");
  if (main === null) return;
  main.tabIndex = -1;
  main.focus();
}

interface NameProps {
  name: string;
  rename: (name: string) => boolean;
  onDone: () => void;
}

function NameWriting({ name, rename, onDone }: NameProps) {
  const field = useDraft({
    value: name,
    check: (draft) => (draft.trim() === "" ? "Enter a name for the graph." : null),
    onCommit: (draft) => draft.trim() === name || rename(draft.trim()),
    onLeaving: true,
  });
  const leave = (write: boolean) => {
    if (write && field.wrong === null) field.leave();
    else field.discard();
    onDone();
  };
  return (
    <input
      // biome-ignore lint/a11y/noAutofocus: it was asked for by a press at this place
      autoFocus
      className={style.name}
      aria-label="Name of the graph"
      value={field.text}
      maxLength={200}
      onFocus={(event) => event.currentTarget.select()}
      onChange={(event) => field.change(event.currentTarget.value)}
      onBlur={() => leave(true)}
      onKeyDown={(event) => {
        const key = keyOf(event);
        if (key === "Enter" || key === "Escape") leave(key === "Enter");
      }}
    />
  );
}

/** Title of the page; pressing it renames the page if it can be renamed. */
function Here({ crumb: { label, rename } }: { crumb: Crumb }) {
  const [writing, setWriting] = useState(false);
  if (rename === undefined || typeof label !== "string") {
    return <h1 className={style.here}>{label}</h1>;
  }
  if (!writing) {
    return (
      <h1 className={style.here}>
        <button type="button" title={`${isolated(label)}\nRename`} onClick={() => setWriting(true)}>
          <bdi>{label}</bdi>
        </button>
      </h1>
    );
  }
  return <NameWriting name={label} rename={rename} onDone={() => setWriting(false)} />;
}

export function TopBar({ crumbs, status, actions, account, start }: Props) {
  return (
    <header className={style.bar}>
      <button type="button" className={style.skip} onClick={toContent}>
        Skip to the content
      </button>
      <Link to="/" className={style.home} aria-label="All graphs">
        <Logo />
      </Link>
      <nav className={style.crumbs} aria-label="Where you are">
        {crumbs.map((crumb, i) => (
          <Fragment key={crumb.to ?? (crumb.part ? "part" : "here")}>
            {i > 0 && (
              <span className={style.slash} data-part={crumb.part || undefined} aria-hidden>
                /
              </span>
            )}
            {crumb.part ? (
              <span className={style.part}>{crumb.label}</span>
            ) : crumb.to === undefined ? (
              <Here crumb={crumb} />
            ) : (
              <Link to={crumb.to} className={style.crumb}>
                {crumb.label}
              </Link>
            )}
          </Fragment>
        ))}
      </nav>
      <div className={style.status}>{status}</div>
      <div className={style.actions}>{actions}</div>
      <div className="row flex-none gap-50">{account}</div>
      {start && <div className={style.actions}>{start}</div>}
    </header>
  );
}
