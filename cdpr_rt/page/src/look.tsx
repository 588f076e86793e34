// What is only looked at: the robot, tensions, curves, events, axes.
import { useEffect, useRef, useState } from "preact/hooks";
import { linkTo } from "./address";
import { type Border, type Cycle, type DaemonEvent, type Description, hasKey, request } from "./daemon";
import { anglesOf, beginTarget, go, positionsOf, rounded, targetOf, useHindrance } from "./move";
import { type RobotScene, drawnIn, tensionColour } from "./scene";
import { progressOf } from "./situation";
import { store, useCycles, useStore } from "./store";
import { type Curve, SPAN_S, Trend, curveColour } from "./trend";

const RAD = Math.PI / 180;

export function RobotView() {
  const { description, status, target, path } = useStore();
  const [turns, setTurns] = useState(false);
  const [border, setBorder] = useState<Border | "computing" | null>(null);
  const toggle = async (): Promise<void> => {
    if (border) return setBorder(null);
    setBorder("computing");
    await store.attempt(async () => setBorder(await request<Border>("GET", "/workspace")));
    setBorder((now) => (now === "computing" ? null : now)); // it was rejected
  };
  useEffect(() => scene.current?.workspace(border === "computing" ? null : border), [border, description]);
  const host = useRef<HTMLDivElement>(null);
  const scene = useRef<RobotScene | null>(null);
  useEffect(() => {
    scene.current = drawnIn(host.current!);
    return () => scene.current?.close();
  }, []);
  useEffect(() => {
    if (description) scene.current?.describe(description);
    store.recent.slice(-1).forEach((cycle) => scene.current?.show(cycle));
  }, [description]);
  useCycles((cycle) => scene.current?.show(cycle), []);
  const progress = status && progressOf(status);
  const moving = progress?.target_m && (progress.done ?? 1) < 1;
  const platform = description?.platform;
  const wanted = platform && target ? targetOf(platform, target) : null;
  useEffect(() => {
    if (wanted) scene.current?.aim(wanted.position_m, wanted.rotation_rad);
    else if (!target) scene.current?.aim(moving ? progress!.target_m! : null, progress?.target_rotation_rad ?? null);
  }, [String(target), moving, String(progress?.target_m)]);
  const free = useHindrance() === "";
  useEffect(() => {
    if (platform && target) scene.current?.drag(turns ? "turn" : "move", (position_m, rotation_rad) =>
      store.change({ target: [...position_m.map((one) => rounded(1e3 * one, 0)), ...rotation_rad.map((one) => rounded(one / RAD, 1))] }));
    else scene.current?.drag(null);
  }, [target === null, turns, description]);
  const under = progress?.path;
  const mine = path && !path.planning && (!under || under.plan === path.plan || status?.program !== "path") ? path : null;
  useEffect(() => scene.current?.route(mine?.route_m ?? null, (mine?.obstacle as { position_m: number[] } | null | undefined)?.position_m ?? null), [mine, description]);
  const share = mine && under?.plan === mine.plan ? under!.along_m / Math.max(under!.length_m, 1e-9) : 0;
  useEffect(() => scene.current?.done(share), [share, mine]);
  return (
    <section class="card robot" aria-label="The robot in three dimensions">
      <div class="scene" ref={host} />
      <Place />
      {platform && hasKey() && (
        <div class="overlay">
          <button aria-pressed={border !== null} disabled={border === "computing"} onClick={() => void toggle()} title="Show where the cables can hold the platform at rest">{border === "computing" ? "Computing …" : "Workspace"}</button>
          {!target && free && <button onClick={() => beginTarget(platform)} title="Drag the arrows of the outline to where the platform is to go">Drag a target</button>}
          {target && anglesOf(platform).length > 0 && <button aria-pressed={turns} onClick={() => setTurns(!turns)}>Turn</button>}
          {target && <button class="go" disabled={!wanted} onClick={() => go(platform)}>Go there</button>}
          {target && <button onClick={() => store.change({ target: null })}>Discard the target</button>}
        </div>
      )}
    </section>
  );
}

const mm = (value: number | null | undefined): string => (value == null ? "–" : rounded(1e3 * value, 1));

