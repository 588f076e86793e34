// What acts: the stop, the next step, moves and jogging.
import { useEffect, useRef, useState } from "preact/hooks";
import { linkTo } from "./address";
import { clientName, command, hasKey, request, setKey, stop as order } from "./daemon";
import { beginTarget, useHindrance } from "./move";
import { STEP_LABELS, type Situation, type Step, lastStop, situationOf } from "./situation";
import { store, useStore } from "./store";

const stop = (): void => {
  store.right.cancel();
  void store.attempt(() => order("hold"));
};

const powerOff = (): void => {
  store.right.cancel();
  void store.attempt(() => order("disable"));
};

/** The stop acts on one press or on the space bar, with or without the right to move. */
export function StopButton() {
  useEffect(() => {
    const isText = (target: EventTarget | null): boolean => target instanceof HTMLInputElement && target.type === "password";
    const pressed = (event: KeyboardEvent): void => {
      if (event.key === "Enter" && event.repeat) event.preventDefault(); // a key that is held presses once
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
  const off = connected && status?.state !== "active" && !status?.released; // a state that may be old disables nothing
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
  const { status, description, connected, interrupted } = useStore();
  return situationOf(status, description, connected, interrupted);
}

const SETTLE_MS = 500, SHOWN_MS = 100;

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

/** Show the robot and a target there, which the user can type or drag. */
function beginMove(): void {
  location.hash = linkTo("robot");
  if (!store.target) beginTarget(store.description!.platform!);
  setTimeout(() => document.querySelector<HTMLInputElement>(".target input")?.focus(), SHOWN_MS);
}

/**
 * The state, its cause and the one next step: the head of every view.
 *
 * After a step that was taken by the keyboard, the next one is in focus.
 */
export function NextStep() {
  useStore();
  const { tone, title, detail, next } = useSituation();
  const [working, setWorking] = useState(false);
  const settled = useSettled(next), free = useHindrance() === "", waits = working || !settled;
  const button = useRef<HTMLButtonElement>(null), byKey = useRef(false);
  useEffect(() => {
    if (byKey.current && document.activeElement === document.body) button.current?.focus();
  }, [next]);
  const press = async (step: Exclude<Step, "move">, detail: number): Promise<void> => {
    byKey.current = detail === 0;
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
      {next === "move" && hasKey() && free && <button ref={button} class="next" onClick={beginMove}>{STEP_LABELS[next]}</button>}
      {next && next !== "move" && hasKey() && <button ref={button} class="next" aria-disabled={waits} onClick={({ detail }) => waits || void press(next, detail)}>{STEP_LABELS[next]}</button>}
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
  ["encoder-jump", "Encoder jumps"], ["silence", "Drive sends nothing"],
];

/** Break a simulated robot, and mend it. */
export function Simulation() {
  const { description } = useStore();
  const [axis, setAxis] = useState(0);
  if (!description?.simulated || !hasKey()) return null;
  const inject = (fault: string, at: number): Promise<unknown> => request("POST", "/simulated-fault", { axis: at, fault, client: clientName() });
  const mend = async (): Promise<void> => {
    if (lastStop(store.status!).fallen) await inject("put-back", 0); // first: cables are mended as long as they then need to be
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
      </div>
      <div class="row">
        <button onClick={() => void store.attempt(mend)}>Mend everything</button>
        <button onClick={() => void store.attempt(() => inject("put-back", 0))} title="Carry a fallen platform back to its stand">Put the platform back</button>
      </div>
    </section>
  );
}
