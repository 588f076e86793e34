// Drives and bus: states and errors as text, objects, timing, events.
import { useEffect, useState } from "preact/hooks";
import { type DriveObject, type Drives as DrivesAnswer, type Status, clientName, repeat, request } from "./daemon";
import { EventLine } from "./look";
import { store, useStore } from "./store";
import "./data.css";

const LOOK_MS = 1000;
type Drive = DrivesAnswer["drives"][number];

interface Fault { axis: number | null; text: string }

interface LoopFigures {
  count?: { missed: number; late: number; cycles: number; worst_late_s: number; heartbeat_age_s: number[] };
  buses?: Record<string, { url: string; state: string; counts: Record<string, number> }>;
}

const ms = (value: unknown, digits = 2): string => (typeof value === "number" ? `${(1e3 * value).toFixed(digits)} ms` : "–");
const number = (value: unknown, digits: number): string => (typeof value === "number" ? value.toFixed(digits) : "–");

export function Drives() {
  const { status } = useStore();
  const [found, setFound] = useState<DrivesAnswer | null>(null);
  const [why, setWhy] = useState("");
  const [axis, setAxis] = useState(0);
  useEffect(() => repeat(async () => {
    if (document.visibilityState !== "visible") return;
    try {
      setFound(await request<DrivesAnswer>("GET", "/drives"));
      setWhy("");
    } catch (error) {
      setWhy((error as Error).message);
    }
  }, LOOK_MS), []);
  const drive = found?.drives[axis];
  return (
    <div class="columns drives-first">
      <div class="column wide">
        <DriveTable why={why} drives={found?.drives ?? []} status={status} axis={axis} choose={setAxis} />
        {drive && <StatusBits drive={drive} />}
        {drive && <Objects key={axis} axis={axis} drive={drive} status={status} />}
      </div>
      <div class="column">
        <Buses buses={found?.buses ?? []} status={status} />
        <Timing status={status} />
        <EventList names={found?.drives.map((one) => one.name) ?? []} />
      </div>
    </div>
  );
}

function DriveTable({ why, drives, status, axis, choose }: { why: string; drives: Drive[]; status: Status | null; axis: number; choose(axis: number): void }) {
  const ages = (status as LoopFigures | null)?.count?.heartbeat_age_s ?? [];
  const faults = (status?.faults ?? []) as unknown as Fault[];
  return (
    <section class="card" aria-labelledby="drive-states">
      <h2 id="drive-states">Drives</h2>
      {why ? <p class="fault">{why}</p> : !drives.length && <p class="quiet">No drive has answered yet.</p>}
      <ul class="drives">
        {drives.map((one, place) => {
          const values = status?.axes[place] ?? {};
          const fault = faults.find((other) => other.axis === place);
          const answers = values["alive"] === false ? "silent" : values["valid"] === false ? "no answer in the last cycle" : "answers";
          return (
            <li key={one.name}>
              <button class="drive" aria-pressed={place === axis} onClick={() => choose(place)}>
                <strong>{one.name}</strong>
                <span>{one.state}</span>
                {fault && <span class="fault">{fault.text}</span>}
                <small>
                  node {one.node_id} on {one.bus}, {answers}, heartbeat {ages[place] === undefined ? "–" : `${(1e3 * ages[place]).toFixed(0)} ms ago`},
                  torque {number(values["torque_actual_Nm"], 3)} Nm, tension {number(values["tension_N"], 1)} N
                </small>
              </button>
            </li>
          );
        })}
      </ul>
    </section>
  );
}

function StatusBits({ drive }: { drive: Drive }) {
  return (
    <section class="card" aria-labelledby="bits">
      <h2 id="bits">Statusword of {drive.name}</h2>
      <p class="quiet note">{drive.drive}. Mode of operation with power: {drive.mode}.</p>
      <ul class="bits">
        {drive.bits.map(({ bit, name, on }) => <li key={bit} class={on ? "set" : ""}><code>{bit}</code> {name}<span class="hidden">: {on ? "set" : "not set"}</span></li>)}
      </ul>
    </section>
  );
}

/** Objects of CiA 301 and CiA 402 that say most about a drive. */
const USUAL: [number, number][] = [
  [0x603f, 0], [0x1001, 0], [0x6061, 0], [0x6041, 0], [0x6079, 0], [0x6078, 0], [0x6077, 0], [0x6064, 0], [0x1008, 0], [0x100a, 0],
];
const hex = (index: number): string => `${index.toString(16).toUpperCase().padStart(4, "0")}h`;

interface Read { index: number; sub: number; answer: DriveObject | null; why: string }

