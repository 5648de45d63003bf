/** Docks: the places where lines leave and enter cards, and where their pills stand. Pure. */
import { BoxIndex, boxOf, type FlowBox, type Scene, type SceneLine, STEP } from "./scene";

/**
 * Coordinates along the direction of the graph are `u` and `column`, across it `v` and `row`; rows
 * and columns count steps of the grid.
 */
export interface Dock {
  readonly line: SceneLine;
  /** The place at which the line leaves the side of its card. */
  readonly from: { readonly u: number; readonly v: number };
  /** The point after which the line may turn. */
  readonly start: { readonly column: number; readonly row: number };
  /** The point from which the line leads straight to the side of the card that it enters. */
  readonly end: { readonly column: number; readonly row: number };
  readonly to: { readonly u: number; readonly v: number };
  /** The box of the pill; null if there is no room for it beside the card. */
  readonly pill: FlowBox | null;
  /** The piece along the card to a pill beyond its corner. */
  readonly link: FlowBox | null;
  /** Lines with the same end may lie on each other, and so may lines with the same start. */
  readonly sharesStart: string;
  readonly sharesEnd: string;
}

/** px from a card to its pill. */
const PILL_GAP = 8;
/** px that a pill can move away from its card, to make room for ports. */
export const PILL_PLAY = 12;
const AFTER_PILL = 2;
/** px of straight line before a card: the head of the arrow and some more. */
const APPROACH = 16;
const BESIDE_PILL = 3;
/** px from a card to the piece of a line that leads along it. */
export const LINK = 4;
/** More lines than this leave a card without pills beside it: nobody could read them. */
const MOST_DOCKED = 40;
/** px across that a line without a pill takes beside those that have one. */
const BARE = 8;

interface End {
  readonly box: FlowBox & { key: string };
  /** First and last row of the grid that a line may use, in the middle of the side. */
  readonly low: number;
  readonly high: number;
}

interface Slot {
  readonly wish: number;
  readonly weight: number;
  /** The least number of rows to the previous slot. */
  readonly gap: number;
}

/**
 * Return distinct rows for slots in their order, as close to their wishes as possible. `low` to
 * `high` is the side of the card; up to `beyond` rows outside of it cost more. Null if the slots do
 * not fit.
 */
function rowsFor(slots: readonly Slot[], low: number, high: number, beyond: number) {
  const [first, count] = [low - beyond, high - low + 1 + 2 * beyond];
  const best: { cost: Float64Array; from: Int32Array }[] = [];
  for (const [i, { wish, weight, gap }] of slots.entries()) {
    const cost = new Float64Array(count).fill(Number.POSITIVE_INFINITY);
    const from = new Int32Array(count).fill(-1);
    const before = best[i - 1];
    let cheapest = -1;
    for (let at = 0; at < count; at += 1) {
      if (before) {
        const next = at - gap;
        if (next >= 0 && (cheapest < 0 || cost_(before, next) < cost_(before, cheapest)))
          cheapest = next;
        if (cheapest < 0) continue;
      }
      const row = first + at;
      const outside = Math.max(0, low - row, row - high);
      const here = weight * Math.abs(row - wish) + 3 * outside;
      cost[at] = here + (before ? cost_(before, cheapest) : 0);
      from[at] = cheapest;
    }
    best.push({ cost, from });
  }
  const last = best.at(-1);
  if (!last) return [];
  let at = last.cost.reduce((least, cost, i, all) => (cost < (all[least] ?? 0) ? i : least), 0);
  if (last.cost[at] === Number.POSITIVE_INFINITY) return null;
  const rows: number[] = [];
  for (let i = best.length - 1; i >= 0; i -= 1) {
    rows.unshift(first + at);
    at = best[i]?.from[at] ?? 0;
  }
  return rows;
}

const cost_ = ({ cost }: { cost: Float64Array }, at: number) =>
  cost[at] ?? Number.POSITIVE_INFINITY;

/** Return rows for slots; where they do not fit, neighbours share a row. */
function slotRows(slots: readonly Slot[], { low, high }: End, beyond = 0): number[] {
  const wide = rowsFor(slots, low, high, beyond);
  if (wide) return wide;
  const close = rowsFor(
    slots.map((slot) => ({ ...slot, gap: 1 })),
    low,
    high,
    0,
  );
  return close ?? slots.map((_, i) => low + Math.floor((i * (high - low + 1)) / slots.length));
}

/** A line whose docks are being computed. */
interface DockDraft {
  readonly line: SceneLine;
  readonly order: number;
  readonly source: End;
  readonly target: End;
  /** Its target lies before its source. */
  readonly back: boolean;
  into: number;
}

const center = (end: End) => (end.box.v0 + end.box.v1) / 2;

/** Return the row on which a line between two cards would be straight; null if there is none. */
function straightRow(a: End, b: End): number | null {
  const [low, high] = [Math.max(a.low, b.low), Math.min(a.high, b.high)];
  return low <= high ? Math.round((low + high) / 2) : null;
}

