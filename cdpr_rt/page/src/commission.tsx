// Commissioning of motors: choose, detach, confirm, run, and what came out.
import { useState } from "preact/hooks";
import type { Description, Job } from "./daemon";
import { Progress, useJob } from "./procedure";
import { useStore } from "./store";

const UNPOWERED = ["unconfigured", "inactive", "ready"];

export function Commission() {
  const { description, status, connected } = useStore();
  const { job, start } = useJob();
  const [axes, setAxes] = useState<string[]>([]);
  const [quick, setQuick] = useState(true);
  const [detached, setDetached] = useState(false);
  if (!description || !status) return null;
  const chosen = description.axes.map(({ name }) => name).filter((name) => axes.includes(name));
  const powered = !description.simulated && !UNPOWERED.includes(status.state);
  const ready = connected && chosen.length > 0 && detached && !powered && !job?.running;
  const begin = (): void => {
    setDetached(false);
    void start({ procedure: "commission", axes: chosen, quick, detached: true });
  };
  return (
    <div class="columns">
      <div class="column wide">
        <section class="card" aria-labelledby="commission">
          <h2 id="commission">Commission motors</h2>
          <ol class="guide">
            <li><Choice description={description} axes={chosen} choose={setAxes} /></li>
            <li>
              <fieldset>
                <legend>How thoroughly</legend>
                <label class="consent"><input type="radio" name="plan" checked={quick} onChange={() => setQuick(true)} /> <span>Quick: a rough result after about 4 min for each motor</span></label>
                <label class="consent"><input type="radio" name="plan" checked={!quick} onChange={() => setQuick(false)} /> <span>Thorough: about 20 min for each motor</span></label>
              </fieldset>
            </li>
            <li>
              <h3>What will happen</h3>
              <p>One motor after the other finds its encoder index, turns slowly both ways, then at up to 600 deg/s, and refines the result. It then follows a ramp with and without compensation. It gets at most a quarter of its rated torque.</p>
              <p class="quiet">{description.simulated
                ? "The robot is simulated: the measurement runs on separate simulated motors, without cables."
                : "The control loop releases the bus for this time, and takes it again afterwards. The power is off at the end."}</p>
            </li>
            <li>
              <h3>Detach the motors</h3>
              <label class="consent"><input type="checkbox" checked={detached} disabled={!chosen.length} onChange={(event) => setDetached(event.currentTarget.checked)} />
                <span>The cables are off the drums, the {chosen.length > 1 ? "motors turn" : "motor turns"} freely, and nobody is near.</span></label>
            </li>
            <li>
              <button class="go" disabled={!ready} onClick={begin}>Commission{chosen.length ? ` ${chosen.join(", ")}` : ""}</button>
              {!chosen.length ? <p class="quiet">Choose a motor first.</p> : !detached && <p class="quiet">Confirm that its cable is off.</p>}
              {powered && <p class="fault">Switch the power off first: the motors are in use.</p>}
            </li>
          </ol>
        </section>
      </div>
      <div class="column">
        {job?.procedure === "commission" && <Progress job={job} curves />}
        {job?.procedure === "commission" && !job.running && job.result && <Results job={job} />}
        {job?.running && job.procedure !== "commission" && <section class="card"><p>{job.client} runs another procedure: {job.what}.</p></section>}
        {job?.procedure !== "commission" && <About />}
      </div>
    </div>
  );
}

function Choice({ description, axes, choose }: { description: Description; axes: string[]; choose: (names: string[]) => void }) {
  const names = description.axes.map(({ name }) => name);
  return (
    <fieldset>
      <legend>Motors</legend>
      <div class="choice">
        {description.axes.map(({ name, motor }) => (
          <label key={name} class="consent">
            <input type="checkbox" checked={axes.includes(name)} onChange={(event) => choose(event.currentTarget.checked ? [...axes, name] : axes.filter((one) => one !== name))} />
            <span>{name} <small class="quiet">{motor}</small></span>
          </label>
        ))}
      </div>
      <button class="plain" onClick={() => choose(axes.length === names.length ? [] : names)}>{axes.length === names.length ? "Choose none" : "Choose all"}</button>
    </fieldset>
  );
}

