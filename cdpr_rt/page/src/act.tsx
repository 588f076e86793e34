// What acts: the stop, the next step, moves and jogging.
import { useEffect, useState } from "preact/hooks";
import { type Platform, clientName, command, hasKey, request, setKey } from "./daemon";
import { STEP_LABELS, type Situation, type Step, progressOf, situationOf } from "./situation";
import { store, useStore } from "./store";

const stop = (): void => {
  store.right.stop();
  void store.attempt(() => command("/hold"));
};

const powerOff = (): void => {
  store.right.cancel();
  void store.attempt(() => command("/disable"));
};

/** The stop acts on one press or on the space bar, with or without the right to move. */
export function StopButton() {
  useEffect(() => {
    const isText = (target: EventTarget | null): boolean => target instanceof HTMLInputElement && target.type === "password";
    const pressed = (event: KeyboardEvent): void => {
      if (event.code !== "Space" || isText(event.target)) return;
      event.preventDefault(); // the bar stops; Enter presses buttons
      if (event.type === "keydown" && !event.repeat) stop();
    };
    addEventListener("keydown", pressed, true);
    addEventListener("keyup", pressed, true);
    return () => {
      removeEventListener("keydown", pressed, true);
      removeEventListener("keyup", pressed, true);
    };
  }, []);
  return (
    <button class="stop" onPointerDown={stop} onClick={(event) => event.detail === 0 && stop()} title="Brake and hold with power: press, or space bar">
      Stop <kbd>space</kbd>
    </button>
  );
}

export function PowerOff() {
  const { status, connected } = useStore();
  const off = connected && status?.state !== "active"; // a state that may be old disables nothing
  return <button class="power" disabled={off} onClick={powerOff} title="Stop the motion, then switch the power off">Power off</button>;
}

const STEPS: Record<Exclude<Step, "move">, () => Promise<unknown>> = {
  configure: () => command("/configure"),
  check: () => command("/check"),
  enable: () => store.right.enable(),
  tighten: () => store.right.program("tighten"),
  "tighten-home": () => store.right.program("tighten", { from: "home" }),
  acknowledge: () => command("/acknowledge"),
};

export function useSituation(): Situation {
  const { status, description, connected } = useStore();
  return situationOf(status, description, connected);
}

const SETTLE_MS = 500;

/** Return whether a value has not changed for a moment, in which a press may be meant for the one before. */
function useSettled(value: unknown): boolean {
  const [settled, setSettled] = useState<unknown>(null);
  useEffect(() => {
    const timer = setTimeout(() => setSettled(value), SETTLE_MS);
    return () => clearTimeout(timer);
  }, [value]);
  return settled === value;
}

/** Why the daemon rejected the last request, in sight from every view. */
export function RejectedMessage() {
  const { rejected } = useStore();
  if (!rejected) return null;
  return <p class="rejected" role="alert">{rejected} <button class="plain" onClick={() => store.change({ rejected: "" })}>Close</button></p>;
}

/** The state, its cause and the one next step: the head of every view. */
export function NextStep() {
  useStore();
  const { tone, title, detail, next } = useSituation();
  const [working, setWorking] = useState(false);
  const settled = useSettled(next);
  const press = async (step: Exclude<Step, "move">): Promise<void> => {
    setWorking(true);
    await store.attempt(STEPS[step]);
    setWorking(false);
  };
  return (
    <section class={`card situation ${tone}`} aria-label="State and next step">
      <div>
        <h1 aria-live="polite">{title}</h1>
        {detail && <p>{detail}</p>}
      </div>
      {next && next !== "move" && hasKey() && <button class="next" disabled={working || !settled} onClick={() => void press(next)}>{STEP_LABELS[next]}</button>}
      {!hasKey() && <Key />}
    </section>
  );
}

/** Without the key, this page can do nothing, unless the daemon lets everybody look on and stop. */
function Key() {
  const [text, setText] = useState("");
  return (
    <form class="key" onSubmit={(event) => { event.preventDefault(); setKey(text.trim()); location.reload(); }}>
      <label>Key <input type="password" value={text} autocomplete="off" onInput={(event) => setText(event.currentTarget.value)} /></label>
      <button disabled={!text.trim()}>Use the key</button>
    </form>
  );
}

const FAULTS: [string, string][] = [
  ["cut-cable", "Cut the cable"], ["slip", "Let the cable slip"], ["drive-fault", "Fault in the drive"],
  ["encoder-jump", "Encoder jumps"], ["silence", "Drive falls silent"],
];

/** Break a simulated robot, and mend it. */
export function Simulation() {
  const { description } = useStore();
  const [axis, setAxis] = useState(0);
  if (!description?.simulated || !hasKey()) return null;
  const inject = (fault: string, at: number): Promise<unknown> => request("POST", "/simulated-fault", { axis: at, fault, client: clientName() });
  const mend = async (): Promise<void> => {
    for (const number of description.axes.keys()) await inject("mend", number);
  };
  return (
    <section class="card" aria-labelledby="simulation">
      <h2 id="simulation">Break the simulation</h2>
      <div class="row">
        <label>Axis <select value={axis} onChange={(event) => setAxis(Number(event.currentTarget.value))}>
          {description.axes.map(({ name }, number) => <option key={name} value={number}>{name}</option>)}
        </select></label>
      </div>
      <div class="row">
        {FAULTS.map(([fault, words]) => <button key={fault} onClick={() => void store.attempt(() => inject(fault, axis))}>{words}</button>)}
        <button onClick={() => void store.attempt(mend)}>Mend everything</button>
        <button onClick={() => void store.attempt(() => inject("put-back", 0))} title="Carry a fallen platform back to its stand">Put the platform back</button>
      </div>
    </section>
  );
}

