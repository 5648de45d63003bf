/** Where messages appear. Its code is as large as that of a screen; what is told earlier waits for it. */
import { Notifications } from "@mantine/notifications";

export function Messages() {
  return <Notifications position="top-center" zIndex={350} className="toasts" />;
}
