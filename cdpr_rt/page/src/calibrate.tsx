// Calibration of the geometry, of winches by tension, and of a camera's lens.
import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import type { Job, Wanted } from "./daemon";
import { RobotView } from "./look";
import { Progress, sentence, useJob } from "./procedure";
import { progressOf } from "./situation";
import { useStore } from "./store";

const PARTS = { geometry: "Geometry", tension: "Winch tension", lens: "Camera lens" };
type Part = keyof typeof PARTS;
const PURPOSES: Record<Part, string> = {
  geometry: "Exit points, anchor points and drums never have exactly the measures of the robot's file. Calibration finds their errors from the cable lengths at many poses, so that the platform goes where it is sent.",
  tension: "A motor's torque shows the tension of its cable only as well as radius and friction of the winch are known. Known masses measure both.",
  lens: "A camera on the platform sees markers on the floor or the walls and so measures poses, which cable lengths alone cannot. Its lens must be known first.",
};
const OF_PART: Record<Part, string[]> = { geometry: ["measure", "adopt", "check", "undo"], tension: ["tension"], lens: ["lens"] };

interface Props { job: Job | null; start: (wanted: Wanted) => Promise<void> }

export function Calibrate() {
  const { description, status } = useStore();
  const { job, start } = useJob();
  const [chosen, choose] = useState<Part | null>(null);
  if (!description || !status) return null;
  const running = (Object.keys(PARTS) as Part[]).find((one) => OF_PART[one].includes(job?.procedure ?? ""));
  const part = chosen ?? running ?? (description.platform ? "geometry" : "tension");
  const mine = job && OF_PART[part].includes(job.procedure) ? job : null;
  const Shown = { geometry: Geometry, tension: Tension, lens: Lens }[part];
  return (
    <>
      <div class="parts" role="group" aria-label="What to calibrate">
        {(Object.keys(PARTS) as Part[]).map((one) => <button key={one} aria-pressed={one === part} onClick={() => choose(one)}>{PARTS[one]}</button>)}
      </div>
      <div class="columns">
        <div class="column wide">
          <Shown job={job} start={start} />
        </div>
        <div class="column">
          {job?.running && !mine && <section class="card"><p>{sentence(`${job.client} runs another procedure: ${job.what}`)}</p></section>}
          {mine && <Progress job={mine} />}
          {mine?.running && mine.procedure !== "undo" && part === "geometry" && <RobotView />}
          {mine && !mine.running && mine.result && <Results job={mine} start={start} />}
          {!mine && <section class="card"><h2>What it is for</h2><p>{PURPOSES[part]}</p></section>}
        </div>
      </div>
    </>
  );
}

function Guide({ title, children }: { title: string; children: ComponentChildren }) {
  return <section class="card" aria-label={title}><h2>{title}</h2><ol class="guide">{children}</ol></section>;
}

const Met = ({ is, children }: { is: boolean; children: ComponentChildren }) => <li class={is ? "on" : "busy"}>{is ? "✓ " : "○ "}<span>{children}</span></li>;

const GRAVITY_m_s2 = 9.81;
/** The first pose must be this close to home, in each direction; the default of home_tolerance_m. */
const AT_HOME_m = 0.05;
const FEWEST = 2, MOST = 200;

