// What the scope shows: curves of recorded quantities, the trigger, and figures between two cursors.
import { type Description, type Quantity, socketTo } from "./daemon";

const POSE = ["x", "y", "z", "qw", "qx", "qy", "qz"];
const POSE_POSITIONS = 3;
const UNITS: [string, string][] = [
  ["_rad_s", "rad/s"], ["_m_s", "m/s"], ["_rad", "rad"], ["_Nm", "Nm"], ["_N", "N"], ["_m", "m"], ["_ns", "ns"], ["_s", "s"],
];

export interface ScopeCurve {
  /** As in a table: `tension_N[left]`. */
  id: string;
  /** As the page shows it: "tension of left, N". */
  label: string;
  field: string;
  /** Place in the field's list, null for a single value. */
  index: number | null;
  unit: string;
  labels: Record<string, string> | null;
}

/** Return a field's name as text, without its unit. */
export const wordsOf = (field: string): string => {
  const unit = UNITS.find(([end]) => field.endsWith(end));
  return (unit ? field.slice(0, -unit[0].length) : field).replaceAll("_", " ");
};

const unitOf = (field: string): string => UNITS.find(([end]) => field.endsWith(end))?.[1] ?? "";

/** Return all curves of a quantity. */
export function curvesOf({ name, per, labels }: Quantity, description: Description): ScopeCurve[] {
  const shared = { field: name, labels: (labels as Record<string, string> | null) ?? null };
  const labelled = (words: string, unit: string): string => (unit ? `${words}, ${unit}` : words);
  if (per === "robot") return [{ ...shared, id: name, label: labelled(wordsOf(name), unitOf(name)), index: null, unit: unitOf(name) }];
  const places = per === "pose" ? POSE : description.axes.map((axis) => axis.name);
  return places.map((place, index) => {
    const unit = per === "axis" ? unitOf(name) : index < POSE_POSITIONS ? "m" : "";
    const words = per === "axis" ? `${wordsOf(name)} of ${place}` : `${place} of the ${wordsOf(name)}`;
    return { ...shared, id: `${name}[${place}]`, label: labelled(words, unit), index, unit };
  });
}

/** Return a number with up to six digits. */
export const figure = (value: number | null | undefined): string =>
  value == null ? "–" : value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6) ? value.toExponential(3).replace(/\.?0+e/, "e") : String(+value.toPrecision(6));

/** Times and the values of curves at them, oldest first. */
export interface Samples {
  time_s: number[];
  values: (number | null)[][];
}

/** Return the samples from one time to another. */
export function between({ time_s, values }: Samples, from_s: number, until_s: number): Samples {
  const first = placeOf(time_s, from_s), last = placeOf(time_s, until_s) + 1;
  return { time_s: time_s.slice(first, last), values: values.map((one) => one.slice(first, last)) };
}

/** Return the place of the first time that is not before `at_s`. */
export function placeOf(time_s: number[], at_s: number): number {
  let low = 0, high = time_s.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (time_s[middle]! < at_s) low = middle + 1;
    else high = middle;
  }
  return low;
}

export interface Trigger {
  mode: "off" | "edge" | "level";
  curve: string;
  level: number;
  /** Rising edge or above the level; otherwise falling or below. */
  rising: boolean;
  once: boolean;
}

const KEPT_S = 45;
const RATE_Hz = 20;
const GAP_S = 0.1;
/** Share of the window before the trigger. */
const BEFORE = 0.2;
const RETRY_MS = 1000;

/** Every cycle of some curves, as the loop runs; and the windows that a trigger selects. */
export class LiveFeed {
  samples: Samples;
  /** The time of the trigger whose window is shown, null without one. */
  triggered_s: number | null = null;
  /** Why the daemon sends nothing; "" if it does. */
  refused = "";
  #seen_s = -Infinity;
  #before: number | null = null;
  #socket: WebSocket | null = null;
  #ended = false;

  /** `before`: the feed that this one replaces; the samples of curves that both have are kept. */
  constructor(private curves: ScopeCurve[], before: LiveFeed | null, private arrived: () => void) {
    const time_s = before?.samples.time_s ?? [];
    const known = (id: string): (number | null)[] | undefined => before?.samples.values[before.curves.findIndex((one) => one.id === id)];
    this.samples = { time_s, values: curves.map(({ id }) => known(id) ?? time_s.map(() => null)) };
    void this.#follow();
  }

  close(): void {
    this.#ended = true;
    this.#socket?.close();
  }