/** The platform's position as numbers. */
function Place() {
  const { description } = useStore();
  const text = useRef<HTMLOutputElement>(null);
  const names = description?.platform ? positionsOf(description.platform) : [];
  useCycles((cycle) => {
    if (!text.current) return;
    const known = cycle.pose[0] != null;
    text.current.textContent = known
      ? names.map((name, number) => `${name} ${mm(cycle.pose[number])}`).join("   ") + " mm"
      : "position unknown until the cables are tight";
  }, [names.join()]);
  return description?.platform ? <output class="place" ref={text} /> : null;
}

export function Tensions() {
  const { description } = useStore();
  if (!description) return null;
  return (
    <section class="card" aria-labelledby="tensions">
      <h2 id="tensions">Cable tensions <Origin /></h2>
      <ul class="tensions">
        {description.axes.map((axis, number) => <Tension key={axis.name} number={number} name={axis.name} limits={description.limits} />)}
      </ul>
    </section>
  );
}

/** Whether all tensions are estimated or measured; single ones say so by their `~`. */
function Origin() {
  const [text, setText] = useState("");
  useCycles(({ tension_measured: measured }) => setText(measured.every(Boolean) ? "measured" : measured.some(Boolean) ? "~ estimated" : "estimated from the motors"), []);
  return <span class="origin">{text}</span>;
}

function Tension({ number, name, limits }: { number: number; name: string; limits: Description["limits"] }) {
  const bar = useRef<HTMLDivElement>(null), text = useRef<HTMLSpanElement>(null), meter = useRef<HTMLDivElement>(null);
  const low = limits.tension_min_N[number] ?? null, high = limits.tension_max_N[number] ?? null;
  const full = 1.15 * (high ?? 100);
  const left = (value: number): { left: string } => ({ left: `${(100 * value) / full}%` });
  useCycles((cycle) => {
    if (!bar.current || !text.current || !meter.current) return;
    const tension = cycle.tension_N[number] ?? null;
    const share = Math.min(Math.max(tension ?? 0, 0) / full, 1);
    bar.current.style.transform = `scaleX(${share})`;
    bar.current.style.background = `#${tensionColour(tension, low, high).getHexString()}`;
    const measured = cycle.tension_measured[number];
    text.current.textContent = tension === null ? "unknown" : `${measured ? "" : "~"}${tension.toFixed(0)} N`;
    text.current.title = measured ? "measured by a sensor" : "estimated from the motor's torque";
    meter.current.setAttribute("aria-valuenow", (tension ?? 0).toFixed(0));
  }, [number, full]);
  return (
    <li>
      <span class="name"><i style={{ background: curveColour(number) }} />{name}</span>
      <div class="meter" role="meter" aria-label={`Tension of ${name} in N`} aria-valuemin={0} aria-valuemax={Math.round(full)} aria-valuenow={0} ref={meter}>
        <div class="bar" ref={bar} />
        {low !== null && <i class="limit" style={left(low)} title={`lowest allowed: ${low} N`} />}
        {high !== null && <i class="limit" style={left(high)} title={`highest allowed: ${high} N`} />}
      </div>
      <span class="value" ref={text} />
    </li>
  );
}

const distance_mm = ({ pose, pose_setpoint }: Cycle): number | null => {
  if (pose[0] == null || pose_setpoint[0] == null) return null;
  return 1e3 * Math.hypot(...[0, 1, 2].map((axis) => (pose[axis] ?? 0) - (pose_setpoint[axis] ?? 0)));
};

const realTimeFactor = (): number | null => (store.status as { real_time_factor?: number | null } | null)?.real_time_factor ?? null;

export function Trends() {
  const { description } = useStore();
  if (!description) return null;
  return (
    <section class="card trends" aria-label={`The last ${SPAN_S} s`}>
      {description.platform && <TrendView title="Distance from the set-point, mm" curves={[{ name: "distance", unit: "mm" }]} values={(cycle) => [distance_mm(cycle)]} floor={1} />}
      <TrendView title="Tensions, N" curves={description.axes.map((axis) => ({ name: axis.name, unit: "N" }))} values={(cycle) => cycle.tension_N} floor={Math.max(...description.limits.tension_max_N.map((one) => one ?? 10))} />
      {description.simulated && <TrendView title="Simulated against real time" curves={[{ name: "factor", unit: "" }]} values={() => [realTimeFactor()]} floor={1.2} />}
    </section>
  );
}