/** Measure poses, look at the verdict, adopt, check. */
function Geometry({ job, start }: Props) {
  const { description, status } = useStore();
  const [count, setCount] = useState("");
  const [camera, setCamera] = useState(false);
  const platform = description!.platform;
  if (!platform) return <section class="card"><p>This robot has no platform: there is no geometry to calibrate.</p></section>;
  const { tight: cablesTight, position_m = [] } = progressOf(status!);
  const isAtHome = position_m.every((one, axis) => Math.abs(one - (platform.home_m[axis] ?? 0)) < AT_HOME_m);
  const tight = status!.state === "active" && cablesTight !== false && isAtHome;
  const inForce = status!.calibration as { version?: number; date?: string } | null;
  const redundant = description!.axes.length > platform.controlled.length;
  const hasCamera = Boolean(job?.offers["simulated_camera"]);
  const busy = job?.running ?? false;
  const poses = count.trim() ? Number(count) : null;
  const valid = poses === null || (Number.isInteger(poses) && poses >= FEWEST && poses <= MOST);
  return (
    <>
      <Guide title="Calibrate the geometry">
        <li>
          <h3>Before</h3>
          <ul class="conditions">
            <Met is={tight}>The platform is at home on tight cables. <em>Lower</em> and <em>Tighten</em> bring it there.</Met>
            <Met is={!inForce}>The robot runs with the geometry of its file.{inForce && ` Now calibration ${inForce.version ?? ""} is in force: undo it, and start the robot again.`}</Met>
            {!redundant && <Met is={camera}>With one cable for each direction, lengths alone show nothing. A camera or measured points are needed.</Met>}
          </ul>
          {inForce && <button disabled={busy} onClick={() => void start({ procedure: "undo" })}>Undo the calibration in force</button>}
        </li>
        <li>
          <h3>Measure</h3>
          <p>The platform moves through poses in its box of targets. The robot reads its cables at each. Nothing is adopted yet.</p>
          <div class="row">
            <label>Poses <input class="number" inputMode="numeric" placeholder="auto" value={count} aria-invalid={!valid} onInput={(event) => setCount(event.currentTarget.value)} /></label>
            <span class={valid ? "quiet" : "fault"}>{valid ? "empty: as many as improve the result, up to 100" : `Allowed: ${FEWEST} to ${MOST}`}</span>
            {hasCamera && <label class="consent"><input type="checkbox" checked={camera} onChange={(event) => setCamera(event.currentTarget.checked)} /> <span>with the camera on the platform</span></label>}
          </div>
          <div class="row"><button class="go" disabled={!tight || busy || !valid || Boolean(inForce)} onClick={() => void start({ procedure: "measure", poses, camera })}>Measure</button></div>
        </li>
        <li>
          <h3>Judge and adopt</h3>
          <p>The result compares predictions with poses that were not used for the fit. Adopt it there if it is good. It takes effect at the next start.</p>
        </li>
        <li>
          <h3>Check later</h3>
          <p>Ten poses show whether a cable, a drum or an exit point has changed since.</p>
          <button disabled={!tight || busy} onClick={() => void start({ procedure: "check" })}>Check the robot</button>
        </li>
      </Guide>
    </>
  );
}

function Tension({ job, start }: Props) {
  const { description } = useStore();
  const names = description!.axes.map(({ name }) => name);
  const [axis, setAxis] = useState(names[0] ?? "");
  const most_N = description!.limits.tension_max_N[Math.max(0, names.indexOf(axis))] ?? Infinity;
  const [entered, setTyped] = useState<string | null>(null);
  const typed = entered ?? [0.2, 0.5, 1].map((share) => (share * Math.min(10, (0.9 * most_N) / GRAVITY_m_s2)).toPrecision(2)).map(Number).join(", ");
  const masses = typed.split(",").map(Number);
  const valid = masses.length >= 3 && masses.every((one) => one >= 0.05 && one <= 1000);
  const command = `cdpr tension calibrate WINCH --masses ${masses.join(",")} --bus URL`;
  return (
    <Guide title="Calibrate a winch by tension">
      <li>
        <h3>Winch and masses</h3>
        <div class="row">
          <label>Winch <select value={axis} onChange={(event) => setAxis(event.currentTarget.value)}>{names.map((one) => <option key={one}>{one}</option>)}</select></label>
          <label>Masses, kg <input value={typed} size={14} aria-invalid={!valid} onInput={(event) => setTyped(event.currentTarget.value)} /></label>
        </div>
        {!valid && <p class="fault">Allowed: at least three numbers, such as 2, 5, 10.</p>}
      </li>
      <li>
        <h3>What will happen</h3>
        <p>The winch raises and lowers each mass at constant speed. Torque over tension gives the gain of the winch and its friction.</p>
      </li>
      <li>
        {description!.simulated
          ? <><p class="quiet">The robot is simulated: a separate simulated winch raises the masses.</p>
            <div class="row"><button class="go" disabled={!valid || job?.running} onClick={() => void start({ procedure: "tension", axis, masses_kg: masses })}>Calibrate {axis}</button></div></>
          : <><p>Somebody hangs each mass and confirms it at a terminal. End the daemon first, then enter:</p><pre tabIndex={0}>{command}</pre></>}
      </li>
    </Guide>
  );
}