function Objects({ axis, drive, status }: { axis: number; drive: Drive; status: Status | null }) {
  const [read, setRead] = useState<Read[]>([]);
  const [typed, setTyped] = useState("6072");
  const [sub, setSub] = useState("0");
  const [value, setValue] = useState("");
  const [consent, setConsent] = useState("");
  const [working, setWorking] = useState(false);
  const index = /^(0x)?[0-9a-f]{1,4}h?$/i.test(typed.trim()) ? parseInt(typed.trim().replace(/^0x/i, ""), 16) : NaN;
  const part = Number(sub);
  const valid = Number.isFinite(index) && /^\d{1,3}$/.test(sub.trim()) && part <= 255;
  const whole = /^(-?\d+|0x[0-9a-f]+)$/i.test(value.trim()) && Number.isSafeInteger(Number(value));
  const agreed = consent.trim().toLowerCase() === typed.trim().toLowerCase() && consent !== "";
  const powerless = status?.state === "ready" || status?.state === "inactive";
  const ask = async (some: [number, number][]): Promise<void> => {
    setWorking(true);
    for (const [index, sub] of some) {
      let one: Read;
      try {
        one = { index, sub, why: "", answer: await request<DriveObject>("POST", "/object", { axis, index, sub, client: clientName() }) };
      } catch (error) {
        one = { index, sub, why: (error as Error).message, answer: null };
      }
      setRead((before) => [...before.filter((other) => other.index !== index || other.sub !== sub), one]);
    }
    setWorking(false);
  };
  const write = (): void => {
    setWorking(true);
    void store.attempt(async () => {
      await store.right.request("/object", { axis, index, sub: part, value: Number(value), client: clientName() });
      setConsent("");
      await ask([[index, part]]);
    }).finally(() => setWorking(false));
  };
  return (
    <section class="card" aria-labelledby="objects">
      <h2 id="objects">Objects of {drive.name}</h2>
      <div class="row">
        <label>Object <input class="number" value={typed} aria-label="Index of the object, hexadecimal" onInput={(event) => setTyped(event.currentTarget.value)} /></label>
        <label>: <input class="short" inputMode="numeric" value={sub} aria-label="Sub-index" onInput={(event) => setSub(event.currentTarget.value)} /></label>
        <button disabled={!valid || working} onClick={() => void ask([[index, part]])}>Read</button>
        <button disabled={working} onClick={() => void ask(USUAL)}>Read error, mode, voltage, current</button>
      </div>
      {read.length > 0 && (
        <div class="scroll" tabIndex={0} role="region" aria-label="Values of objects">
          <table>
            <thead><tr><th>object</th><th>name</th><th>value</th></tr></thead>
            <tbody>{read.map(({ index, sub, answer, why }) => (
              <tr key={`${index}:${sub}`}><td><code>{hex(index)}:{sub}</code></td><td>{answer?.name || "–"}</td><td class={answer ? "wrap" : "wrap fault"} title={answer?.raw}>{answer ? answer.text : why}</td></tr>
            ))}</tbody>
          </table>
        </div>
      )}
      <details>
        <summary>Write an object</summary>
        <p class="quiet note">A wrong value can make a drive move or fail later. Only integers, only without power. Then all drives boot again: the boot restores the settings in the robot's file, and the platform must be tightened again.</p>
        {!powerless && <p class="note">Remove the power first: the robot is {status?.state ?? "not connected"}.</p>}
        <fieldset disabled={!powerless || working}>
          <legend class="hidden">Write an object</legend>
          <div class="row">
            <label>Value <input class="number" value={value} onInput={(event) => setValue(event.currentTarget.value)} /></label>
            <label>Type {typed} again to agree <input class="number" value={consent} onInput={(event) => setConsent(event.currentTarget.value)} /></label>
            <button disabled={!valid || !whole || !agreed} onClick={write}>Write {valid ? `${hex(index)}:${part}` : ""}</button>
          </div>
        </fieldset>
      </details>
    </section>
  );
}

function Buses({ buses, status }: { buses: DrivesAnswer["buses"]; status: Status | null }) {
  const known = (status as LoopFigures | null)?.buses ?? {};
  return (
    <section class="card" aria-labelledby="buses">
      <h2 id="buses">Buses</h2>
      {buses.map(({ name, load, bitrate_bit_s }) => {
        const counts = Object.entries(known[name]?.counts ?? {}).map(([what, count]) => `${count} ${what.replaceAll("_", " ")}`);
        return (
          <div key={name} class="bus">
            <strong>{name}</strong> <span class="quiet">{known[name]?.url}, {bitrate_bit_s / 1e3} kbit/s</span>
            <meter min={0} max={1} low={0.7} high={0.9} optimum={0} value={load} aria-label={`Planned load of ${name}`} />
            <small>{(100 * load).toFixed(0)} % of each cycle planned for frames, in the worst case. {known[name]?.state || "No errors"}{counts.length > 0 && `: ${counts.join(", ")}`}</small>
          </div>
        );
      })}
    </section>
  );
}

function Timing({ status }: { status: Status | null }) {
  const count = (status as LoopFigures | null)?.count;
  const cycle = status?.cycle ?? {};
  const rows: [string, string][] = [
    ["Answers missed", String(count?.missed ?? "–")],
    ["Cycles that began late", `${count?.late ?? "–"} of ${count?.cycles ?? "–"}`],
    ["Largest lateness", ms(count?.worst_late_s)],
    ["Lateness now", ms(cycle["lateness_s"])],
    ["SYNC to the last answer", ms(cycle["exchange_s"])],
    ["Last answer to the last command", ms(cycle["compute_s"])],
  ];
  return (
    <section class="card" aria-labelledby="timing">
      <h2 id="timing">Timing of the cycles</h2>
      <dl class="pairs">{rows.map(([name, value]) => <div key={name}><dt>{name}</dt><dd>{value}</dd></div>)}</dl>
    </section>
  );
}

function EventList({ names }: { names: string[] }) {
  const { events } = useStore();
  const [axis, setAxis] = useState("");
  const shown = axis ? events.filter((one) => one.text.includes(axis)) : events;
  return (
    <section class="card" aria-labelledby="events">
      <h2 id="events">Events</h2>
      <div class="row"><label>Of <select value={axis} onChange={(event) => setAxis(event.currentTarget.value)}>
        <option value="">everything</option>
        {names.map((name) => <option key={name} value={name}>{name}</option>)}
      </select></label></div>
      {shown.length === 0 && <p class="quiet">No event{axis && ` names ${axis}`}.</p>}
      <ol class="events" tabIndex={0} aria-labelledby="events">
        {shown.map((one) => <EventLine key={one.number} event={one} exact />)}
      </ol>
    </section>
  );
}
