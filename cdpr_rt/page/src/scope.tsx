// Scope: any recorded quantity, live and from recordings; trigger, zoom, cursors, figures, export.
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { linkTo, useView } from "./address";
import { type Columns, type Description, type Quantity, request, saveAs } from "./daemon";
import { LiveFeed, type Samples, type ScopeCurve, type Trigger, asCsv, between, curvesOf, figure, placeOf, stepFigures, wordsOf } from "./scope_data";
import { ScopePlot } from "./scope_plot";
import { Step } from "./step";
import { store, useStore } from "./store";
import { curveColour } from "./trend";
import "./data.css";

const SPANS_S = [1, 2, 5, 10, 20, 40];
const DRAW_MS = 100, SHARE = 2;
const POINTS = 6000;
const MOST_CURVES = 24;
const NONE: Samples = { time_s: [], values: [] };
const NO_TRIGGER: Trigger = { mode: "off", curve: "", level: 0, rising: true, once: false };
const CHOSEN = "cdpr-scope";

export function Scope() {
  const { description } = useStore();
  const [quantities, setQuantities] = useState<Quantity[]>([]);
  useEffect(() => void store.attempt(async () => setQuantities((await request<{ fields: Quantity[] }>("GET", "/fields")).fields)), []);
  const known = useMemo(() => (description ? quantities.flatMap((one) => curvesOf(one, description)) : []), [quantities, description]);
  if (!description || !known.length) return <section class="card"><p class="quiet">Waiting for the robot's description.</p></section>;
  return <ScopeOf known={known} quantities={quantities} description={description} />;
}

/** Return the chosen curves, which this tab remembers; at first the tensions, or the motors' angles. */
function useChosen(known: ScopeCurve[], description: Description): [ScopeCurve[], (ids: string[]) => void] {
  const first = description.platform ? "tension_N" : "position_rad";
  const [ids, setIds] = useState<string[]>(() => {
    const kept = (JSON.parse(sessionStorage.getItem(CHOSEN) ?? "[]") as string[]).filter((id) => known.some((one) => one.id === id));
    return kept.length ? kept : known.filter((one) => one.field === first).map((one) => one.id);
  });
  const change = (wanted: string[]): void => {
    const some = wanted.slice(0, MOST_CURVES);
    sessionStorage.setItem(CHOSEN, JSON.stringify(some));
    setIds(some);
  };
  return [useMemo(() => ids.flatMap((id) => known.find((one) => one.id === id) ?? []), [ids, known]), change];
}

function ScopeOf({ known, quantities, description }: { known: ScopeCurve[]; quantities: Quantity[]; description: Description }) {
  const file = useView().args.get("file");
  const [curves, choose] = useChosen(known, description);
  const ids = curves.map((one) => one.id).join();
  const [trigger, setTrigger] = useState(NO_TRIGGER);
  const [span_s, setSpan] = useState(10);
  const [zoom, setZoom] = useState<[number, number] | null>(null);
  const [cursors, setCursors] = useState<(number | null)[]>([null, null]);
  const recorded = useRecorded(file, ids, curves);
  const live = useLive(file === null, ids, curves, trigger, span_s);
  const { samples, window: all } = file === null ? live : recorded;
  const shown = zoom ?? all;
  useEffect(() => {
    setZoom(null);
    setCursors([null, null]);
  }, [file]);
  const still = file !== null || live.paused;
  const zoomTo = (from_s: number, until_s: number): void => {
    if (file === null) live.pause();
    setZoom([from_s, until_s]);
  };
  const place = (at_s: number): void => {
    if (!still) return;
    const [a, b] = cursors;
    const which = a === null ? 0 : b === null ? 1 : Math.abs(at_s - a!) <= Math.abs(at_s - b!) ? 0 : 1;
    setCursors(cursors.map((one, number) => (number === which ? at_s : one)));
  };
  const proceed = (): void => {
    setZoom(null);
    setCursors([null, null]);
    live.proceed();
  };
  const showStep = (from_s: number, until_s: number): void => {
    zoomTo(from_s - 0.1 * (until_s - from_s), until_s);
    setCursors([from_s, until_s]);
  };
  return (
    <>
      <section class="card scope" aria-label="Curves">
        <div class="row tools">
          <strong class="source">{file === null ? "Live" : file}</strong>
          {file === null
            ? <>
                {live.paused ? <button onClick={proceed}>Continue</button> : <button onClick={live.pause}>Pause</button>}
                <label>Time <select value={span_s} onChange={(event) => setSpan(Number(event.currentTarget.value))}>{SPANS_S.map((one) => <option key={one} value={one}>{one} s</option>)}</select></label>
              </>
            : <>
                <a class="button" href={linkTo("scope")}>Show live values</a>
                {zoom && recorded.each > 1 && <button onClick={() => recorded.read(zoom)}>Read this stretch in detail</button>}
              </>}
          {zoom && <button onClick={() => { setZoom(null); if (file !== null) recorded.read(null); }}>Show all</button>}
          <button onClick={() => exportShown(between(samples, ...shown), curves)} disabled={!samples.time_s.length}>Export as CSV</button>
        </div>
        <Plot curves={curves} ids={ids} samples={samples} window={shown} cursors={cursors} zoomTo={zoomTo} place={place} />
        <p class="quiet note" role="status">{file === null ? live.text : recorded.text}</p>
        <Chips curves={curves} known={known} quantities={quantities} choose={choose} />
        {file === null && <TriggerChoice trigger={trigger} change={setTrigger} curves={curves} rearm={live.rearm} />}
      </section>
      {still
        ? <Cursors samples={samples} window={shown} curves={curves} cursors={cursors} change={setCursors} zoomTo={zoomTo} />
        : <section class="card"><h2>Cursors</h2><p class="quiet">Pause to place cursors: they show values, differences and the figures of a step response.</p></section>}
      {file === null && <Step description={description} shown={curves.map((one) => one.id)} finished={showStep} show={(ids) => { setTrigger(NO_TRIGGER); choose(ids); proceed(); }} />}
      <Parameters />
    </>
  );
}