function Lens({ job, start }: Props) {
  const [images, setImages] = useState(30);
  const { description } = useStore();
  return (
    <Guide title="Calibrate the camera's lens">
      <li>
        <h3>Board</h3>
        <p>{description!.simulated
          ? "The simulated camera looks at a ChArUco board of 9 by 6 squares of 28 mm, from random places."
          : "Print a board with `cdpr markers board`, glue it to a flat plate, and measure a square."}</p>
      </li>
      {description!.simulated
        ? <li>
            <h3>Images</h3>
            <div class="row">
              <label>Number <select value={images} onChange={(event) => setImages(Number(event.currentTarget.value))}>{[12, 20, 30, 50].map((one) => <option key={one}>{one}</option>)}</select></label>
              <button class="go" disabled={job?.running} onClick={() => void start({ procedure: "lens", images })}>Calibrate the lens</button>
            </div>
          </li>
        : <li><h3>Images</h3><p>Move the board through the whole image, tilted, near and far:</p><pre tabIndex={0}>cdpr camera calibrate opencv:0 --out lens.toml</pre></li>}
      <li>
        <h3>What to do next</h3>
        <p>The result names the views that are still missing. With the lens calibrated, <em>Geometry</em> can use the camera.</p>
      </li>
    </Guide>
  );
}

/** What came out, and the next step. */
function Results({ job, start }: { job: Job; start: Props["start"] }) {
  const result = job.result!;
  switch (job.procedure) {
    case "measure": return <GeometryResult job={job} start={start} />;
    case "adopt": return <Result title="Adopted" good={Boolean(result["in_force"])} text={result["in_force"] ? "The calibration takes effect at the next start of the robot." : `Not adopted: ${String(result["not_taken_over"] ?? "")}`} />;
    case "check": return <Result title="Check" good={result["ok"] === true} text={result["ok"] ? "Nothing has changed enough to matter." : "The robot has changed. The messages name the part. Calibrate it again."} />;
    case "undo": return <Result title="Undone" good text="The previous geometry applies from the next start of the robot." />;
    case "tension": return <TensionResult job={job} />;
    case "lens": return <LensResult job={job} />;
    default: return null;
  }
}

function Result({ title, good, text, children }: { title: string; good: boolean; text: string; children?: ComponentChildren }) {
  return (
    <section class="card" aria-label={title}>
      <h2>{title}</h2>
      <p class={good ? "on" : "busy"}><strong>{sentence(text)}</strong></p>
      {children}
    </section>
  );
}

const Figures = ({ of }: { of: [string, string][] }) => (
  <dl class="key-figures">{of.map(([name, value]) => <div key={name}><dt>{name}</dt><dd>{value}</dd></div>)}</dl>
);

const figure = (value: unknown, digits: number, unit: string, factor = 1): string => (typeof value === "number" ? `${(factor * value).toFixed(digits)} ${unit}` : "–");

interface Geometry {
  good: boolean;
  verdict: string[];
  objections: string[];
  poses: number;
  change: { significant: boolean; positions_move_by_mm: number };
  predicted_3_sigma_mm: number;
  verification: { length_residual_mm: number; length_residual_before_mm: number; mean_position_error_mm: number | null; mean_position_error_before_mm: number | null };
  faults: { text: string }[];
  open: { what: string; advice: string }[];
}

