// What the page knows about the robot; components redraw on changes, and cycles go to their listeners directly.
import { useEffect, useState } from "preact/hooks";
import { type Cycle, type DaemonEvent, type Description, NO_ANSWER, type Planned, Rejected, Right, type Status, follow, request } from "./daemon";
import { progressOf } from "./situation";

const KEPT_EVENTS = 60;
const KEPT_S = 30;

class Store {
  status: Status | null = null;
  description: Description | null = null;
  connected = false;
  events: DaemonEvent[] = [];
  /** Why the last request was rejected; "" if it was not. */
  rejected = "";
  /** The target that the user types or drags, in mm and deg; null if there is none. */
  target: string[] | null = null;
  /** The path that was planned last, or is planned now. */
  path: Planned | null = null;
  /** Whether a procedure of this page runs. */
  procedure = false;
  /** The speed of moves and steps, in percent of the robot's. */
  speed = 100;
  /** The program that runs or was stopped before its end; "" if it has ended. */
  interrupted = "";
  /** The cycles of the last `KEPT_S`, so that a view that is opened has curves. */
  readonly recent: Cycle[] = [];
  readonly right = new Right();
  readonly cycles = new Set<(cycle: Cycle) => void>();
  #listeners = new Set<() => void>();
  #asked = "";

  constructor() {
    this.right.changed = () => this.change();
    this.right.lost = (why) => (document.hidden || this.interrupted || this.procedure) && this.change({
      rejected: document.hidden
        ? "While this page was in the background, its browser slowed it down. So the page lost the right to move; a motion would have held. The next step takes the right again."
        : `This page has lost the right to move${why ? `: ${why}` : ""}. The next step takes it again.`,
    });
    follow({
      description: (value) => this.change({ description: value.axes ? value : null }), // empty while the loop starts
      status: (value) => this.#look(value),
      event: (value) => {
        const isRepeated = (one: DaemonEvent, place: number): boolean => place === 0 && value.times > 1 && one.text === value.text;
        const others = this.events.filter((one, place) => one.number !== value.number && !isRepeated(one, place));
        this.change({ events: [value, ...others].slice(0, KEPT_EVENTS) });
      },
      cycle: (value) => this.#keep(value),
      connected: (value) => {
        if (value === this.connected && value) return;
        const rejected = value && this.rejected === NO_ANSWER ? "" : this.rejected;
        this.change({ connected: value, rejected }); // a rejected key is shown although the page was not connected before
        if (value) void this.#earlierEvents();
      },
    });
  }

  change(values: Partial<Pick<Store, "status" | "description" | "events" | "connected" | "rejected" | "target" | "path" | "speed">> = {}): void {
    Object.assign(this, values);
    this.#listeners.forEach((listener) => listener());
  }

  #look(status: Status): void {
    this.right.seen = status.stop_count;
    const progress = progressOf(status);
    const moves = status.state === "active" && (progress.done ?? 1) < 1;
    if (document.hidden && (moves || this.procedure)) this.right.renew();
    if (status.state !== "active") this.interrupted = "";
    else if (status.program !== "hold") this.interrupted = (progress.done ?? 1) < 1 ? status.program ?? "" : "";
    const plan = progress.path?.plan;
    if (plan && plan !== this.#asked && plan !== this.path?.plan) {
      this.#asked = plan;
      void this.#planOf(plan);
    }
    this.change({ status });
  }

  /** Get the route of a path that another client has planned. */
  async #planOf(plan: string): Promise<void> {
    const path = await request<Planned>("GET", "/path").catch(() => null);
    if (path?.plan === plan) this.change({ path });
  }

  #keep(cycle: Cycle): void {
    const { recent } = this;
    if (recent.length && cycle.time_s < recent[recent.length - 1]!.time_s) recent.length = 0; // the loop has restarted
    recent.push(cycle);
    while (recent[0]!.time_s < cycle.time_s - KEPT_S) recent.shift();
    this.cycles.forEach((listener) => listener(cycle));
  }

  /** Get what happened before this page was opened, or while it had no connection. */
  async #earlierEvents(): Promise<void> {
    try {
      const { events } = await request<{ events: DaemonEvent[] }>("GET", "/events");
      this.change({ events: events.reverse().slice(0, KEPT_EVENTS) });
    } catch (error) {
      if (!(error instanceof Rejected)) throw error; // without the key they come from now on only
    }
  }

  listen(listener: () => void): () => void {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }

  /** Carry out a request and show why it was rejected, if it was. */
  async attempt(work: () => Promise<unknown>): Promise<void> {
    this.change({ rejected: "" });
    try {
      await work();
    } catch (error) {
      if (!(error instanceof Rejected)) throw error;
      this.change({ rejected: error.message });
    }
  }
}

export const store = new Store();

/** Redraw the calling component whenever the store changes. */
export function useStore(): Store {
  const [, redraw] = useState(0);
  useEffect(() => {
    const stop = store.listen(() => redraw((count) => count + 1));
    redraw((count) => count + 1); // something may have changed before
    return () => void stop();
  }, []);
  return store;
}

/** Call `listener` with each cycle while the calling component is shown. */
export function useCycles(listener: (cycle: Cycle) => void, on: unknown[]): void {
  useEffect(() => {
    store.cycles.add(listener);
    return () => void store.cycles.delete(listener);
  }, on);
}