/**
 * Rank of lines that lead back to a card in the same row: they leave and enter at the same side,
 * after all others.
 */
const ASIDE = 1e6;

/**
 * Modes in which pills are tried: such that lines are straight, then centred on the side of the
 * card, then without pills.
 */
type Docking = "straight" | "centred" | "bare";

/** Chooses the docks of all lines of a scene: first where lines enter cards, then where they leave them. */
export class DockPlan {
  private readonly ends = new Map<string, End>();
  private readonly cards = new BoxIndex<FlowBox & { key: string }>();
  private readonly pills = new BoxIndex<FlowBox>();
  private readonly approaches = new BoxIndex<FlowBox>();
  /** Boxes in which lines leave the cards. */
  private readonly exits = new BoxIndex<FlowBox>();
  private readonly exitOf = new Map<string, FlowBox>();
  private readonly offset: number;
  readonly docks: readonly Dock[];

  constructor(scene: Scene) {
    this.offset = scene.offset;
    for (const card of scene.cards) {
      const box = { ...boxOf(card, scene.direction), key: card.key };
      this.cards.add(box);
      this.ends.set(card.key, this.endOf(box));
    }
    const drafts = scene.lines.flatMap((line, order) => this.draft(line, order) ?? []);
    for (const [, lines] of grouped(drafts, ({ line }) => line.target))
      this.enter(lines, scene.direction);
    for (const draft of drafts) this.approaches.add(this.approach(draft));
    for (const key of new Set(drafts.map(({ line }) => line.source))) this.addExit(key);
    const docks: Dock[] = [];
    for (const [, lines] of grouped(drafts, ({ line }) => line.source))
      docks.push(...this.leave(lines, scene.direction));
    const order = new Map(scene.lines.map(({ id }, i) => [id, i]));
    this.docks = docks.sort((a, b) => (order.get(a.line.id) ?? 0) - (order.get(b.line.id) ?? 0));
  }

  private addExit(key: string): void {
    const box = this.ends.get(key)?.box;
    if (!box) return;
    const exit = { ...box, u0: box.u1, u1: box.u1 + APPROACH };
    this.exitOf.set(key, exit);
    this.exits.add(exit);
  }

  /** Return the place of a row of the grid across the direction, px. */
  v(row: number): number {
    return row * STEP + this.offset;
  }

  private endOf(box: FlowBox & { key: string }): End {
    const side = box.v1 - box.v0;
    // Two lines that enter a low end, as the exit is, find two rows wherever the grid lies.
    const inset = Math.min(12, side * 0.2, Math.max(2, (side - 2 * STEP) / 2));
    const row = (v: number) => (v - this.offset) / STEP;
    const [low, high] = [Math.ceil(row(box.v0 + inset)), Math.floor(row(box.v1 - inset))];
    if (low <= high) return { box, low, high };
    const middle = Math.round(row((box.v0 + box.v1) / 2));
    return { box, low: middle, high: middle };
  }

  private draft(line: SceneLine, order: number): DockDraft | null {
    const [source, target] = [this.ends.get(line.source), this.ends.get(line.target)];
    if (!source || !target) return null;
    const back = target.box.u0 < source.box.u1 + APPROACH;
    return { line, order, source, target, back, into: 0 };
  }

  /** Choose the rows on which lines enter one card. */
  private enter(lines: DockDraft[], direction: Scene["direction"]): void {
    const rank = ({ source, target, back }: DockDraft) =>
      back && straightRow(source, target) !== null ? ASIDE : center(source);
    lines.sort((a, b) => rank(a) - rank(b) || a.order - b.order);
    const [first] = lines;
    if (!first) return;
    const room = first.target.high - first.target.low + 1;
    const gap = lines.length * 2 - 1 <= room ? 2 : 1;
    // Lines between the same two cards are as far apart as their pills, so that they can be
    // straight.
    const apart = lines.map(({ line }, i) => {
      const before = lines[i - 1]?.line;
      return before?.source === line.source
        ? Math.max(gap, rowsBetween(before, line, direction))
        : gap;
    });
    const fits = apart.slice(1).reduce((sum, rows) => sum + rows, 1) <= room;
    const middle = Math.round((first.target.low + first.target.high) / 2);
    const slots = lines.map((draft, i) => {
      const straight = draft.back ? null : straightRow(draft.source, draft.target);
      const own = { gap: fits ? (apart[i] ?? gap) : gap };
      return straight === null
        ? { wish: middle + (i - (lines.length - 1) / 2) * gap, weight: 1, ...own }
        : { wish: straight, weight: 8, ...own };
    });
    const rows = slotRows(slots, first.target);
    for (const [i, draft] of lines.entries()) draft.into = rows[i] ?? middle;
  }

  private approach(draft: DockDraft): FlowBox {
    const v = this.v(draft.into);
    return { u0: endColumn(draft) * STEP, u1: draft.target.box.u0, v0: v, v1: v + 0.1 };
  }

