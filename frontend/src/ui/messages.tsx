/**
 * Shows notifications. This code is as large as that of a screen; earlier messages wait until it is
 * loaded.
 */
import { Notifications, notifications } from "@mantine/notifications";
import { announcer } from "./announcer";

export function Messages() {
  return <Notifications position="top-center" zIndex={350} className="toasts" />;
}

export function tellKeysRest(): void {
  const message = "The field you typed in is gone. Press Escape or click, and keys work again.";
  notifications.show({ id: "keys-rest", message, autoClose: 6_000 });
  announcer.say(message);
}
