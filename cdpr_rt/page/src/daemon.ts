// The daemon's interface: requests with the key, live figures, and the right to move.
import { keepKey, takeKey } from "./address";
import type { components, paths } from "./api";

export type Status = components["schemas"]["Status"];
export type Job = components["schemas"]["ProcedureJob"];
export type Curves = components["schemas"]["Curves"];
export type ProcedureRequest = NonNullable<paths["/procedure"]["post"]["requestBody"]>["content"]["application/json"];
/** A procedure's values, without the name of the client. */
export type Wanted = ProcedureRequest extends infer One ? (One extends unknown ? Omit<One, "client"> : never) : never;
export type Border = components["schemas"]["Border"];
export type Planned = components["schemas"]["Planned"];
export type DaemonEvent = components["schemas"]["Event"];
export type Quantity = components["schemas"]["Quantity"];
export type RecordingFile = components["schemas"]["Recording"];
export type Columns = components["schemas"]["Columns"];
export type Drives = components["schemas"]["Drives"];
export type DriveObject = components["schemas"]["DriveObject"];
type Path = keyof paths | `/recordings/${string}`;

export const NO_ANSWER = "The daemon does not answer. Is `cdpr run` still running?";

/** A request that the daemon rejected, or that did not reach it. */
export class Rejected extends Error {}

/** What the description says about a platform; positions have two coordinates in a plane. */
export interface Platform {
  home_m: number[];
  workspace_min_m: number[];
  workspace_max_m: number[];
  workspace_angle_rad: number;
  exit_points_m: number[][];
  anchor_points_m: number[][];
  controlled: string[];
  body: { min_m: number[]; max_m: number[] } | null;
  obstacles: { min_m: number[]; max_m: number[] }[];
  speed_m_s: number;
  poses_m: Record<string, number[]>;
}

export interface Description {
  robot: string;
  axes: { name: string; motor: string }[];
  limits: { tension_min_N: (number | null)[]; tension_max_N: (number | null)[] };
  programs: string[];
  platform: Platform | null;
  simulated: boolean;
}

/** One cycle, reduced to what the page shows. */
export interface Cycle {
  time_s: number;
  tension_N: (number | null)[];
  tension_measured: boolean[];
  /** x, y, z in m, then the quaternion w, x, y, z. */
  pose: (number | null)[];
  pose_setpoint: (number | null)[];
}

const FIELDS = "time_s,tension_N,tension_measured,pose,pose_setpoint";
const RATE_Hz = 30;
const RETRY_MS = 1000, RETRY_WITHOUT_KEY_MS = 10_000;
const SILENT_MS = 4000;
const UNAUTHORIZED = 401;

let key = takeKey();

export const hasKey = (): boolean => key !== "";

export function setKey(text: string): void {
  key = text;
  keepKey(text);
}

export async function request<T>(
  method: "GET" | "POST" | "PUT" | "DELETE", path: Path, body?: unknown, more: Record<string, string> = {}, signal: AbortSignal | null = null,
): Promise<T> {
  const headers = { ...more };
  if (key) headers["Authorization"] = `Bearer ${key}`;
  if (body !== undefined) headers["Content-Type"] = "application/json";
  let answer: Response;
  try {
    answer = await fetch(path, { method, headers, signal, body: body === undefined ? null : JSON.stringify(body) });
  } catch {
    throw new Rejected(NO_ANSWER);
  }
  if (answer.status === UNAUTHORIZED) setKey(""); // the key of an earlier run: ask for the present one
  const text = await answer.text();
  if (answer.ok) return JSON.parse(text) as T;
  let why = text;
  try {
    why = (JSON.parse(text) as { error: string }).error;
  } catch {
    // an answer that is not JSON is shown as it is
  }
  throw new Rejected(why);
}

/**
 * Call `look` at once and `pause_ms` after each of its ends; return what ends it.
 *
 * Slow answers do not pile up: they would occupy all connections of the browser, and a stop would wait for one.
 */
export function repeat(look: () => Promise<unknown>, pause_ms: number): () => void {
  let on = true;
  void (async () => {
    while (on) {
      await look();
      await new Promise((resume) => setTimeout(resume, pause_ms));
    }
  })();
  return () => void (on = false);
}

export async function socketTo(path: string, query: Record<string, string>): Promise<WebSocket> {
  if (key) query["ticket"] = (await request<{ ticket: string }>("POST", "/ticket")).ticket;
  return new WebSocket(`ws://${location.host}${path}?${new URLSearchParams(query)}`);
}

