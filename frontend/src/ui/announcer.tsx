/** Announces events to screen readers by a polite live region, at a limited rate. */

import { useEffect, useState } from "react";
import { tick } from "../clock/server-clock";

const EVERY = 1500; // ms between two sentences
const MOST = 3; // things said in one sentence

/** Collects what is to be said and says it now and then. */
export class Announcer {
  #waiting: string[] = [];
  #timer: ReturnType<typeof setTimeout> | null = null;
  #saidAt = Number.NEGATIVE_INFINITY;
  #listener: (text: string) => void = () => {};

  /** Several in a short time become one sentence; what is said twice is said once. */
  say(text: string): void {
    this.#waiting = [...this.#waiting.filter((other) => other !== text), text];
    if (this.#timer !== null) return;
    const wait = Math.max(50, this.#saidAt + EVERY - tick());
    this.#timer = setTimeout(() => this.#flush(), wait);
  }

  /** Subscribe a listener that speaks the texts. Return the function that unsubscribes it. */
  onSay(listener: (text: string) => void): () => void {
    this.#listener = listener;
    return () => {
      if (this.#listener === listener) this.#listener = () => {};
    };
  }

  #flush(): void {
    this.#timer = null;
    this.#saidAt = tick();
    const said = this.#waiting.slice(-MOST);
    const more = this.#waiting.length - said.length;
    this.#waiting = [];
    this.#listener([...said, ...(more > 0 ? [`and ${more} more`] : [])].join(". "));
  }
}

export const announcer = new Announcer();

/** Reads out what `announcer` says, for screen readers; mounted once in the page. */
export function LiveRegion() {
  const [text, setText] = useState("");
  useEffect(() => announcer.onSay(setText), []);
  return (
    <div className="visually-hidden" role="status" aria-live="polite" aria-label="What happens">
      {text}
    </div>
  );
}
