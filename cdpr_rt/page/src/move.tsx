// Moves of the platform: to a target, by steps, onto its stand; pause and continue.
import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import { type Platform, hasKey, stop } from "./daemon";
import { progressOf } from "./situation";
import { store, useStore } from "./store";

const STEPS_MM = [1, 10, 100];
const STEPS_DEG = [0.5, 2, 5];
const SHARES = [10, 25, 50, 100];
const RAD = Math.PI / 180;

export const positionsOf = (platform: Platform): string[] => platform.controlled.filter((name) => name.length === 1);
export const anglesOf = (platform: Platform): string[] => platform.controlled.filter((name) => name.length > 1);

/** Why this page may not move the robot now; "" if it may. */
export function useHindrance(): string {
  const { status, right } = useStore();
  if (status?.state !== "active" || progressOf(status).tight === false) return "The platform can move once the power is on and the cables are tight.";
  if ((status as { reacting?: string }).reacting !== "none") return "The robot is stopping.";
  if (status.control.procedure) return `The ${status.control.procedure} moves the platform.`;
  return status.control.held && !right.held ? `${status.control.client} has the right to move.` : "";
}

export const OUTSIDE = "The platform is outside its box of targets, as at home. Enter a target in the box and press Go; then it can move by steps.";

/** Whether the platform is so far outside its box of targets that no step of this size leads into it. */
export function isOutside({ workspace_min_m: low_m, workspace_max_m: high_m }: Platform, step_m: number): boolean {
  const position_m = (store.status && progressOf(store.status).position_m) ?? [];
  return position_m.some((one, axis) => one + step_m < low_m[axis]! || one - step_m > high_m[axis]!);
}

/** A card of actions that are disabled, with the reason, while this page may not move the robot. */
export function Moving({ name, title, children }: { name: string; title: string; children: ComponentChildren }) {
  const hindrance = useHindrance();
  return (
    <section class="card" aria-labelledby={name}>
      <h2 id={name}>{title}</h2>
      {hindrance && <p class="quiet">{hindrance}</p>}
      <fieldset disabled={hindrance !== ""}>
        <legend class="hidden">{title}</legend>
        {children}
      </fieldset>
    </section>
  );
}

export function Move() {
  const { description, status, right } = useStore();
  const platform = description?.platform;
  if (!platform || !status || !hasKey()) return null;
  const run = (program: string, wanted: Record<string, unknown> = {}) => () => void store.attempt(() => right.program(program, wanted));
  const progress = progressOf(status);
  const isMoving = status.program === "pose" && (progress.done ?? 1) < 1;
  const isHeld = status.program === "hold" && store.interrupted === "pose";
  return (
    <Moving name="move" title="Move">
      <Target platform={platform} />
      <Jog platform={platform} />
      <div class="row">
        {isHeld
          ? <button onClick={run("pose", { resume: true })} title="Continue to the target of the move that was stopped">Continue the move</button>
          : <button disabled={!isMoving} onClick={() => void store.attempt(() => stop("hold"))} title="Stop here, to continue later">Pause</button>}
        <button onClick={run("tighten")} title="Measure the cables' lengths again, and friction">Tighten again</button>
        <button onClick={run("lower")} title="Move home and down onto the stand">Lower</button>
        {right.held && <button class="plain" onClick={() => right.release()}>Give up the right to move</button>}
      </div>
    </Moving>
  );
}

/** The target as the daemon expects it; null while a field is not a number. */
export function targetOf(platform: Platform, typed: string[]): { position_m: number[]; rotation_rad: number[] } | null {
  const numbers = typed.map(Number), count = positionsOf(platform).length;
  if (typed.some((text, number) => text.trim() === "" || !Number.isFinite(numbers[number]))) return null;
  return { position_m: numbers.slice(0, count).map((one) => one / 1e3), rotation_rad: numbers.slice(count).map((one) => one * RAD) };
}

/** Return a number as text, without the sign of a zero. */
export const rounded = (value: number, digits: number): string => value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1");

/** The present pose in the fields' units. */
export function presentPose(platform: Platform): string[] | null {
  const progress = store.status && progressOf(store.status);
  const angles = anglesOf(platform).map((_, number) => progress?.rotation_rad?.[number] ?? 0);
  return progress?.position_m ? [...progress.position_m.map((one) => rounded(1e3 * one, 0)), ...angles.map((one) => rounded(one / RAD, 1))] : null;
}