export interface LiveListener {
  description(value: Description): void;
  status(value: Status): void;
  event(value: DaemonEvent): void;
  cycle(value: Cycle): void;
  connected(value: boolean): void;
}

interface Answer { kind?: "taken" | "reply"; ok: boolean; error: string | null }

let live: WebSocket | null = null;
let stops = 0;
const stopping = new Map<number, (answer: Answer) => void>();
const later = (ms: number): Promise<null> => new Promise((resume) => setTimeout(resume, ms, null));
const SOON_MS = 300;

/**
 * Stop over the open connection, on which nothing waits; without an answer also by a request.
 *
 * All pages of a browser share six connections for requests, which others may occupy for minutes.
 */
export async function stop(what: "hold" | "disable"): Promise<void> {
  const id = ++stops, order = { client: clientName() }, socket = live;
  const open = socket?.readyState === WebSocket.OPEN;
  const closed = new Promise<null>((resolve) => socket?.addEventListener("close", () => resolve(null)));
  let take = (): void => {}, reply = (_: Answer): void => {};
  const taken = new Promise<true>((resolve) => (take = () => resolve(true)));
  const answered = new Promise<Answer>((resolve) => (reply = resolve));
  stopping.set(id, (answer) => (answer.kind === "taken" ? take() : reply(answer)));
  const asking = new AbortController();
  try {
    if (open) socket!.send(JSON.stringify({ ...order, do: what, id }));
    const heard = open && (await Promise.race([taken, answered, later(SOON_MS)]));
    const ended = heard ? closed : request("POST", `/${what}`, order, {}, asking.signal).then(() => null);
    const answer = await Promise.race([answered, ended]);
    if (answer && !answer.ok) throw new Rejected(answer.error ?? "refused");
  } finally {
    asking.abort(); // a request that still waits for a connection must not stop a later motion
    stopping.delete(id);
  }
}

/** Follow the daemon for as long as the page is open; a lost connection is tried again. */
export function follow(listener: LiveListener): void {
  void (async () => {
    for (;;) {
      try {
        await watch(await socketTo("/live", { rate_Hz: String(RATE_Hz), fields: FIELDS }), listener);
      } catch {
        // tried again below
      }
      listener.connected(false);
      await new Promise((resume) => setTimeout(resume, key ? RETRY_MS : RETRY_WITHOUT_KEY_MS));
    }
  })();
}

function watch(socket: WebSocket, listener: LiveListener): Promise<void> {
  return new Promise((ended) => {
    let heard = Date.now();
    live = socket;
    const watching = setInterval(() => {
      if (Date.now() - heard > SILENT_MS) socket.close();
    }, RETRY_MS);
    socket.onmessage = ({ data }) => {
      heard = Date.now();
      const message = JSON.parse(data as string);
      if (message.kind === "cycle") listener.cycle(message);
      else if (message.kind === "status") listener.status(message.status);
      else if (message.kind === "event") listener.event(message.event);
      else if (message.kind === "reply" || message.kind === "taken") stopping.get(message.id)?.(message);
      else if (message.kind === "description") listener.description(message.description);
      listener.connected(true);
    };
    socket.onclose = () => {
      clearInterval(watching);
      ended();
    };
  });
}

const TTL_S = 2;
const RENEW_MS = 500;
/** A step is not carried out if the right to move came later than this: the operator may have moved on. */
const LATE_MS = 5000;

/**
 * The right to move, held for as long as its connection lives.
 *
 * If this page is closed or goes silent for `TTL_S`, the daemon brakes the robot and holds it. A browser slows down the
 * timers of a page in the background; `renew` keeps the right there while something of it runs.
 */
export class Right {
  #socket: WebSocket | null = null;
  #token = "";
  #number = 0;
  #stops = 0;
  #renewed = 0;
  #taking: Promise<void> | null = null;
  #waiting = new Map<number, (answer: Answer) => void>();
  /** The number of stops that this page knows; a later one cancels a step that is on its way. */
  seen = 0;
  changed: () => void = () => undefined;
  lost: (why: string) => void = () => undefined;

  get held(): boolean {
    return this.#token !== "";
  }

  /** Cancel this page's steps that still wait for the right. */
  cancel(): void {
    this.#stops++;
  }