const STEPS_MM = [1, 10, 100];
const STEPS_DEG = [0.5, 2, 5];
const RAD = Math.PI / 180;

export function Move() {
  const { description, status, right } = useStore();
  const platform = description?.platform;
  if (!platform || !status || !hasKey()) return null;
  const tight = status.state === "active" && progressOf(status).tight !== false;
  const holder = status.control.held && !right.held ? status.control.client : null;
  return (
    <section class="card" aria-labelledby="move">
      <h2 id="move">Move</h2>
      {!tight && <p class="quiet">The platform can move once the power is on and the cables are tight.</p>}
      {holder && <p class="quiet">{holder} has the right to move.</p>}
      <fieldset disabled={!tight || holder !== null}>
        <legend class="hidden">Move the platform</legend>
        <Target platform={platform} />
        <Jog platform={platform} />
        <div class="row">
          <button onClick={() => void store.attempt(() => right.program("lower"))} title="Move home and down onto the stand">Lower</button>
          {right.held && <button class="plain" onClick={() => right.release()}>Give up the right to move</button>}
        </div>
      </fieldset>
    </section>
  );
}

const positions = (platform: Platform): string[] => platform.controlled.filter((name) => name.length === 1);
const angles = (platform: Platform): string[] => platform.controlled.filter((name) => name.length > 1);

function Target({ platform }: { platform: Platform }) {
  const names = [...positions(platform), ...angles(platform)];
  const count = positions(platform).length;
  const middle = platform.workspace_min_m.map((low, axis) => Math.round(500 * (low + platform.workspace_max_m[axis]!)));
  const [typed, setTyped] = useState<string[]>(() => names.map((_, number) => String(number < count ? middle[number] : 0)));
  const numbers = typed.map(Number);
  const valid = typed.every((text, number) => text.trim() !== "" && Number.isFinite(numbers[number]));
  const target = { position_m: numbers.slice(0, count).map((one) => one / 1e3), rotation_rad: numbers.slice(count).map((one) => one * RAD) };
  const bounds = (number: number): [number, number] => number < count
    ? [1e3 * platform.workspace_min_m[number]!, 1e3 * platform.workspace_max_m[number]!]
    : [-platform.workspace_angle_rad / RAD, platform.workspace_angle_rad / RAD];
  const show = (numbers: string[]): void => {
    setTyped(numbers);
    const values = numbers.map(Number);
    store.change({ preview: values.every(Number.isFinite) ? { position_m: values.slice(0, count).map((one) => one / 1e3), rotation_rad: values.slice(count).map((one) => one * RAD) } : null });
  };
  const go = (): void => {
    store.change({ preview: null });
    const wanted = target.rotation_rad.length ? target : { position_m: target.position_m };
    void store.attempt(() => store.right.program("pose", wanted));
  };
  const named = Object.entries(platform.poses_m);
  return (
    <form onSubmit={(event) => { event.preventDefault(); if (valid) go(); }}>
      <div class="target" onFocusCapture={() => show(typed)} onBlurCapture={() => store.change({ preview: null })}>
        {names.map((name, number) => {
          const [low, high] = bounds(number);
          return (
            <label key={name}>
              <span>{name}, {number < count ? "mm" : "deg"}</span>
              <input inputMode="decimal" value={typed[number]} aria-describedby={`range-${name}`}
                onInput={(event) => show(typed.map((text, one) => (one === number ? event.currentTarget.value : text)))} />
              <small id={`range-${name}`}>{low.toFixed(0)} to {high.toFixed(0)}</small>
            </label>
          );
        })}
      </div>
      <div class="row">
        <button class="go" disabled={!valid}>Go</button>
        {named.map(([name, at]) => (
          <button key={name} type="button" onClick={() => show([...at.map((one) => String(Math.round(1e3 * one))), ...typed.slice(count)])}>{name}</button>
        ))}
      </div>
    </form>
  );
}

function Jog({ platform }: { platform: Platform }) {
  const [size, setSize] = useState(1);
  const [frame, setFrame] = useState<"room" | "platform">("room");
  const names = positions(platform), turns = angles(platform);
  const jog = (key: "distance_m" | "turn_rad", count: number, number: number, step: number): void => {
    const wanted = Array.from({ length: count }, (_, one) => (one === number ? step : 0));
    void store.attempt(() => store.right.program("pose", { [key]: wanted, frame }));
  };
  const pair = (name: string, key: "distance_m" | "turn_rad", count: number, number: number, step: number, words: string) => (
    <div class="jog" key={name}>
      <button type="button" aria-label={`${name} minus ${words}`} onClick={() => jog(key, count, number, -step)}>−</button>
      <span>{name}</span>
      <button type="button" aria-label={`${name} plus ${words}`} onClick={() => jog(key, count, number, step)}>+</button>
    </div>
  );
  return (
    <div class="jogging">
      <div class="row">
        <label>Step <select value={size} onChange={(event) => setSize(Number(event.currentTarget.value))}>
          {STEPS_MM.map((one, number) => <option key={one} value={number}>{one} mm{turns.length ? `, ${STEPS_DEG[number]} deg` : ""}</option>)}
        </select></label>
        {turns.length > 0 && <label>along <select value={frame} onChange={(event) => setFrame(event.currentTarget.value as "room" | "platform")}>
          <option value="room">the room's axes</option><option value="platform">the platform's axes</option>
        </select></label>}
      </div>
      <div class="row">
        {names.map((name, number) => pair(name, "distance_m", names.length, number, STEPS_MM[size]! / 1e3, `${STEPS_MM[size]} mm`))}
        {turns.map((name, number) => pair(name, "turn_rad", turns.length, number, STEPS_DEG[size]! * RAD, `${STEPS_DEG[size]} deg`))}
      </div>
    </div>
  );
}