  /** Choose the rows on which lines leave one card, and the boxes of their pills. */
  private leave(
    lines: DockDraft[],
    direction: Scene["direction"],
    docks: Docking = lines.length <= MOST_DOCKED ? "straight" : "bare",
  ): Dock[] {
    const docked = docks !== "bare";
    const rank = ({ source, target, back, into }: DockDraft) =>
      back && straightRow(source, target) !== null ? ASIDE : back ? center(target) : this.v(into);
    lines.sort((a, b) => rank(a) - rank(b) || a.order - b.order);
    const [first] = lines;
    if (!first) return [];
    const { source } = first;
    const middle = Math.round((source.low + source.high) / 2);
    const gaps = lines.map(({ line }, i) => {
      const before = lines[i - 1]?.line;
      return before ? rowsBetween(before, line, direction) : 1;
    });
    const total = gaps.slice(1).reduce((sum, gap) => sum + gap, 0);
    let at = middle - total / 2;
    const slots = lines.map((draft, i) => {
      at += i === 0 ? 0 : (gaps[i] ?? 1);
      const inside = draft.into >= source.low && draft.into <= source.high;
      const straight = docks !== "centred" && !draft.back && inside;
      const gap = gaps[i] ?? 1;
      return straight ? { wish: draft.into, weight: 8, gap } : { wish: at, weight: 1, gap };
    });
    const beyond = docked && lines.some(({ line }) => line.pill !== null) ? total : 0;
    const rows = slotRows(slots, source, beyond);
    const pills = lines.map(({ line }, i) => {
      const v = this.v(rows[i] ?? middle);
      return docked && line.pill ? this.pillBox(source.box.u1, v, line.pill, direction) : null;
    });
    // All pills or none: a line without a pill would leave between those of the others.
    if (docked && !pills.every((pill) => pill === null || this.isFree(pill, source)))
      return this.leave(lines, direction, docks === "straight" ? "centred" : "bare");
    if (docked) for (const pill of pills) if (pill) this.pills.add(pill);
    return lines.map((draft, i) => dockOf(draft, rows[i] ?? middle, pills[i] ?? null, this));
  }

  private pillBox(
    side: number,
    v: number,
    size: { width: number; height: number },
    direction: string,
  ) {
    const [along, across] =
      direction === "right" ? [size.width, size.height] : [size.height, size.width];
    const u0 = side + PILL_GAP;
    return { u0, u1: u0 + along, v0: v - across / 2, v1: v + across / 2 };
  }

  /**
   * Return whether a pill has room at its place, to move by PILL_PLAY, and for its line to turn
   * behind it.
   */
  private isFree(pill: FlowBox, { box }: End): boolean {
    const reach = { ...pill, u0: box.u1, u1: startColumn(pill, box.u1) * STEP };
    return (
      !this.cards.hits(reach, BESIDE_PILL, box) &&
      !this.exits.hits(reach, BESIDE_PILL, this.exitOf.get(box.key)) &&
      !this.pills.hits(reach, BESIDE_PILL) &&
      !this.approaches.hits(reach, BESIDE_PILL)
    );
  }
}

/** Return the number of rows that the pills of two neighbouring lines need between them. */
function rowsBetween(a: SceneLine, b: SceneLine, direction: Scene["direction"]): number {
  const across = ({ pill }: SceneLine) =>
    pill === null ? BARE : direction === "right" ? pill.height : pill.width;
  return Math.max(1, Math.ceil(((across(a) + across(b)) / 2 + BESIDE_PILL) / STEP));
}

const endColumn = ({ target }: DockDraft) => Math.floor((target.box.u0 - APPROACH) / STEP);

const between = (a: number, b: number) => ({ v0: Math.min(a, b), v1: Math.max(a, b) });

const startColumn = (pill: FlowBox | null, side: number) =>
  Math.ceil((pill ? pill.u1 + PILL_PLAY + AFTER_PILL : side + 4) / STEP);

function dockOf(
  draft: DockDraft,
  row: number,
  pill: FlowBox | null,
  plan: Pick<DockPlan, "v">,
): Dock {
  const { line, source, target, into } = draft;
  const side = source.box.u1;
  const column = startColumn(pill, side);
  const at = Math.max(source.low, Math.min(source.high, row));
  return {
    line,
    from: { u: side, v: plan.v(at) },
    start: { column, row },
    end: { column: endColumn(draft), row: into },
    to: { u: target.box.u0, v: plan.v(into) },
    pill,
    link: at === row ? null : { u0: side, u1: side + LINK, ...between(plan.v(at), plan.v(row)) },
    sharesStart: `${line.source} ${column} ${row}`,
    sharesEnd: `${line.target} ${into}`,
  };
}

function grouped<T>(items: readonly T[], key: (item: T) => string): Map<string, T[]> {
  const groups = new Map<string, T[]>();
  for (const item of items) {
    const group = groups.get(key(item));
    if (group) group.push(item);
    else groups.set(key(item), [item]);
  }
  return groups;
}
