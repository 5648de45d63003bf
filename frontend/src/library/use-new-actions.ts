/** Adds actions to the library, from a name, from graphs or from a robot, and deletes them. */
import { notifications } from "@mantine/notifications";
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { useLocation } from "wouter";
import { deleteGraph, type GraphSummary, refreshLibrary } from "../api/graphs";
import { errorText, Refusal } from "../api/http";
import { createAction } from "../api/library";
import { useLive } from "../api/page-link";
import type { RobotAction } from "../home/robot-actions";
import { takeFromRobot } from "../home/robot-actions";
import { isolated } from "../words/isolated";

/** Return whether the server refused a name that is taken. */
function isTaken(error: unknown): boolean {
  return error instanceof Refusal && error.details.status === 409;
}

/** Return the functions that add and delete actions, with their state. */
export function useNewActions() {
  const client = useQueryClient();
  const { runner } = useLive();
  const [, go] = useLocation();
  const [busy, setBusy] = useState(false);
  const [wrong, setWrong] = useState("");
  /** Makes and opens an action. Returns the reason for a failure, or an empty text. */
  const make = async (work: () => Promise<GraphSummary>, editing: boolean): Promise<string> => {
    setBusy(true);
    try {
      const { id } = await work();
      await refreshLibrary(client);
      go(`/actions/${id}${editing ? "?edit" : ""}`);
      return "";
    } catch (error) {
      return isTaken(error) ? "The library has an action of this name." : errorText(error);
    } finally {
      setBusy(false);
    }
  };
  const told = async (work: () => Promise<GraphSummary>) => {
    const message = await make(work, false);
    if (message !== "") notifications.show({ color: "red", title: "Not added", message });
  };
  const ask = async (name: string): Promise<boolean> => {
    const reason = await make(() => createAction(name), true);
    setWrong(reason);
    return reason === "";
  };
  const remove = async (id: string, name: string) => {
    try {
      await deleteGraph(id);
      notifications.show({
        title: `${isolated(name)} is deleted from the library`,
        message: "Graphs that use it do not change. You can restore it below the list.",
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
    make: ask,
    add: (name: string) => void told(() => createAction(name, true)),
    take: (has: RobotAction) => void told(() => takeFromRobot(runner, has)),
    remove: (id: string, name: string) => void remove(id, name),
    forget: () => setWrong(""),
  };
}