function TrendView({ title, curves, values, floor }: { title: string; curves: Curve[]; values: (cycle: Cycle) => (number | null)[]; floor: number }) {
  const host = useRef<HTMLDivElement>(null), trend = useRef<Trend | null>(null);
  useEffect(() => {
    trend.current = new Trend(host.current!, curves, floor);
    store.recent.forEach((cycle) => trend.current!.add(cycle.time_s, values(cycle)));
    trend.current.draw();
    return () => trend.current?.close();
  }, [curves.map((one) => one.name).join()]);
  useCycles((cycle) => {
    trend.current?.add(cycle.time_s, values(cycle));
    trend.current?.draw();
  }, []);
  return (
    <figure>
      <figcaption>{title}</figcaption>
      <div class="trend" ref={host} />
    </figure>
  );
}

const STATES: Record<string, string> = {
  starting: "the control loop starts", unconfigured: "drives not booted", inactive: "drives booted, not checked",
  ready: "drives ready, no power", active: "power on", fault: "fault: the power is off", dead: "the control loop has ended",
};

/** One event; with its date and milliseconds if `exact`. */
export function EventLine({ event: { kind, time, text, times }, exact = false }: { event: DaemonEvent; exact?: boolean }) {
  return (
    <li class={kind === "reason" ? "reason" : ""}>
      <time>{exact ? time.slice(0, 23).replace("T", " ") : time.slice(11, 19)}</time> {kind === "state" ? STATES[text] ?? text : text.replace(/^pose by/, "move by")}{times > 1 ? ` (${times} times)` : ""}
    </li>
  );
}

export function Events() {
  const { events } = useStore();
  return (
    <section class="card" aria-labelledby="events">
      <h2 id="events">Events</h2>
      {events.length === 0 && <p class="quiet">Nothing has happened since this page was opened.</p>}
      <ol class="events" tabIndex={0} aria-labelledby="events">
        {events.map((one) => <EventLine key={one.number} event={one} />)}
      </ol>
    </section>
  );
}

export function Axes() {
  const { status } = useStore();
  if (!status?.axes.length || !status.axes[0]?.["name"]) return null;
  const number = (value: unknown, digits: number, factor = 1): string => (typeof value === "number" ? (factor * value).toFixed(digits) : "–");
  return (
    <section class="card" aria-labelledby="drives">
      <h2 id="drives">Drives</h2>
      <div class="scroll" tabIndex={0}>
        <table>
          <thead><tr><th>axis</th><th>node</th><th>answers</th><th>angle, deg</th><th>torque, Nm</th><th>cable, m</th></tr></thead>
          <tbody>
            {status.axes.map((axis) => (
              <tr key={String(axis["name"])}>
                <td>{String(axis["name"])}</td>
                <td>{String(axis["node_id"])}</td>
                <td>{axis["alive"] === false ? "silent" : axis["valid"] === false ? "not valid" : "yes"}</td>
                <td>{number(axis["position_rad"], 1, 180 / Math.PI)}</td>
                <td>{number(axis["torque_actual_Nm"], 3)}</td>
                <td>{number(axis["cable_length_m"], 4)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}

export function Recording() {
  const { status } = useStore();
  const recording = status?.parts["recording"] as { recording?: boolean; file?: string; bytes?: number; error?: string } | undefined;
  const text = !recording
    ? <>Nothing is recorded: the daemon was started with <code>--no-record</code>.</>
    : recording.recording
      ? <>{recording.file?.split("/").pop()}, {((recording.bytes ?? 0) / 1e6).toFixed(1)} MB. <a href={linkTo("recordings")}>Plot or download</a></>
      : <>Not recording: {recording.error || "ended"}</>;
  return (
    <section class="card" aria-labelledby="recording">
      <h2 id="recording">Recording</h2>
      <p class="quiet">{store.connected ? text : "–"}</p>
    </section>
  );
}
