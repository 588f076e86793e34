// Paths from G-code or way points: plan, look at, follow, pause, step back, continue.
import { useEffect, useState } from "preact/hooks";
import { type Planned, Rejected, clientName, hasKey, request } from "./daemon";
import { Moving, positionsOf, presentPose } from "./move";
import { type PathProgress, progressOf } from "./situation";
import { store, useStore } from "./store";

const KINDS = ".nc,.ngc,.gcode,.tap,.cnc,.toml,.csv";
const MOST_BYTES = 1 << 21;
const LOOK_MS = 300;
const FEED_MS = 150;
const BACKS_MM = [10, 50, 100, 500];

const isGcode = (name: string): boolean => !/\.(toml|csv)$/i.test(name);

/** The file's name as the daemon accepts it. */
const plainName = (name: string): string => {
  const dot = name.lastIndexOf(".");
  const stem = name.slice(0, dot).replace(/[^A-Za-z0-9_. -]/g, "-").replace(/^[-_. ]+/, "").slice(0, 48);
  return `${stem || "path"}${name.slice(dot).toLowerCase()}`;
};

const clock = (seconds: number): string => seconds < 60 ? `${seconds.toFixed(0)} s` : `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")} min`;

const lengthText = (length_m: number): string => `${length_m.toFixed(length_m < 10 ? 2 : 1)} m`;

/** Let the daemon plan, and show the result; throws `Rejected`. */
async function plan(body: Record<string, unknown>): Promise<void> {
  const { number } = await request<Planned>("POST", "/path", { ...body, client: clientName() });
  for (;;) {
    const job = await request<Planned>("GET", "/path");
    if (job.number !== number) throw new Rejected("Another client has planned a path.");
    store.change({ path: job });
    if (!job.planning) return;
    await new Promise((resume) => setTimeout(resume, LOOK_MS));
  }
}

export function Path() {
  const { description, status } = useStore();
  if (!description?.platform || !description.programs.includes("path") || !status || !hasKey()) return null;
  const under = progressOf(status).path;
  const follows = under && status.state === "active" && (status.program === "path" || under.time_s < under.duration_s);
  const finished = status.program === "path" && progressOf(status).done === 1;
  return (
    <Moving name="path" title="Path">
      {follows && !finished && <Following path={under} running={status.program === "path"} />}
      <Choice busy={status.program === "path" && !finished} />
    </Moving>
  );
}

interface Options {
  origin: string[];
  blend_mm: string;
  scale: string;
  rotate_deg: string;
  z_mm: string;
}

/** Choose a file, place it in the room, and look at its plan. */
function Choice({ busy }: { busy: boolean }) {
  const { description, path } = useStore();
  const platform = description!.platform!;
  const [file, setFile] = useState<{ name: string; text: string } | null>(null);
  const [options, setOptions] = useState<Options>({ origin: [], blend_mm: "1", scale: "1", rotate_deg: "0", z_mm: "" });
  const [stale, setStale] = useState(false);
  const isPlanning = path?.planning ?? false;
  const work = (name: string, text: string, how: Options, line = 0): void => {
    setStale(false);
    const placed = isGcode(name) ? {
      origin_mm: how.origin.join(" "), blend_mm: Number(how.blend_mm), scale: Number(how.scale), rotate_deg: Number(how.rotate_deg),
      ...(how.z_mm.trim() ? { z_mm: Number(how.z_mm) } : {}),
    } : {};
    void store.attempt(() => plan({ name: plainName(name), text, line, ...placed }));
  };
  const take = async (chosen: File): Promise<void> => {
    if (chosen.size > MOST_BYTES) return store.change({ rejected: `${chosen.name}: ${(chosen.size / 1e6).toFixed(1)} MB; allowed: 2 MB. Use \`cdpr path run\`.` });
    const text = await chosen.text();
    const how = { ...options, origin: options.origin.length ? options.origin : presentPose(platform)!.slice(0, positionsOf(platform).length) };
    setFile({ name: chosen.name, text });
    setOptions(how);
    work(chosen.name, text, how);
  };
  const field = (label: string, value: string, change: (text: string) => Partial<Options>) => (
    <label key={label}>
      <span>{label}</span>
      <input inputMode="decimal" autocomplete="off" value={value} onInput={(event) => { setStale(true); setOptions({ ...options, ...change(event.currentTarget.value) }); }} />
    </label>
  );
  return (
    <form onSubmit={(event) => { event.preventDefault(); if (file) work(file.name, file.text, options); }}>
      <label class="file">
        <input type="file" accept={KINDS} disabled={isPlanning || busy} onChange={(event) => {
          const chosen = event.currentTarget.files?.[0];
          event.currentTarget.value = ""; // the same file may be chosen again, after a change
          if (chosen) void take(chosen);
        }} />
        <span>{file ? "Choose another file" : "Choose a file"}</span>
        <span class="quiet">{file?.name ?? "G-code or way points"}</span>
      </label>
      {file && isGcode(file.name) && (
        <details open={stale || path?.error != null}>
          <summary>Place and options</summary>
          <div class="target">
            {positionsOf(platform).map((name, number) => field(`zero ${name}, mm`, options.origin[number] ?? "", (text) => ({ origin: options.origin.map((one, at) => (at === number ? text : one)) })))}
            {field("corners, mm", options.blend_mm, (text) => ({ blend_mm: text }))}
            {field("scale", options.scale, (text) => ({ scale: text }))}
            {field("turn, deg", options.rotate_deg, (text) => ({ rotate_deg: text }))}
            {positionsOf(platform).length > 2 && field("z, if not in the file", options.z_mm, (text) => ({ z_mm: text }))}
          </div>
          <div class="row"><button disabled={!stale || isPlanning}>Plan again</button></div>
        </details>
      )}
      {path && <Verdict path={path} stale={stale} busy={busy} next={file && path.next_line != null ? () => work(file.name, file.text, options, path.next_line!) : null} />}
    </form>
  );
}

