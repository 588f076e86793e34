// The procedure that the daemon runs for a page: its progress, curves, end and reports.
import { useEffect, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { type Curves, type Job, type Wanted, clientName, repeat, request } from "./daemon";
import { store, useStore } from "./store";
import { axisStyle, curveColour } from "./trend";
import "./procedure.css";

const LOOK_MS = 500;
let latest: Job | null = null;
let endPolling = (): void => {};

/** Return the procedure that runs or ran last, kept up to date while the calling component is shown. */
export function useJob(): { job: Job | null; start: (wanted: Wanted) => Promise<void> } {
  const { connected } = useStore();
  const [job, setJob] = useState<Job | null>(latest);
  const show = (value: Job): void => {
    const mine = value.client === clientName(), ended = latest?.running && !value.running && mine;
    store.procedure = value.running && mine;
    setJob((latest = value));
    const { status } = store; // a motion that has begun since keeps the right
    if (ended && (status?.state !== "active" || status.program === "hold")) store.right.release();
  };
  useEffect(() => {
    if (!connected) return;
    let shown = true;
    endPolling(); // of a view that was left while the procedure ran
    const end = repeat(async () => {
      try {
        const value = await request<Job>("GET", "/procedure");
        if (JSON.stringify(value) !== JSON.stringify(latest)) show(value);
      } catch {
        // the daemon is away; tried again
      }
      if (!shown && !store.procedure) end();
    }, LOOK_MS);
    endPolling = end;
    return () => {
      shown = false; // in another view, the right is given back when the procedure has ended
      if (!store.procedure) end();
    };
  }, [connected]);
  return { job, start: (wanted) => store.attempt(async () => show(await store.right.procedure(wanted))) };
}

const end = (): void => void store.attempt(() => request("DELETE", "/procedure"));

/** Progress and curves of a running procedure, or how the last one ended. */
export function Progress({ job, curves = false }: { job: Job; curves?: boolean }) {
  const last = job.steps.length - 1;
  return (
    <section class="card" aria-labelledby="progress">
      <div class="head">
        <h2 id="progress">{job.running ? "Running" : "Last run"}</h2>
        {job.running && <button onClick={end}>{job.ending ? "Remove the power now" : "Cancel"}</button>}
      </div>
      <p class="begun"><strong>{sentence(job.what)}</strong> <span class="quiet">by {job.client === clientName() ? "this page" : job.client}</span></p>
      {job.running && <p class="quiet">{job.ending ? `It ends: ${job.ending}.` : "Keep this page open: the procedure ends if the page is closed or does not respond."}</p>}
      {job.running && !job.steps.length && <p>{sentence(job.lines.at(-1) ?? "starting …")}</p>}
      {!job.running && <Ending job={job} />}
      {job.steps.length > 0 && (
        <ol class="steps">
          {job.steps.map(({ what, share }, number) => {
            const done = number < last || !job.running;
            return (
              <li key={number} class={done ? "done" : "now"}>
                <span>{sentence(what.replace(/ \(.*% of all\)$/, ""))}</span>
                {!done && share != null ? <progress max={1} value={share} aria-label={what} /> : <small>{done ? (job.error && number === last ? "ended" : "done") : "working"}</small>}
              </li>
            );
          })}
        </ol>
      )}
      {curves && job.running && <LiveCurves />}
      {job.lines.length > 0 && <details><summary>Messages</summary><pre tabIndex={0}>{job.lines.join("\n")}</pre></details>}
    </section>
  );
}

function Ending({ job }: { job: Job }) {
  const pages = job.reports.filter(({ path }) => path.endsWith(".html"));
  return (
    <>
      <p class={job.error ? "fault" : "on"}>{job.error ? sentence(job.error) : "The procedure is finished."}</p>
      {pages.length > 0 && (
        <p class="links">{pages.map(({ title, path }) => <a key={path} href={path} target="_blank" rel="noopener">Open the report: {title}</a>)}</p>
      )}
    </>
  );
}

export const sentence = (text: string): string => {
  const first = text.charAt(0).toUpperCase() + text.slice(1);
  return /[.!?]$/.test(first) || first.length < 40 ? first : `${first}.`;
};

const SHOWN: { key: "error_deg" | "torque_Nm"; title: string }[] = [
  { key: "error_deg", title: "Position error, deg" }, { key: "torque_Nm", title: "Torque, Nm" },
];

/** The last seconds of the measurement that runs. */
function LiveCurves() {
  const [found, setFound] = useState<Curves | null>(null);
  useEffect(() => repeat(
    () => request<Curves>("GET", "/procedure/curves").then((value) => value.time_s.length && setFound(value), () => undefined), 2 * LOOK_MS,
  ), []);
  if (!found?.time_s.length) return null;
  return (
    <div class="trends">
      {SHOWN.map(({ key, title }, number) => <Curve key={key} title={title} time_s={found.time_s} values={found[key]} colour={curveColour(number)} />)}
    </div>
  );
}

function Curve({ title, time_s, values, colour }: { title: string; time_s: number[]; values: (number | null)[]; colour: string }) {
  const host = useRef<HTMLDivElement>(null), plot = useRef<uPlot | null>(null);
  useEffect(() => {
    const element = host.current!;
    const axes = [{ ...axisStyle(), size: 26, values: (_: uPlot, ticks: number[]) => ticks.map((one) => `${one} s`) }, { ...axisStyle(), size: 50 }];
    plot.current = new uPlot(
      { width: element.clientWidth || 300, height: 150, cursor: { show: false }, legend: { show: false }, scales: { x: { time: false } }, axes, series: [{}, { stroke: colour, width: 1.2 }] },
      [[], []], element,
    );
    const observer = new ResizeObserver(() => plot.current?.setSize({ width: element.clientWidth, height: 150 }));
    observer.observe(element);
    return () => {
      observer.disconnect();
      plot.current?.destroy();
    };
  }, []);
  useEffect(() => plot.current?.setData([time_s, values]), [time_s]);
  return <figure><figcaption>{title}</figcaption><div class="trend" ref={host} /></figure>;
}