const atSpeed = (platform: Platform): Record<string, number> => (store.speed < 100 ? { speed_m_s: (store.speed / 100) * platform.speed_m_s } : {});

/** Begin a target at the present pose, or at the nearest one in the box of targets. */
export function beginTarget(platform: Platform): void {
  const { workspace_min_m: low_m, workspace_max_m: high_m } = platform;
  const pose = presentPose(platform) ?? [];
  const within = (value: number, axis: number): number => Math.min(Math.max(value, Math.ceil(1e3 * low_m[axis]!)), Math.floor(1e3 * high_m[axis]!));
  store.change({ target: pose.map((text, axis) => (axis < low_m.length ? String(within(Number(text), axis)) : text)) });
}

export const go = (platform: Platform): void => {
  const wanted = store.target && targetOf(platform, store.target);
  if (!wanted) return;
  store.change({ target: null });
  const angles = wanted.rotation_rad.length ? { rotation_rad: wanted.rotation_rad } : {};
  void store.attempt(() => store.right.program("pose", { position_m: wanted.position_m, ...angles, ...atSpeed(platform) }));
};

function Target({ platform }: { platform: Platform }) {
  const names = [...positionsOf(platform), ...anglesOf(platform)];
  const count = positionsOf(platform).length;
  const shown = store.target ?? presentPose(platform) ?? names.map(() => "");
  const valid = targetOf(platform, shown) !== null;
  const range = (number: number): string => {
    const [low, high] = number < count
      ? [1e3 * platform.workspace_min_m[number]!, 1e3 * platform.workspace_max_m[number]!]
      : [-platform.workspace_angle_rad / RAD, platform.workspace_angle_rad / RAD];
    return `${low.toFixed(0)} to ${high.toFixed(0)}`.replace(/-/g, "−");
  };
  return (
    <form onSubmit={(event) => { event.preventDefault(); go(platform); }}>
      <div class="target">
        {names.map((name, number) => (
          <label key={name}>
            <span>{name}, {number < count ? "mm" : "deg"}</span>
            <input inputMode="decimal" autocomplete="off" value={shown[number]} aria-describedby={`range-${name}`} class={store.target ? "" : "quiet"}
              onInput={(event) => store.change({ target: shown.map((text, one) => (one === number ? event.currentTarget.value : text)) })} />
            <small id={`range-${name}`}>{range(number)}</small>
          </label>
        ))}
      </div>
      <div class="row">
        <button class="go" disabled={!store.target || !valid}>Go</button>
        <label>at <select aria-label="Speed" value={store.speed} onChange={(event) => store.change({ speed: Number(event.currentTarget.value) })}>
          {SHARES.map((one) => <option key={one} value={one}>{(0.01 * one * platform.speed_m_s * 1e3).toFixed(0)} mm/s</option>)}
        </select></label>
        {Object.entries(platform.poses_m).map(([name, at]) => (
          <button key={name} type="button" onClick={() => store.change({ target: [...at.map((one) => String(Math.round(1e3 * one))), ...shown.slice(count)] })}>{name}</button>
        ))}
        {store.target && <button type="button" class="plain" onClick={() => store.change({ target: null })}>Discard</button>}
      </div>
    </form>
  );
}

function Jog({ platform }: { platform: Platform }) {
  const [size, setSize] = useState(1);
  const [frame, setFrame] = useState<"room" | "platform">("room");
  const names = positionsOf(platform), turns = anglesOf(platform);
  const outside = isOutside(platform, STEPS_MM[size]! / 1e3);
  const jog = (key: "distance_m" | "turn_rad", count: number, number: number, step: number): void => {
    const wanted = Array.from({ length: count }, (_, one) => (one === number ? step : 0));
    void store.attempt(() => store.right.program("pose", { [key]: wanted, frame, ...atSpeed(platform) }));
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
        <label>along <select value={frame} onChange={(event) => setFrame(event.currentTarget.value as "room" | "platform")}>
          <option value="room">the room's axes</option><option value="platform">the platform's axes</option>
        </select></label>
      </div>
      {outside && <p class="quiet">{OUTSIDE}</p>}
      <fieldset class="row" disabled={outside}>
        <legend class="hidden">Steps</legend>
        {names.map((name, number) => pair(name, "distance_m", names.length, number, STEPS_MM[size]! / 1e3, `${STEPS_MM[size]} mm`))}
        {turns.map((name, number) => pair(name, "turn_rad", turns.length, number, STEPS_DEG[size]! * RAD, `${STEPS_DEG[size]} deg`))}
      </fieldset>
    </div>
  );
}