function GeometryResult({ job, start }: { job: Job; start: Props["start"] }) {
  const found = job.result as unknown as Geometry;
  const [anyway, setAnyway] = useState(false);
  if (!found.verification) return null;
  const { verification: seen, change } = found;
  const measurement = String(job.values["measurement"]);
  const advices = [...new Set(found.open.map(({ advice }) => advice))];
  const before = seen.mean_position_error_before_mm, after = seen.mean_position_error_mm;
  return (
    <Result title="Verdict" good={found.good} text={!found.good ? "The calibration is not good." : change.significant ? "The calibration is good." : "The calibration is good, but changes nothing significant."}>
      {found.objections.map((one) => <p key={one}>{sentence(one)}</p>)}
      <Figures of={[
        ["Poses", String(found.poses)],
        ["Length residual before", figure(seen.length_residual_before_mm, 2, "mm")], ["after", figure(seen.length_residual_mm, 2, "mm")],
        ...(after != null ? [["Position error before", figure(before, 1, "mm")], ["after", figure(after, 1, "mm")]] as [string, string][] : []),
        ["Uncertainty, 3 sigma", figure(found.predicted_3_sigma_mm, 1, "mm")], ["Positions move by", figure(change.positions_move_by_mm, 1, "mm")],
      ]} />
      {found.faults.map(({ text }) => <p key={text} class="fault">{sentence(text)}</p>)}
      <Drawn job={job} about="errors at the poses" />
      <details><summary>Whole verdict</summary><ul>{found.verdict.map((one) => <li key={one}>{sentence(one)}</li>)}</ul></details>
      {found.open.length > 0 && <><h3 class="next-steps">What to do next</h3><ul>{advices.map((advice) => <li key={advice}>{sentence(advice)} <small class="quiet">Not known without it: {found.open.filter((one) => one.advice === advice).map(({ what }) => what).join("; ")}.</small></li>)}</ul></>}
      {found.good && (
        <>
          {!change.significant && <label class="consent"><input type="checkbox" checked={anyway} onChange={(event) => setAnyway(event.currentTarget.checked)} /> <span>Adopt the calibration although its changes are not significant.</span></label>}
          <div class="row"><button class="go" disabled={!change.significant && !anyway} onClick={() => void start({ procedure: "adopt", measurement, insignificant: anyway })}>Adopt</button></div>
        </>
      )}
    </Result>
  );
}

/** A picture that the procedure has drawn. */
function Drawn({ job, about }: { job: Job; about: string }) {
  return <>{job.reports.filter(({ path }) => path.endsWith(".png")).map(({ title, path }) => <a key={path} href={path} target="_blank" rel="noopener"><img class="drawn" src={path} alt={`${title}: ${about}`} /></a>)}</>;
}

function TensionResult({ job }: { job: Job }) {
  const found = job.result as Record<string, unknown>;
  if (!found["gain_m"]) return null;
  const plusMinus = (key: string, half: string, unit: string): string => `${figure(found[key], 3, "", 1e3)}± ${figure(found[half], 3, unit, 1e3)}`;
  return (
    <Result title="Winch" good text="The winch is identified.">
      <Figures of={[
        ["Gain", plusMinus("gain_m", "gain_half_width_m", "mNm/N")],
        ["Friction", plusMinus("friction_Nm", "friction_half_width_Nm", "mNm")],
        ["Residual, rms", figure(found["residual_rms_Nm"], 1, "mNm", 1e3)],
      ]} />
      <Drawn job={job} about="torque over tension, and the residuals" />
      <pre tabIndex={0}>{String(found["calibration"] ?? "")}</pre>
    </Result>
  );
}

function LensResult({ job }: { job: Job }) {
  const found = job.result as unknown as { rms_px?: number; focal_px?: number[]; centre_px?: number[]; used?: number; left_out?: string[]; missing?: string[] };
  if (found.rms_px === undefined) return null;
  const missing = found.missing ?? [];
  return (
    <Result title="Lens" good={missing.length === 0} text={missing.length ? "The lens is calibrated, but views are missing." : "No more images are needed."}>
      <Figures of={[
        ["Corners fit to, rms", figure(found.rms_px, 3, "px")], ["Images used", String(found.used)],
        ["Focal lengths", (found.focal_px ?? []).map((one) => one.toFixed(1)).join(", ") + " px"], ["Centre", (found.centre_px ?? []).map((one) => one.toFixed(1)).join(", ") + " px"],
      ]} />
      {missing.length > 0 && <><h3 class="next-steps">What to do next</h3><ul>{missing.map((one) => <li key={one}>{sentence(one)}</li>)}</ul></>}
      {(found.left_out ?? []).map((one) => <p key={one} class="quiet">Left out: {one}</p>)}
      <Drawn job={job} about="detected corners over the image, their residuals, and images of the board" />
    </Result>
  );
}
