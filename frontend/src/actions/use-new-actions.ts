/** New actions of the library: from nothing, from what graphs know, from what a robot has. */
import { notifications } from "@mantine/notifications";
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { useLocation } from "wouter";
import { deleteGraph, type GraphSummary } from "../api/graphs";
import { errorText, Refusal } from "../api/http";
import { createAction, importAction, refreshLibrary } from "../api/library";
import { type RobotAction, robotActionText } from "../library/robot-actions";

/** There is one of that name already. */
function isTaken(error: unknown): boolean {
  return error instanceof Refusal && error.details.status === 409;
}

export function useNewActions() {
  const client = useQueryClient();
  const [, go] = useLocation();
  const [busy, setBusy] = useState(false);
  const [wrong, setWrong] = useState("");
  /** Opens what was made; answers whether anything was. */
  const make = async (work: () => Promise<GraphSummary>, editing: boolean): Promise<boolean> => {
    setBusy(true);
    setWrong("");
    try {
      const { id } = await work();
      await refreshLibrary(client);
      go(`/actions/${id}${editing ? "?edit" : ""}`);
      return true;
    } catch (error) {
      setWrong(isTaken(error) ? "The library has an action of this name." : errorText(error));
      return false;
    } finally {
      setBusy(false);
    }
  };
  const told = async (work: () => Promise<GraphSummary>) => {
    if (await make(work, false)) return;
    notifications.show({ color: "red", title: "Not added", message: "Look at the list again." });
  };
  const remove = async (id: string, name: string) => {
    try {
      await deleteGraph(id);
      notifications.show({
        title: `${name} is deleted from the library`,
        message: "Graphs keep what they use. It can be brought back below the list.",
      });
      go("/actions");
    } catch (error) {
      notifications.show({ color: "red", title: "Not deleted", message: errorText(error) });
    } finally {
      await refreshLibrary(client);
    }
  };
  return {
    busy,
    wrong,
    make: (name: string) => make(() => createAction(name), true),
    add: (name: string) => void told(() => createAction(name, true)),
    take: ({ action }: RobotAction) => void told(() => importAction(robotActionText(action))),
    remove: (id: string, name: string) => void remove(id, name),
    forget: () => setWrong(""),
  };
}