  /**
   * Take the right for a step; return the number of stops before it.
   *
   * Throws `Rejected` with the holder's name, or if the step came too late or was stopped.
   */
  async #takeForStep(): Promise<number> {
    const { seen } = this;
    if (this.held) return seen;
    const stops = this.#stops, began = performance.now();
    this.#taking ??= this.#take().finally(() => (this.#taking = null));
    await this.#taking;
    if (this.#stops !== stops) throw new Rejected("Cancelled: you have stopped the robot.");
    if (performance.now() - began > LATE_MS) throw new Rejected("The daemon answered late, so nothing was started. Try again.");
    return seen;
  }

  async #take(): Promise<void> {
    const socket = await socketTo("/control", { client: clientName(), ttl_s: String(TTL_S) });
    await new Promise<void>((taken, failed) => {
      socket.onmessage = ({ data }) => {
        const message = JSON.parse(data as string);
        if (message.kind === "held") {
          this.#token = message.token;
          this.#socket = socket;
          this.changed();
          taken();
        } else {
          this.#waiting.get(message.id)?.(message);
          this.#waiting.delete(message.id);
        }
      };
      socket.onclose = ({ reason }) => {
        if (this.#socket === socket) {
          this.#forget(reason || "The connection to the daemon was lost.");
          this.lost(reason);
        }
        failed(new Rejected(reason || "The daemon did not give this page the right to move."));
      };
    });
    const renewing = setInterval(() => {
      if (this.#socket !== socket) clearInterval(renewing);
      else this.renew();
    }, RENEW_MS);
  }

  /** Extend the right, if it is held, at most every `RENEW_MS`. */
  renew(): void {
    const now = performance.now();
    if (this.#socket?.readyState !== WebSocket.OPEN || now - this.#renewed < 0.9 * RENEW_MS) return;
    this.#renewed = now;
    this.#socket.send(JSON.stringify({ do: "renew" }));
  }

  release(): void {
    const socket = this.#socket;
    this.#forget("This page has given the right back.");
    socket?.close();
  }

  async enable(): Promise<void> {
    await this.request("/enable", { client: clientName(), program: "hold" });
  }

  async program(program: string, wanted: Record<string, unknown> = {}): Promise<void> {
    await this.#order({ do: "program", program, wanted });
  }

  /** Change arguments of the running program. */
  async set(wanted: Record<string, unknown>): Promise<void> {
    await this.#order({ do: "set", wanted });
  }

  /** Carry out a request that needs the right to move. */
  async request<T>(path: Path, body: unknown): Promise<T> {
    const seen = await this.#takeForStep();
    return request<T>("POST", path, body, { "X-Control-Token": this.#token, "X-Stops-Seen": String(seen) });
  }

  async #order(order: Record<string, unknown>): Promise<void> {
    const stops_seen = await this.#takeForStep();
    const id = ++this.#number;
    const answer = await new Promise<Answer>((resolve) => {
      this.#waiting.set(id, resolve);
      this.#socket?.send(JSON.stringify({ ...order, id, stops_seen, client: clientName() }));
    });
    if (!answer.ok) throw new Rejected(answer.error ?? "refused");
  }

  /** Begin a procedure, which ends if this page loses the right to move. */
  async procedure(wanted: Wanted): Promise<Job> {
    const held = this.held;
    try {
      return await this.request<Job>("/procedure", { client: clientName(), ...wanted });
    } catch (error) {
      if (!held) this.release(); // it was taken for this procedure
      throw error;
    }
  }

  #forget(why: string): void {
    this.#token = "";
    this.#socket = null;
    for (const resolve of this.#waiting.values()) resolve({ ok: false, error: why });
    this.#waiting.clear();
    this.changed();
  }
}

/** Name of this tab, as others see it. */
export function clientName(): string {
  const name = "cdpr-client";
  const known = sessionStorage.getItem(name);
  if (known) return known;
  const fresh = `page ${Math.floor(Math.random() * 0x10000).toString(16).padStart(4, "0")}`;
  sessionStorage.setItem(name, fresh);
  return fresh;
}

/** Commands that need no right to move. */
export const command = (path: "/configure" | "/check" | "/acknowledge"): Promise<unknown> =>
  request("POST", path, { client: clientName() });

/** Let the browser save a file of a recording; it arrives piece by piece. */
export async function download(path: Path): Promise<void> {
  const { ticket } = await request<{ ticket: string }>("POST", "/ticket");
  saveAs(`${path}?ticket=${ticket}`, "");
}

/** Let the browser save what an address gives, with a name unless the daemon gives one. */
export function saveAs(url: string, name: string): void {
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
}
