/** Notifications by the browser, for a page that is open and not looked at. */
import { Switch, Text } from "@mantine/core";
import { useEffect, useRef, useState } from "react";
import { useLocation } from "wouter";
import { useInbox } from "../api/mentions";
import { useLive } from "../api/page-link";
import { usePerson } from "../api/people";
import { useKept } from "../ui/hooks";
import { NewNotices, noticesOf } from "./notices";

const IS_POSSIBLE = "Notification" in window && window.isSecureContext;
const useWanted = () => useKept<readonly string[]>("aa.notify", []);

/** Notifies of new facts while the page is not looked at; mounted once. It shows nothing itself. */
export function Notifier() {
  const { person } = usePerson();
  const { now } = useLive();
  const { data: inbox, isFetched } = useInbox();
  const [wanted] = useWanted();
  const [, go] = useLocation();
  const news = useRef<{ who: string; notices: NewNotices } | null>(null);
  const isOn = IS_POSSIBLE && wanted.includes(person.id);
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
    if (!document.hidden || Notification.permission !== "granted") return;
    for (const { key, text, path } of fresh) {
      try {
        const shown = new Notification("TeMoto Action Assistant", { body: text, tag: key });
        shown.onclick = () => {
          window.focus();
          go(path);
          shown.close();
        };
      } catch {
        return; // some phones allow them to service workers only
      }
    }
  }, [now, inbox, isFetched, isOn, person.id, go]);
  return null;
}

/** The switch of one's own notifications on this device. */
export function NotificationSwitch() {
  const { person } = usePerson();
  const [wanted, setWanted] = useWanted();
  const [refused, setRefused] = useState(() => IS_POSSIBLE && Notification.permission === "denied");
  if (!IS_POSSIBLE) return null;
  const isOn = wanted.includes(person.id) && !refused;
  const others = wanted.filter((id) => id !== person.id);
  const change = async (on: boolean) => {
    if (!on) return setWanted(others);
    const answer = await Notification.requestPermission();
    setRefused(answer === "denied");
    if (answer === "granted") setWanted([...others, person.id]);
  };
  return (
    <div>
      <Switch
        label="Notify me while I look elsewhere"
        checked={isOn}
        onChange={(event) => void change(event.currentTarget.checked)}
      />
      {refused && (
        <Text size="sm" c="dimmed" mt={4}>
          This browser refuses notifications of this site. Allow them in its settings.
        </Text>
      )}
    </div>
  );
}