function About() {
  return (
    <section class="card" aria-labelledby="about">
      <h2 id="about">What it is for</h2>
      <p>Permanent magnets pull a rotor into preferred positions. This cogging and the motor's friction disturb slow motions. Commissioning measures both, so that the control can compensate them.</p>
      <p class="quiet">Nothing has been measured since the daemon was started.</p>
    </section>
  );
}

interface Method { rms_position_error_deg: number; peak_pid_effort_Nm: number; peak_velocity_error_deg_s: number; ratios: Record<string, number | null> }
interface Measured {
  identification: { orders: number[]; amplitudes_Nm: number[]; confidence_Nm: number[]; hints: string[]; coulomb_forward_Nm: number; coulomb_backward_Nm: number; inertia_kg_m2: number };
  validation: { none: Method; thesis: Method; harmonic: Method; targets: Record<string, Record<string, number>>; judged_on: string };
}

/** What came out for each motor, and whether it is good. */
function Results({ job }: { job: Job }) {
  const axes = (job.result as { axes?: Record<string, Measured> }).axes;
  if (!axes) return null;
  return (
    <>
      {Object.entries(axes).map(([name, one]) => <Result key={name} name={name} found={one} />)}
      <section class="card" aria-labelledby="use">
        <h2 id="use">Use it</h2>
        <p>Start the robot with the measured motors:</p>
        <pre tabIndex={0}>cdpr run {String(job.values["robot"])} --commissioned {String(job.values["folder"])}</pre>
      </section>
    </>
  );
}

const RATIOS: [key: string, title: string, value: (one: Method) => string][] = [
  ["rms_position_error", "Position error, rms", (one) => `${one.rms_position_error_deg.toFixed(4)} deg`],
  ["peak_pid_effort", "Effort, peak", (one) => `${(1e3 * one.peak_pid_effort_Nm).toFixed(1)} mNm`],
  ["peak_velocity_error", "Velocity error, peak", (one) => `${one.peak_velocity_error_deg_s.toFixed(2)} deg/s`],
];

function Result({ name, found }: { name: string; found: Measured }) {
  const { identification: motor, validation } = found;
  const targets = validation.targets["harmonic"] ?? {};
  const missed = RATIOS.filter(([key]) => (validation.harmonic.ratios[key] ?? Infinity) < (targets[key] ?? 0));
  return (
    <section class="card" aria-label={`Result of ${name}`}>
      <h2>{name}</h2>
      <p class={missed.length ? "busy" : "on"}><strong>{missed.length
        ? `Below its target: ${missed.map(([, title]) => title.toLowerCase()).join("; ")}. The report explains why.`
        : "All targets are reached."}</strong></p>
      <div class="scroll" tabIndex={0}>
        <table>
          <thead><tr><th>slow ramp</th><th>without</th><th>compensated</th><th>smaller</th></tr></thead>
          <tbody>
            {RATIOS.map(([key, title, value]) => (
              <tr key={key}><td>{title}</td><td>{value(validation.none)}</td><td>{value(validation.harmonic)}</td><td>{validation.harmonic.ratios[key]?.toFixed(1) ?? "–"} times</td></tr>
            ))}
          </tbody>
        </table>
      </div>
      <p class="quiet">
        Cogging: {motor.orders.map((order, number) => `order ${order}, ${(1e3 * motor.amplitudes_Nm[number]!).toFixed(1)} ± ${(1e3 * motor.confidence_Nm[number]!).toFixed(1)} mNm`).join("; ") || "none found"}.
        {" "}Friction {(1e3 * motor.coulomb_forward_Nm).toFixed(0)} mNm forward, {(1e3 * motor.coulomb_backward_Nm).toFixed(0)} mNm backward.
      </p>
    </section>
  );
}
