/**
 * Draws arrows by hand: by dragging from an outcome, by tapping an outcome and then a card, or by
 * moving an end of an arrow.
 */
import type { Connection, FinalConnectionState, OnConnectEnd } from "@xyflow/react";
import { type MouseEvent, useCallback, useEffect, useRef, useState } from "react";
import type { Arrow } from "../../canvas/elements";
import { nodeAt, pointOf } from "../../canvas/hit-test";
import type { EditorContext } from "../../edit-actions/editor-context";
import { connect, moveRelation, retarget } from "../../graph/edit";
import type { Key, Position, Precondition } from "../../graph/model";
import { ENTRY } from "../../graph/model";
import { keyOf } from "../../ui/keys";

export interface Pending {
  readonly key: Key;
  readonly outcome: Precondition;
}

/** Return the outcome of a handle by its id; the handle of the entry counts as `on_true`. */
export function outcomeOf(handle: string | null | undefined): Precondition {
  return handle === "on_false" || handle === "on_error" || handle === "on_stopped"
    ? handle
    : "on_true";
}

/** Return the outcome whose handle was hit; null if something else was. */
function outcomeHit(target: EventTarget): Pending | null {
  if (!(target instanceof Element)) return null;
  const handle = target.closest<HTMLElement>(".react-flow__handle.source");
  const key = handle?.dataset.nodeid;
  return handle && key !== undefined ? { key, outcome: outcomeOf(handle.dataset.handleid) } : null;
}

type AddAt = (screen: Position, from: Pending | null) => void;

/**
 * Return the handlers that draw and move arrows. `openAddAt`: opens the search for a new action at
 * a place.
 */
export function useConnecting(context: EditorContext, openAddAt: AddAt) {
  const { doc, select, mayEdit } = context;
  const [pending, setPending] = useState<Pending | null>(null);
  const draw = useCallback(
    (parent: Key, child: Key, outcome: Precondition) => {
      setPending(null); // drawing an arrow cancels an outcome that was tapped before
      const relation = mayEdit ? connect(doc, parent, child, outcome) : null;
      if (relation !== null) select([relation]);
    },
    [doc, select, mayEdit],
  );
  useEffect(() => {
    if (pending === null) return;
    const onKey = (event: KeyboardEvent) => {
      if (keyOf(event) === "Escape") setPending(null);
    };
    window.addEventListener("keydown", onKey, { capture: true });
    return () => window.removeEventListener("keydown", onKey, { capture: true });
  }, [pending]);

  // React Flow reports a moved end as a connection, too; it must not draw a second arrow.
  const leading = useRef(false);
  const onConnectEnd: OnConnectEnd = (event, state) => {
    if (leading.current) return;
    const from = state.fromHandle;
    if (state.isValid || !from || from.type !== "source") return;
    const point = pointOf(event);
    const outcome = outcomeOf(from.id);
    const target = nodeAt(point);
    if (target === null) {
      setPending(null);
      openAddAt(point, { key: from.nodeId, outcome });
    } else if (target !== from.nodeId) draw(from.nodeId, target, outcome);
  };

  /** Handles a click; returns true if it belonged to drawing an arrow. */
  const onClick = (event: MouseEvent): boolean => {
    if (!mayEdit) return false;
    const hit = outcomeHit(event.target);
    const point: Position = [event.clientX, event.clientY];
    const card = nodeAt(point);
    if (pending !== null) {
      setPending(null);
      if (hit && hit.key === pending.key && hit.outcome === pending.outcome) return true;
      if (card === null) openAddAt(point, pending);
      else draw(pending.key, card, pending.outcome);
      return true;
    }
    if (hit === null) return false;
    setPending(hit);
    return true;
  };

  // The arrows of one relation share their end, so moving it moves all of them; each has a start of
  // its own.
  const lead = ({ data }: Arrow, to: Parameters<typeof retarget>[3]) => {
    if (!data || !mayEdit) return;
    const whole = to.child === undefined ? null : moveRelation(doc, data.relation, to);
    const moved = whole ?? retarget(doc, data.relation, data.outcome, to);
    if (moved !== null) select([moved]);
  };
  /** Handles an end that was dropped on the handle of an outcome or an input. */
  const onReconnect = (edge: Arrow, to: Connection) =>
    lead(
      edge,
      to.target === edge.target
        ? {
            ...(to.source === edge.source ? {} : { parent: to.source }),
            ...(to.source === ENTRY ? {} : { outcome: outcomeOf(to.sourceHandle) }),
          }
        : { child: to.target },
    );
  const onReconnectStart = () => {
    leading.current = true;
  };
  /**
   * Handles an end that was dropped elsewhere: a card counts as its input; on empty canvas the
   * arrow stays.
   */
  const onReconnectEnd = (
    event: globalThis.MouseEvent | TouchEvent,
    edge: Arrow,
    fixed: "source" | "target",
    state: FinalConnectionState,
  ) => {
    leading.current = false;
    const card = state.isValid ? null : nodeAt(pointOf(event));
    if (card === null || card === edge.source || card === edge.target) return;
    lead(edge, fixed === "source" ? { child: card } : { parent: card });
  };

  return {
    pending,
    setPending,
    draw,
    onConnectEnd,
    onClick,
    onReconnect,
    onReconnectStart,
    onReconnectEnd,
  };
}