  async #follow(): Promise<void> {
    const fields = [...new Set(["time_s", ...this.curves.map((one) => one.field)])].join();
    while (!this.#ended) {
      try {
        const socket = (this.#socket = await socketTo("/live", { rate_Hz: String(RATE_Hz), fields, all_cycles: "true" }));
        if (this.#ended) socket.close();
        await new Promise<void>((ended) => {
          socket.onmessage = ({ data }) => this.#take(JSON.parse(data as string));
          socket.onclose = ({ reason }) => {
            this.refused = reason;
            this.arrived();
            ended();
          };
        });
      } catch {
        // the daemon is away; tried again below
      }
      await new Promise((resume) => setTimeout(resume, RETRY_MS));
    }
  }

  #take(message: { kind: string; rows?: Record<string, number | null | (number | null)[]>[] }): void {
    if (message.kind !== "cycles" || this.#ended) return; // the next feed shares the times
    this.refused = "";
    const { time_s, values } = this.samples;
    for (const row of message.rows!) {
      const at_s = row["time_s"] as number;
      if (time_s.length && at_s <= time_s[time_s.length - 1]!) { // the loop has started again
        this.samples.time_s.length = 0;
        values.forEach((one) => (one.length = 0));
        this.rearm();
      }
      const last_s = time_s[time_s.length - 1];
      if (last_s !== undefined && at_s - last_s > GAP_S) { // no line joins what is on both sides of a gap
        time_s.push(last_s + 1e-6);
        values.forEach((one) => one.push(null));
      }
      time_s.push(at_s);
      this.curves.forEach(({ field, index }, number) => {
        const value = row[field] as number | null | (number | null)[];
        const one = index === null ? value : (value as (number | null)[])[index];
        values[number]!.push(one === null || one === undefined ? null : Number(one));
      });
    }
    const surplus = placeOf(time_s, time_s[time_s.length - 1]! - KEPT_S);
    if (surplus > time_s.length / 8) {
      time_s.splice(0, surplus);
      values.forEach((one) => one.splice(0, surplus));
    }
    this.arrived();
  }

  /** Wait for the next trigger, among samples that have not arrived yet. */
  rearm(): void {
    const { time_s } = this.samples;
    this.triggered_s = null;
    this.#seen_s = time_s[time_s.length - 1] ?? -Infinity;
    this.#before = null;
  }

  /** Return the window to show now, or null if the trigger has not selected one yet. */
  window(trigger: Trigger, span_s: number): [number, number] | null {
    const { time_s } = this.samples;
    const now_s = time_s[time_s.length - 1] ?? 0;
    const first_s = time_s[0] ?? 0;
    if (trigger.mode === "off") return now_s - first_s < span_s ? [first_s, first_s + span_s] : [now_s - span_s, now_s];
    const shown_s = this.triggered_s;
    if (shown_s === null || (!trigger.once && now_s >= shown_s + span_s * (1 - BEFORE))) {
      this.triggered_s = this.#next(trigger) ?? shown_s;
    }
    const at_s = this.triggered_s;
    return at_s === null ? null : [at_s - BEFORE * span_s, at_s + (1 - BEFORE) * span_s];
  }

  #next({ mode, curve, level, rising }: Trigger): number | null {
    const { time_s, values } = this.samples;
    const number = this.curves.findIndex((one) => one.id === curve);
    const data = values[number];
    if (!data) return null;
    const beyond = (value: number): boolean => (rising ? value >= level : value <= level);
    for (let k = placeOf(time_s, this.#seen_s + 1e-9); k < data.length; k++) {
      const value = data[k], before = this.#before;
      this.#seen_s = time_s[k]!;
      if (value === null || value === undefined) continue;
      this.#before = value;
      if (beyond(value) && (mode === "level" || (before !== null && !beyond(before)))) return time_s[k]!;
    }
    return null;
  }
}

export interface StepFigures {
  from: number;
  to: number;
  rise_s: number | null;
  overshoot: number;
  settling_s: number | null;
}

const SETTLED = 0.02;
const LEVELLED = 0.1;

const mean = (values: number[]): number => values.reduce((sum, one) => sum + one, 0) / values.length;

/** Return the figures of a step response between the ends of `samples`; null without a step. */
export function stepFigures({ time_s, values }: Samples, number: number): StepFigures | null {
  const known = time_s.map((at_s, k) => [at_s, values[number]?.[k]] as const).filter(([, one]) => one !== null && one !== undefined) as [number, number][];
  if (known.length < 10) return null;
  const from = known[0]![1];
  const to = mean(known.slice(-Math.ceil(LEVELLED * known.length)).map(([, one]) => one));
  const height = to - from;
  if (Math.abs(height) < 1e-12) return null;
  const share = known.map(([at_s, one]) => [at_s, (one - from) / height] as const);
  const reached = (level: number): number | null => share.find(([, one]) => one >= level)?.[0] ?? null;
  const low_s = reached(0.1), high_s = reached(0.9);
  const lastOutside = share.map(([, one]) => Math.abs(one - 1) > SETTLED).lastIndexOf(true);
  return {
    from,
    to,
    rise_s: low_s === null || high_s === null ? null : high_s - low_s,
    overshoot: Math.max(0, Math.max(...share.map(([, one]) => one)) - 1),
    settling_s: lastOutside + 1 < share.length ? share[lastOutside + 1]![0] - time_s[0]! : null,
  };
}

/** Return samples as CSV. */
export const asCsv = ({ time_s, values }: Samples, curves: ScopeCurve[]): string =>
  [["time_s", ...curves.map((one) => `"${one.id}"`)], ...time_s.map((at_s, k) => [at_s, ...values.map((one) => one[k] ?? "")])]
    .map((row) => row.join()).join("\n") + "\n";
