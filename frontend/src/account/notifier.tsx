/** Notifications by the browser, for a page that is open and not looked at. */
import { Switch, Text } from "@mantine/core";
import { useEffect, useRef, useState } from "react";
import { useLocation } from "wouter";
import { useInbox, useReadMentions } from "../api/mentions";
import { useLive } from "../api/page-link";
import { usePerson } from "../api/people";
import { useKept, useStableCallback } from "../ui/hooks";
import { NewNotices, type Notice, noticesOf } from "./notices";

const IS_POSSIBLE = "Notification" in window && window.isSecureContext;
const useWanted = () => useKept<readonly string[]>("aa.notify", []);

const LOOKED = "aa.looked"; // a lock that each page of this browser holds while somebody looks at it

function useLooked(on: boolean): void {
  useEffect(() => {
    if (!on) return;
    let letGo = () => {};
    const look = () => {
      letGo();
      if (document.hidden) return;
      const end = new Promise<void>((done) => {
        letGo = done;
      });
      void navigator.locks.request(LOOKED, { mode: "shared" }, () => end);
    };
    look();
    window.addEventListener("visibilitychange", look);
    return () => {
      window.removeEventListener("visibilitychange", look);
      letGo();
    };
  }, [on]);
}

async function isLookedAt(): Promise<boolean> {
  if (!document.hidden) return true;
  const { held = [] } = await navigator.locks.query();
  return held.some(({ name }) => name === LOOKED);
}

/** Notifies of new facts while no page of this browser is looked at; mounted once. It shows nothing itself. */
export function Notifier() {
  const { person } = usePerson();
  const { now } = useLive();
  const { data: inbox, isFetched } = useInbox();
  const read = useReadMentions();
  const [wanted, setWanted] = useWanted();
  const [, go] = useLocation();
  const news = useRef<{ who: string; notices: NewNotices } | null>(null);
  const isOn = IS_POSSIBLE && wanted.includes(person.id);
  useLooked(isOn);
  const show = useStableCallback(({ key, text, path, mention }: Notice) => {
    try {
      const shown = new Notification("TeMoto Action Assistant", { body: text, tag: key });
      shown.onclick = () => {
        window.focus();
        go(path);
        if (mention !== undefined) read.mutate([mention]);
        shown.close();
      };
    } catch {
      // Some phones allow them to service workers only: the switch does not say otherwise.
      setWanted(wanted.filter((id) => id !== person.id));
    }
  });
  useEffect(() => {
    if (!isOn) {
      news.current = null;
      return;
    }
    if (now.link !== "live" || !isFetched) return;
    const found = noticesOf(now, inbox);
    // What was so before somebody came in, or asked for this, is no news to them.
    if (news.current?.who !== person.id) {
      news.current = { who: person.id, notices: new NewNotices(found) };
    }
    const fresh = news.current.notices.take(found);
    if (fresh.length === 0 || Notification.permission !== "granted") return;
    void isLookedAt().then((looked) => {
      if (!looked) for (const notice of fresh) show(notice);
    });
  }, [now, inbox, isFetched, isOn, person.id, show]);
  return null;
}

/** The switch of one's own notifications on this device. The browser is asked when it is switched on. */
export function NotificationSwitch() {
  const { person } = usePerson();
  const [wanted, setWanted] = useWanted();
  const [permission, setPermission] = useState(() =>
    IS_POSSIBLE ? Notification.permission : "denied",
  );
  if (!IS_POSSIBLE) return null;
  const isWanted = wanted.includes(person.id);
  const others = wanted.filter((id) => id !== person.id);
  const change = async (on: boolean) => {
    if (!on) return setWanted(others);
    const answer = await Notification.requestPermission();
    setPermission(answer);
    if (answer === "granted") setWanted([...others, person.id]);
  };
  return (
    <div>
      <Switch
        label="Notify me while I look elsewhere"
        checked={isWanted && permission === "granted"}
        onChange={(event) => void change(event.currentTarget.checked)}
      />
      {permission === "denied" && (
        <Text size="sm" c="dimmed" mt={4}>
          This browser refuses notifications of this site. Allow them in its settings.
        </Text>
      )}
    </div>
  );
}
