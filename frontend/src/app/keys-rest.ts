/** Says that keys rest. Loaded when that is so for the first time. */
import { notifications } from "@mantine/notifications";
import { announcer } from "../ui/announcer";

export function tellKeysRest(): void {
  const message = "The field you typed in is gone. Press Escape or click, and keys work again.";
  notifications.show({ id: "keys-rest", message, autoClose: 6_000 });
  announcer.say(message);
}