function Verdict({ path, stale, busy, next }: { path: Planned; stale: boolean; busy: boolean; next: (() => void) | null }) {
  if (path.planning) return <p role="status">Planning: checking workspace, contacts, tensions and torques …</p>;
  if (path.error) return <p class="verdict bad" role="status">{path.error}</p>;
  if (!path.plan) return null;
  return (
    <>
      <p class="verdict good" role="status">The robot can follow the path: {lengthText(path.length_m ?? 0)} in {clock(path.duration_s ?? 0)}.</p>
      {path.notices?.map((one) => <p key={one} class="quiet">{one}</p>)}
      {path.next_line != null && <p class="quiet">This plan ends before line {path.next_line}.</p>}
      <div class="row">
        <button type="button" class="go" disabled={busy || stale} onClick={() => void store.attempt(() => store.right.program("path", { plan: path.plan! }))}>Follow the path</button>
        {next && <button type="button" disabled={busy} onClick={next}>Plan from line {path.next_line}</button>}
        <button type="button" class="plain" disabled={busy} onClick={() => store.change({ path: null })}>Discard</button>
      </div>
    </>
  );
}

/** The path that is followed or was left, and what to do with it. */
function Following({ path, running }: { path: PathProgress; running: boolean }) {
  const [back, setBack] = useState(100);
  const rests = !running || path.waiting !== "";
  const percent = (100 * path.time_s) / Math.max(path.duration_s, 1e-9);
  const left_s = (path.duration_s - path.time_s) / Math.max(path.feed, 0.01);
  const wish = (wanted: Record<string, unknown>) => () =>
    void store.attempt(() => (running ? store.right.set(wanted) : store.right.program("path", wanted)));
  const where = !running ? "Left" : path.waiting || (path.stage === "path" ? "Following it" : "Moving to it");
  return (
    <div class="following">
      <p><strong>{path.name}</strong> <span class="quiet">{where}</span></p>
      <progress max={100} value={percent} aria-label="Part of the path that is done" />
      <p class="figures">
        <span>{percent.toFixed(0)} %</span><span>line {path.line}</span>
        <span>{lengthText(path.along_m)} of {lengthText(path.length_m)}</span><span>{clock(left_s)} left</span>
      </p>
      <div class="row">
        {rests
          ? <button type="button" class="go" onClick={wish({ resume: true })}>Resume the path</button>
          : <button type="button" onClick={wish({ pause: true })}>Pause the path</button>}
        <button type="button" disabled={!rests} onClick={wish({ back_m: back / 1e3 })}>Back</button>
        <label>by <select aria-label="Distance back" value={back} onChange={(event) => setBack(Number(event.currentTarget.value))}>
          {BACKS_MM.map((one) => <option key={one} value={one}>{one} mm</option>)}
        </select></label>
      </div>
      {running && <Feed feed={path.feed} />}
    </div>
  );
}

/** The feed as a share of the planned speed; it acts while it is dragged. */
function Feed({ feed }: { feed: number }) {
  const [wanted, setWanted] = useState<number | null>(null);
  useEffect(() => {
    if (wanted === null) return;
    const timer = setTimeout(() => void store.attempt(() => store.right.set({ feed: wanted / 100 })).then(() => setWanted(null)), FEED_MS);
    return () => clearTimeout(timer);
  }, [wanted]);
  const shown = wanted ?? Math.round(100 * feed);
  return (
    <label class="feed">
      <span>Feed</span>
      <input type="range" min={1} max={100} value={shown} onInput={(event) => setWanted(Number(event.currentTarget.value))} />
      <span>{shown} %</span>
    </label>
  );
}
