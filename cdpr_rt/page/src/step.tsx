// A step of one axis, commanded from the scope, which then shows its figures.
import { useEffect, useState } from "preact/hooks";
import type { Description } from "./daemon";
import { OUTSIDE, isOutside, positionsOf, useHindrance } from "./move";
import { progressOf } from "./situation";
import { store, useStore } from "./store";

const RAD = Math.PI / 180;
/** After the set-point has arrived, the value settles for this time. */
const SETTLE_S = 1;
/** The scope may not have got the cycles of this time yet. */
const ARRIVED_S = 0.2;
/** A status may be as old as this. */
const LATE_S = 0.5;
const SIZES = { mm: [1, 2, 5, 10, 20, 50], deg: [1, 5, 20, 90] };

interface StepAxis {
  name: string;
  unit: keyof typeof SIZES;
  /** The curves of its position and its set-point. */
  ids: string[];
  program: string;
  wanted(size: number): Record<string, unknown>;
}

/** Return what can step: the platform's directions, or each motor of a robot without a platform. */
function axesOf({ platform, axes }: Description): StepAxis[] {
  if (!platform) {
    return axes.map(({ name }, number) => ({
      name, unit: "deg", ids: [`position_rad[${name}]`, `setpoint_rad[${name}]`], program: "pid",
      wanted: (size) => ({ distance_rad: axes.map((_, one) => (one === number ? size * RAD : null)) }),
    }));
  }
  const names = positionsOf(platform);
  return names.map((name, number) => ({
    name, unit: "mm", ids: [`pose[${name}]`, `pose_setpoint[${name}]`], program: "pose",
    wanted: (size) => ({ distance_m: names.map((_, one) => (one === number ? size / 1e3 : 0)), frame: "room" }),
  }));
}

const now_s = (): number => store.recent.at(-1)?.time_s ?? 0;

/** `show` gets the curves to show; `finished` gets the times between which the step lies. */
export function Step({ description, shown, show, finished }: {
  description: Description; shown: string[]; show(ids: string[]): void; finished(from_s: number, until_s: number): void;
}) {
  const { status, right } = useStore();
  const axes = axesOf(description);
  const [name, setName] = useState(axes[0]!.name);
  const [place, setPlace] = useState(2);
  const [from_s, begin] = useState<number | null>(null);
  const axis = axes.find((one) => one.name === name) ?? axes[0]!;
  const sizes = SIZES[axis.unit], size = sizes[place] ?? sizes[0]!;
  const platform = description.platform, platformHindrance = useHindrance();
  const hindrance = platform ? platformHindrance || (isOutside(platform, size / 1e3) ? OUTSIDE : "") : status?.state === "active" ? "" : "The motor can turn once the power is on.";
  const isReady = axis.ids.every((id) => shown.includes(id));
  const step = (sign: number): void => void store.attempt(async () => {
    const at_s = now_s();
    await right.program(axis.program, axis.wanted(sign * size));
    begin(at_s);
  });
  const isKnown = from_s !== null && now_s() - from_s > LATE_S;
  const isStopped = isKnown && status?.program !== axis.program;
  const hasArrived = isKnown && !isStopped && (progressOf(status!).done ?? 1) >= 1;
  useEffect(() => {
    if (isStopped) begin(null);
    if (!hasArrived) return;
    const timer = setTimeout(() => {
      begin(null);
      finished(from_s!, now_s() - ARRIVED_S);
    }, 1e3 * SETTLE_S);
    return () => clearTimeout(timer);
  }, [isStopped, hasArrived]);
  return (
    <section class="card" aria-labelledby="step">
      <h2 id="step">Make a step</h2>
      <p class="quiet">{hindrance || "The set-point moves by one step as fast as the robot's limits allow. Then the cursors show rise time, overshoot and settling time."}</p>
      <fieldset class="row" disabled={hindrance !== "" || from_s !== null}>
        <legend class="hidden">Make a step</legend>
        <label>Step of <select value={axis.name} onChange={(event) => setName(event.currentTarget.value)}>{axes.map((one) => <option key={one.name}>{one.name}</option>)}</select></label>
        <label>by <select value={place} onChange={(event) => setPlace(Number(event.currentTarget.value))}>{sizes.map((one, number) => <option key={one} value={number}>{one} {axis.unit}</option>)}</select></label>
        {isReady
          ? <><button onClick={() => step(-1)}>Step −{size} {axis.unit}</button><button onClick={() => step(1)}>Step +{size} {axis.unit}</button></>
          : <button onClick={() => show(axis.ids)}>Show position and set-point</button>}
        {from_s !== null && <span class="quiet" role="status">measuring …</span>}
      </fieldset>
    </section>
  );
}
