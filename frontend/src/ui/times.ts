/** Times in words. All instants are milliseconds since 1970. */

import { useEffect, useState } from "react";
import { serverNow, tick } from "../clock/server-clock";

export function instant(text: string | null | undefined): number | null {
  if (!text) return null;
  const at = Date.parse(text);
  return Number.isNaN(at) ? null : at;
}

/** Return a duration of ms in words, as `0.4 s`, `12.4 s`, `1:12` or `2:05:00`. */
export function duration(ms: number): string {
  const whole = Math.max(0, ms);
  if (whole < 60_000) return `${(whole / 1000).toFixed(1)} s`;
  const s = Math.floor(whole / 1000);
  const two = (n: number) => String(n).padStart(2, "0");
  const hours = Math.floor(s / 3600);
  const minutes = Math.floor(s / 60) % 60;
  return hours > 0 ? `${hours}:${two(minutes)}:${two(s % 60)}` : `${minutes}:${two(s % 60)}`;
}

/** Return a duration (ms) that goes on, in whole seconds, so that it does not flicker. */
export function stopwatch(ms: number): string {
  const s = Math.max(0, Math.floor(ms / 1000));
  return `${Math.floor(s / 60)}:${String(s % 60).padStart(2, "0")}`;
}

// Made once: each formatter costs more than what it formats, and clocks are drawn with every event.
const clockFormat = new Intl.DateTimeFormat(undefined, {
  hour: "2-digit",
  minute: "2-digit",
  second: "2-digit",
  hour12: false,
});

export function clock(at: number): string {
  return clockFormat.format(at);
}

const minuteFormat = new Intl.DateTimeFormat(undefined, {
  hour: "2-digit",
  minute: "2-digit",
  hour12: false,
});

/** Return a time of day without seconds, as `14:02`. */
export function hourMinute(at: number): string {
  return minuteFormat.format(at);
}

export function ago(at: number, now: number): string {
  const s = Math.max(0, Math.round((now - at) / 1000));
  if (s < 5) return "just now";
  if (s < 60) return `${s} s ago`;
  if (s < 3600) return `${Math.floor(s / 60)} min ago`;
  if (s < 86_400) return `${Math.floor(s / 3600)} h ago`;
  return day(at, now);
}

/** Return a date with its year, as `22 Nov 2026`, for what is read on any day. */
export function dateText(at: number): string {
  return new Date(at).toLocaleDateString(undefined, {
    day: "numeric",
    month: "short",
    year: "numeric",
  });
}

/** Return a day in words, as `today`, `yesterday` or `Mon 3 Nov`. */
export function day(at: number, now: number): string {
  const midnight = (t: number) => new Date(t).setHours(0, 0, 0, 0);
  const days = Math.round((midnight(now) - midnight(at)) / 86_400_000);
  if (days === 0) return "today";
  if (days === 1) return "yesterday";
  const far = days > 300 ? ({ year: "numeric" } as const) : {};
  return new Date(at).toLocaleDateString(undefined, {
    weekday: "short",
    day: "numeric",
    month: "short",
    ...far,
  });
}

/**
 * A moment, renewed every `every` ms while `going`. All that shows it is renewed at whole multiples, so
 * that it is drawn together.
 */
function useRenewed(read: () => number, every: number, going: boolean): number {
  const [now, setNow] = useState(read);
  useEffect(() => {
    if (!going) return;
    let timer: ReturnType<typeof setTimeout>;
    const renew = () => {
      const present = read();
      setNow(present);
      timer = setTimeout(renew, every - (present % every));
    };
    renew();
    return () => clearTimeout(timer);
  }, [read, every, going]);
  return now;
}

/** The present by the server's clock, ms since 1970: to be compared with what the server tells. */
export function useNow(every = 1000, going = true): number {
  return useRenewed(serverNow, every, going);
}

/** The present as a tick: to be compared with moments of this page. */
export function useTick(every = 1000, going = true): number {
  return useRenewed(tick, every, going);
}