function exportShown(samples: Samples, curves: ScopeCurve[]): void {
  const url = URL.createObjectURL(new Blob([asCsv(samples, curves)], { type: "text/csv" }));
  saveAs(url, "scope.csv");
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

interface Shown {
  samples: Samples;
  window: [number, number];
  text: string;
}

/** Live values: the latest of a time, or those around the trigger. */
function useLive(on: boolean, ids: string, curves: ScopeCurve[], trigger: Trigger, span_s: number): Shown & { paused: boolean; pause(): void; proceed(): void; rearm(): void } {
  const [shown, setShown] = useState<{ samples: Samples; window: [number, number] }>({ samples: NONE, window: [0, 1] });
  const [paused, setPaused] = useState(false);
  const [text, setText] = useState("");
  const feed = useRef<LiveFeed | null>(null);
  const wanted = useRef({ trigger, span_s, paused });
  wanted.current = { trigger, span_s, paused };
  useEffect(() => {
    if (!on || !curves.length) return;
    let drawn = 0, cost_ms = 0;
    setPaused(false);
    const made = (feed.current = new LiveFeed(curves, feed.current, () => {
      const { trigger, span_s, paused } = wanted.current, now = performance.now();
      if (paused || now - drawn < Math.max(DRAW_MS, SHARE * cost_ms)) return; // a slow machine has time for a stop, too
      drawn = now;
      requestAnimationFrame(() => setTimeout(() => (cost_ms = performance.now() - now)));
      const window = made.window(trigger, span_s);
      setText(made.refused ? `${made.refused}.` : trigger.mode === "off" ? "" : window ? `Triggered at ${made.triggered_s!.toFixed(3)} s` : "Waiting for the trigger");
      if (!window) return;
      setShown({ samples: between(made.samples, ...window), window });
      const newest = made.samples.time_s[made.samples.time_s.length - 1]!;
      if (trigger.mode !== "off" && trigger.once && newest >= window[1]) setPaused(true);
    }));
    return () => made.close();
  }, [on, ids]);
  useEffect(() => {
    feed.current?.rearm();
    if (trigger.mode !== "off") setPaused(false);
  }, [trigger]);
  const proceed = (): void => {
    feed.current?.rearm();
    setPaused(false);
  };
  return { ...shown, text: paused ? "Paused. Drag across the curves to zoom, press on them to place a cursor." : text, paused, pause: () => setPaused(true), proceed, rearm: proceed };
}

/** Curves of a recording, whole or of a stretch. */
function useRecorded(file: string | null, ids: string, curves: ScopeCurve[]): Shown & { each: number; read(stretch: [number, number] | null): void } {
  const [columns, setColumns] = useState<Columns | null>(null);
  const [text, setText] = useState("");
  const number = useRef(0);
  const read = (stretch: [number, number] | null): void => {
    if (file === null || !curves.length) return;
    const mine = ++number.current;
    const fields = [...new Set(curves.map((one) => one.field))].join();
    const range = stretch ? `&from_s=${Math.max(0, stretch[0])}&until_s=${stretch[1]}` : "";
    setText("Reading the recording. A long one takes a minute.");
    void store.attempt(async () => {
      try {
        const found = await request<Columns>("GET", `/recordings/${encodeURIComponent(file)}/columns?fields=${fields}&points=${POINTS}${range}`);
        if (mine !== number.current) return;
        setColumns(found);
        setText(found.each > 1 ? `${found.cycles} cycles: of each ${found.each}, the smallest and the largest value. Drag to zoom.` : `${found.cycles} cycles. Drag to zoom, press to place a cursor.`);
      } catch (error) {
        if (mine === number.current) setText("");
        throw error;
      }
    });
  };
  useEffect(() => {
    setColumns(null);
    read(null);
    return () => void number.current++;
  }, [file, ids]);
  const samples = useMemo(() => (columns ? { time_s: columns.time_s, values: curves.map(({ id }) => columns.columns[id] ?? []) } : NONE), [columns]);
  const { time_s } = samples;
  return { samples, window: [time_s[0] ?? 0, time_s[time_s.length - 1] ?? 1], text, each: columns?.each ?? 1, read };
}

function Plot({ curves, ids, samples, window, cursors, zoomTo, place }: {
  curves: ScopeCurve[]; ids: string; samples: Samples; window: [number, number]; cursors: (number | null)[];
  zoomTo(from_s: number, until_s: number): void; place(at_s: number): void;
}) {
  const host = useRef<HTMLDivElement>(null), plot = useRef<ScopePlot | null>(null);
  const actions = useRef({ zoomTo, place });
  actions.current = { zoomTo, place };
  useEffect(() => {
    plot.current = new ScopePlot(host.current!, curves, {
      zoomed: (from_s, until_s) => actions.current.zoomTo(from_s, until_s),
      pressed: (at_s) => actions.current.place(at_s),
    });
    return () => plot.current?.close();
  }, [ids]);
  useEffect(() => {
    if (samples.values.length === curves.length) plot.current?.show(samples, window, cursors);
  }, [samples, window[0], window[1], cursors, ids]);
  return <div class="plot" ref={host} role="img" aria-label={`Curves of ${ids || "nothing"}`} />;
}

function Chips({ curves, known, quantities, choose }: { curves: ScopeCurve[]; known: ScopeCurve[]; quantities: Quantity[]; choose(ids: string[]): void }) {
  const [field, setField] = useState(quantities.find((one) => one.per === "axis")?.name ?? quantities[0]!.name);
  const [part, setPart] = useState("");
  const parts = known.filter((one) => one.field === field);
  const chosen = curves.map((one) => one.id);
  const added = parts.filter((one) => !part || one.id === part).map((one) => one.id);
  const groups = { axis: "Of each axis", pose: "Of the platform", robot: "Of the robot" };
  return (
    <>
      <ul class="chips" aria-label="Shown curves">
        {curves.map(({ id, label }, number) => (
          <li key={id}>
            <i style={{ background: curveColour(number) }} />{label}
            <button class="plain" aria-label={`Remove ${label}`} onClick={() => choose(chosen.filter((one) => one !== id))}>×</button>
          </li>
        ))}
      </ul>
      <div class="row">
        <label>Quantity <select value={field} onChange={(event) => { setField(event.currentTarget.value); setPart(""); }}>
          {Object.entries(groups).map(([per, title]) => (
            <optgroup key={per} label={title}>
              {quantities.filter((one) => one.per === per).map(({ name, meaning }) => <option key={name} value={name} title={meaning}>{wordsOf(name)}</option>)}
            </optgroup>
          ))}
        </select></label>
        {parts.length > 1 && <label>Of <select value={part} onChange={(event) => setPart(event.currentTarget.value)}>
          <option value="">all</option>
          {parts.map(({ id }) => <option key={id} value={id}>{id.slice(field.length + 1, -1)}</option>)}
        </select></label>}
        <button onClick={() => choose([...chosen, ...added.filter((id) => !chosen.includes(id))])}>Add</button>
        <button onClick={() => choose(added)}>Show only this</button>
      </div>
      <p class="quiet note">{quantities.find((one) => one.name === field)?.meaning}</p>
    </>
  );
}

const MODES: [Trigger["mode"], string][] = [["off", "none"], ["edge", "edge"], ["level", "level"]];

function TriggerChoice({ trigger, change, curves, rearm }: { trigger: Trigger; change(trigger: Trigger): void; curves: ScopeCurve[]; rearm(): void }) {
  const [level, setLevel] = useState(String(trigger.level));
  const known = curves.some((one) => one.id === trigger.curve);
  const set = (some: Partial<Trigger>): void => change({ ...trigger, curve: known ? trigger.curve : (curves[0]?.id ?? ""), ...some });
  return (
    <fieldset class="row trigger">
      <legend class="hidden">Trigger</legend>
      <label>Trigger <select value={trigger.mode} onChange={(event) => set({ mode: event.currentTarget.value as Trigger["mode"] })}>
        {MODES.map(([mode, words]) => <option key={mode} value={mode}>{words}</option>)}
      </select></label>
      {trigger.mode !== "off" && (
        <>
          <label>on <select value={trigger.curve} onChange={(event) => set({ curve: event.currentTarget.value })}>{curves.map(({ id, label }) => <option key={id} value={id}>{label}</option>)}</select></label>
          <select aria-label="Direction" value={String(trigger.rising)} onChange={(event) => set({ rising: event.currentTarget.value === "true" })}>
            <option value="true">{trigger.mode === "edge" ? "rising through" : "at or above"}</option>
            <option value="false">{trigger.mode === "edge" ? "falling through" : "at or below"}</option>
          </select>
          <input class="number" inputMode="decimal" aria-label="Trigger level" value={level} onInput={(event) => {
            setLevel(event.currentTarget.value);
            if (event.currentTarget.value.trim() && Number.isFinite(Number(event.currentTarget.value))) set({ level: Number(event.currentTarget.value) });
          }} />
          <label class="check"><input type="checkbox" checked={trigger.once} onChange={(event) => set({ once: event.currentTarget.checked })} /> once</label>
          <button onClick={rearm}>Wait again</button>
        </>
      )}
    </fieldset>
  );
}

function Cursors({ samples, window, curves, cursors, change, zoomTo }: {
  samples: Samples; window: [number, number]; curves: ScopeCurve[]; cursors: (number | null)[];
  change(cursors: (number | null)[]): void; zoomTo(from_s: number, until_s: number): void;
}) {
  const [a, b] = cursors;
  const at = (number: number, at_s: number | null | undefined): number | null => (at_s == null ? null : (samples.values[number]?.[placeOf(samples.time_s, at_s)] ?? null));
  const text = (curve: ScopeCurve, value: number | null): string => (value !== null && curve.labels?.[value]) || figure(value);
  const ordered = a != null && b != null ? [Math.min(a, b), Math.max(a, b)] as const : null;
  const slider = (name: string, number: number) => (
    <label class="slider">Cursor {name}
      <input type="range" min={window[0]} max={window[1]} step={(window[1] - window[0]) / 2000} value={cursors[number] ?? window[0]}
        onInput={(event) => change(cursors.map((one, k) => (k === number ? Number(event.currentTarget.value) : one)))} />
      <output>{cursors[number] == null ? "not placed" : `${cursors[number]!.toFixed(4)} s`}</output>
    </label>
  );
  return (
    <section class="card" aria-labelledby="cursors">
      <h2 id="cursors">Cursors</h2>
      {slider("A", 0)}{slider("B", 1)}
      {ordered && ordered[1] > ordered[0] && <div class="row"><button onClick={() => zoomTo(...ordered)}>Zoom to the cursors</button></div>}
      {a == null && <p class="quiet note">Press on the curves, or move a slider, to place a cursor.</p>}
      {(a != null || b != null) && (
        <div class="scroll" tabIndex={0} role="region" aria-label="Values at the cursors">
          <table>
            <thead><tr><th>curve</th><th class="right">A</th><th class="right">B</th><th class="right">B − A</th></tr></thead>
            <tbody>
              <tr><td>time, s</td><td class="right">{a?.toFixed(4) ?? "–"}</td><td class="right">{b?.toFixed(4) ?? "–"}</td><td class="right">{ordered ? figure(b! - a!) : "–"}</td></tr>
              {curves.map((curve, number) => {
                const first = at(number, a), second = at(number, b);
                return (
                  <tr key={curve.id}>
                    <td><i class="dot" style={{ background: curveColour(number) }} />{curve.label}</td>
                    <td class="right">{text(curve, first)}</td><td class="right">{text(curve, second)}</td>
                    <td class="right">{first === null || second === null ? "–" : figure(second - first)}</td>
                  </tr>
                );
              })}
            </tbody>
          </table>
        </div>
      )}
      {ordered && ordered[1] > ordered[0] && <StepResponse samples={between(samples, ...ordered)} curves={curves} />}
    </section>
  );
}

/** The figures of a step response: it begins at the first cursor, and the value has settled at the second. */
function StepResponse({ samples, curves }: { samples: Samples; curves: ScopeCurve[] }) {
  const [id, setId] = useState(curves[0]?.id ?? "");
  const number = Math.max(0, curves.findIndex((one) => one.id === id));
  const curve = curves[number];
  const setpoint = curve ? curves.findIndex((one) => one.id === curve.id.replace(/^position_rad|^pose(?=\[)/, (name) => (name === "pose" ? "pose_setpoint" : "setpoint_rad"))) : -1;
  const found = curve ? stepFigures(samples, number) : null;
  const target = setpoint >= 0 && setpoint !== number ? stepFigures(samples, setpoint)?.to ?? samples.values[setpoint]?.at(-1) : null;
  const rows: [string, string][] = found && curve ? [
    ["Step", `${figure(found.from)} to ${figure(found.to)} ${curve.unit}`],
    ["Rise time, 10 to 90 %", found.rise_s === null ? "–" : `${figure(found.rise_s)} s`],
    ["Overshoot", `${(100 * found.overshoot).toFixed(1)} %`],
    ["Settling time, within 2 %", found.settling_s === null ? "–" : `${figure(found.settling_s)} s`],
    ["Steady error", target == null ? "add the set-point's curve" : `${figure(target - found.to)} ${curve.unit}`],
  ] : [];
  return (
    <div class="step">
      <h3>Step response</h3>
      <div class="row"><label>Curve <select value={curve?.id} onChange={(event) => setId(event.currentTarget.value)}>{curves.map(({ id, label }) => <option key={id} value={id}>{label}</option>)}</select></label></div>
      {found
        ? <dl class="pairs">{rows.map(([name, value]) => <div key={name}><dt>{name}</dt><dd>{value}</dd></div>)}</dl>
        : <p class="quiet note">No step between the cursors. Place A where the step begins, and B where the value has settled.</p>}
    </div>
  );
}

/** Values of the running program that may change while it runs, and who changed them. */
function Parameters() {
  const { status, events, description, right } = useStore();
  const own = (description as { own_programs?: Record<string, { arguments: Record<string, { low: number; high: number; default: number }> }> } | null)?.own_programs;
  const program = status?.program ?? "";
  const bounds = own?.[program]?.arguments ?? (program === "path" ? { feed: { low: 0.01, high: 1, default: 1 } } : {});
  const names = Object.keys(bounds);
  const [name, setName] = useState("");
  const [text, setText] = useState("");
  const key = names.includes(name) ? name : (names[0] ?? "");
  const value = Number(text), range = bounds[key];
  const changes = events.filter((one) => one.kind === "set" || (one.kind === "command" && one.text.startsWith("set by")));
  return (
    <section class="card" aria-labelledby="parameters">
      <h2 id="parameters">Values that may change while a program runs</h2>
      {range
        ? <form class="row" onSubmit={(event) => { event.preventDefault(); void store.attempt(() => right.set({ [key]: value })); }}>
            <label>Value of {program} <select value={key} onChange={(event) => setName(event.currentTarget.value)}>{names.map((one) => <option key={one} value={one}>{one}</option>)}</select></label>
            <label>to <input class="number" inputMode="decimal" value={text} aria-describedby="parameter-range" onInput={(event) => setText(event.currentTarget.value)} /></label>
            <button disabled={!text.trim() || !Number.isFinite(value)}>Set</button>
            <span id="parameter-range" class="quiet">{range.low} to {range.high}, {range.default} by default</span>
          </form>
        : <p class="quiet note">{program ? `The program ${program} has no such values.` : "No program runs."} A path has its feed; your own programs have their arguments.</p>}
      {changes.length > 0 && <ol class="events" tabIndex={0} aria-label="Changes">{changes.map((one) => <li key={one.number}><time>{one.time.slice(11, 19)}</time> {one.text}</li>)}</ol>}
    </section>
  );
}
