// What the page knows about the robot; components redraw on changes, and cycles go to their listeners directly.
import { useEffect, useState } from "preact/hooks";
import { type Cycle, type DaemonEvent, type Description, Rejected, Right, type Status, follow, request } from "./daemon";

const KEPT_EVENTS = 60;

class Store {
  status: Status | null = null;
  description: Description | null = null;
  connected = false;
  events: DaemonEvent[] = [];
  /** Why the last request was rejected; "" if it was not. */
  rejected = "";
  /** Where a move would end that the user is typing. */
  preview: { position_m: number[]; rotation_rad: number[] } | null = null;
  readonly right = new Right();
  readonly cycles = new Set<(cycle: Cycle) => void>();
  #listeners = new Set<() => void>();

  constructor() {
    this.right.changed = () => this.change();
    follow({
      description: (value) => this.change({ description: value }),
      status: (value) => this.change({ status: value }),
      event: (value) => this.change({ events: [value, ...this.events.filter((one) => one.number !== value.number)].slice(0, KEPT_EVENTS) }),
      cycle: (value) => this.cycles.forEach((listener) => listener(value)),
      connected: (value) => {
        if (value === this.connected && value) return;
        this.change({ connected: value }); // a rejected key is shown although the page was not connected before
        if (value) void this.#earlierEvents();
      },
    });
  }

  change(values: Partial<Pick<Store, "status" | "description" | "events" | "connected" | "rejected" | "preview">> = {}): void {
    Object.assign(this, values);
    this.#listeners.forEach((listener) => listener());
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
