/**
 * Content that is printed instead of the page: rendered when the browser prints, and removed
 * afterwards.
 */
import { type ReactNode, useEffect, useState } from "react";
import { createPortal, flushSync } from "react-dom";
import style from "./print-sheet.module.css";

interface Props {
  /** Title and facts at the top of the sheet. */
  title: string;
  facts: readonly (readonly [name: string, value: string])[];
  /** Made at that moment only; `across`: on paper that lies so. */
  content: () => { readonly across?: boolean; readonly body: ReactNode };
}

/** The browser waits for its listeners, so that what they draw is what it prints. */
function usePrinting(): boolean {
  const [printing, setPrinting] = useState(false);
  useEffect(() => {
    const begin = () => flushSync(() => setPrinting(true));
    const end = () => setPrinting(false);
    window.addEventListener("beforeprint", begin);
    window.addEventListener("afterprint", end);
    return () => {
      window.removeEventListener("beforeprint", begin);
      window.removeEventListener("afterprint", end);
    };
  }, []);
  return printing;
}

export function PrintSheet({ title, facts, content }: Props) {
  if (!usePrinting()) return null;
  const { across, body } = content();
  return createPortal(
    <section className={style.sheet} data-print data-across={across || undefined}>
      <header className={style.head}>
        <h1>
          <bdi>{title}</bdi>
        </h1>
        <dl>
          {facts.map(([name, value]) => (
            <div key={name}>
              <dt>{name}</dt>
              <dd>
                <bdi>{value}</bdi>
              </dd>
            </div>
          ))}
        </dl>
      </header>
      {body}
    </section>,
    document.body,
  );
}
