// A form that describes a robot, beside its picture, with what is wrong with it.
import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import type { components } from "./api";
import { type Description, type Platform, Rejected, clientName, request } from "./daemon";
import { type RobotScene, drawnIn } from "./scene";
import { store, useStore } from "./store";
import "./procedure.css";

type Described = components["schemas"]["RobotDescription"];
type Question = Described["questions"] extends (infer One)[] | undefined ? One : never;
type Answers = Record<string, string>;

const PAUSE_MS = 350;
const KEPT = "cdpr-described";

/** The form's groups, in their order; a question belongs to the first whose pattern fits. */
const GROUPS: { title: string; about?: string; keys: RegExp; folded?: boolean }[] = [
  { title: "Robot", keys: /^(kind|name|frame_m|mass_kg)$/ },
  { title: "Exit points", about: "Where the cables leave the frame. The numbers are those in the picture.", keys: /^exit_/ },
  { title: "Anchor points", about: "Where the cables end on the platform, from its middle.", keys: /^(side_m|anchor_)/ },
  { title: "Targets", about: "The box of targets, and where the platform stands at rest.", keys: /^(low_m|high_m|home_m|angle_deg)$/ },
  { title: "Tensions and torques", keys: /^(torque_Nm|tension_)/ },
  { title: "Speeds", keys: /^(speed|acceleration|angular)/ },
  { title: "Winches and buses", keys: /./ },
];

const groupOf = (key: string): number => GROUPS.findIndex(({ keys }) => keys.test(key));

/** The key of a finding in the robot's file, as the key of the question that helps. */
function questionOf(key: string, questions: Question[]): string {
  const last = (key.split(".").pop() ?? "").replace(/\[.*/, "");
  const axis = /axes\[(\d+)\]/.exec(key)?.[1];
  const renamed: Record<string, string> = { workspace_min_m: "low_m", workspace_max_m: "high_m", workspace_angle_rad: "angle_deg", node_id: "nodes" };
  const wanted = axis && /^(exit|anchor)_point_m$/.test(last) ? `${last.split("_")[0]}_${Number(axis) + 1}_m` : renamed[last] ?? last;
  return questions.some((one) => one.key === wanted) ? wanted : "";
}

const kept = (): Answers => {
  try {
    return JSON.parse(sessionStorage.getItem(KEPT) ?? "{}") as Answers;
  } catch {
    return {};
  }
};

export function Describe() {
  const [answers, setAnswers] = useState<Answers>(kept);
  const [shown, setShown] = useState<Described | null>(null);
  const [diagnosis, setDiagnosis] = useState<Described | null>(null);
  const [why, setWhy] = useState("");
  const [tries, setTries] = useState(0);
  const asked = useRef(0);

  const answer = (values: Answers): void => {
    setAnswers(values);
    sessionStorage.setItem(KEPT, JSON.stringify(values));
  };
  useEffect(() => {
    const mine = ++asked.current;
    const timer = setTimeout(() => void (async () => {
      try {
        setDiagnosis(null);
        setWhy("");
        const form = await request<Described>("POST", "/robot-file", { answers });
        if (mine !== asked.current) return;
        setShown(form);
        const found = await request<Described>("POST", "/robot-file", { answers, diagnose: true });
        if (mine === asked.current) setDiagnosis(found);
      } catch (error) {
        if (!(error instanceof Rejected)) throw error;
        if (mine === asked.current) setWhy(error.message);
      }
    })(), PAUSE_MS);
    return () => clearTimeout(timer);
  }, [JSON.stringify(answers), tries]);

  const fromPresent = (): Promise<void> => store.attempt(async () => {
    const form = await request<Described>("POST", "/robot-file", { answers: {}, present: true });
    answer(Object.fromEntries((form.questions ?? []).filter((one) => one.value !== one.default || one.key === "kind").map((one) => [one.key, one.value])));
    setShown(form);
  });

  return (
    <div class="columns describe">
      <div class="column">
        <section class="card" aria-labelledby="describe">
          <h2 id="describe">Describe a robot</h2>
          <p>Each field has a default that follows from the fields before it. Change what differs.</p>
          <div class="row">
            <button onClick={() => answer({})}>Start again</button>
            <Present start={() => void fromPresent()} />
          </div>
          {(shown?.notes?.length ?? 0) > 0 && <p class="busy">The form leaves out of the present robot: {shown!.notes!.join(", ")}. Add them to the file.</p>}
          {why && <p class="fault" role="alert">{why} <button class="plain" onClick={() => setTries(tries + 1)}>Try again</button></p>}
          {!shown && !why && <p class="quiet">Starting the computation. This takes some seconds.</p>}
        </section>
        {shown && <Form questions={shown.questions ?? []} answers={answers} answer={answer} />}
      </div>
      <div class="column picture">
        {shown && <Picture platform={shown.platform as unknown as Platform} />}
        {!why && <Diagnosis found={diagnosis} questions={shown?.questions ?? []} />}
        {shown && <File shown={shown} answers={answers} />}
      </div>
    </div>
  );
}

function Present({ start }: { start: () => void }) {
  const { description } = useStore();
  if (!description?.platform) return null;
  return <button onClick={start}>Start from {description.robot}</button>;
}

function Form({ questions, answers, answer }: { questions: Question[]; answers: Answers; answer: (values: Answers) => void }) {
  const set = (key: string, value: string | null): void => {
    const { [key]: _, ...others } = answers;
    if (key === "kind") answer(value ? { kind: value } : {}); // another kind has other points
    else answer(value === null ? others : { ...others, [key]: value });
  };
  return (
    <>
      {GROUPS.map(({ title, about }, number) => {
        const mine = questions.filter(({ key }) => groupOf(key) === number);
        return mine.length > 0 && (
          <Group key={title} title={title} about={about}>
            {mine.map((one) => <Field key={one.key} question={one} typed={answers[one.key]} set={(value) => set(one.key, value)} />)}
          </Group>
        );
      })}
    </>
  );
}

function Group({ title, about, children }: { title: string; about: string | undefined; children: ComponentChildren }) {
  return (
    <section class="card" aria-label={title}>
      <h2>{title}</h2>
      {about && <p class="quiet">{about}</p>}
      <div class="fields">{children}</div>
    </section>
  );
}

const label = ({ key, text }: Question): string => {
  const point = /^(?:exit|anchor)_(\d+)_m$/.exec(key);
  return point ? `Cable ${point[1]}` : text.replace(/ \(`cdpr.*\)$/, "").replace(/^Winches:.*/, "Winches");
};

function Field({ question, typed, set }: { question: Question; typed: string | undefined; set: (value: string | null) => void }) {
  const { key, problem, choices, origin } = question;
  const hint = `hint-${key}`;
  const shown = typed ?? question.value;
  const common = { id: `field-${key}`, value: shown, "aria-describedby": hint, "aria-invalid": problem !== "" };
  return (
    <div class={`field ${problem ? "wrong" : typed ? "typed" : "default"}`}>
      <label for={`field-${key}`}>{label(question)}</label>
      {choices.length > 0
        ? <select {...common} onChange={(event) => set(event.currentTarget.value)}>{choices.map((one) => <option key={one}>{one}</option>)}</select>
        : <input {...common} autocomplete="off" spellcheck={false} onInput={(event) => set(event.currentTarget.value)} />}
      <small id={hint}>
        {problem || (typed && typed !== question.default ? "changed" : origin && `default: ${origin}`)}
        {typed && typed !== question.default && <> <button class="plain" type="button" aria-label={`Use the default of ${label(question)}`} onClick={() => set(null)}>use {question.default}</button></>}
      </small>
    </div>
  );
}

/** The described robot; exit points and anchor points have the numbers of their cables. */
function Picture({ platform }: { platform: Platform }) {
  const host = useRef<HTMLDivElement>(null), scene = useRef<RobotScene | null>(null);
  useEffect(() => {
    scene.current = drawnIn(host.current!);
    if (scene.current) scene.current.numbered = true;
    return () => scene.current?.close();
  }, []);
  useEffect(() => {
    const none = platform.exit_points_m.map(() => null);
    scene.current?.describe({ platform, limits: { tension_min_N: none, tension_max_N: none } } as unknown as Description);
  }, [JSON.stringify(platform)]);
  return (
    <section class="card robot" aria-label="The described robot in three dimensions">
      <div class="scene" ref={host} />
      <p class="place">at rest; the dashed box limits the targets</p>
    </section>
  );
}

function Diagnosis({ found, questions }: { found: Described | null; questions: Question[] }) {
  const findings = found?.findings ?? [];
  const impossible = findings.filter((one) => one.impossible).length;
  const figures = found?.figures ?? {};
  const percent = (value: number | undefined): string => (value === undefined ? "–" : `${Math.floor(100 * value)} %`);
  const go = (key: string): void => document.getElementById(`field-${key}`)?.focus();
  return (
    <section class="card" aria-labelledby="diagnosis">
      <h2 id="diagnosis">Diagnosis</h2>
      <p aria-live="polite" class={!found ? "quiet" : impossible ? "fault" : findings.length ? "busy" : "on"}>
        <strong>{!found ? "Computing …" : impossible ? "This robot cannot work." : findings.length ? "It can work, but see the warnings." : "It can work. No problems found."}</strong>
      </p>
      {findings.length > 0 && (
        <ul class="findings">
          {findings.map((one) => {
            const key = questionOf(one.key, questions);
            return (
              <li key={one.key + one.text} class={one.impossible ? "fault" : "busy"}>
                <code>{one.key}</code> <span>{one.text}</span> {key && <button class="plain" onClick={() => go(key)}>Go to the field</button>}
              </li>
            );
          })}
        </ul>
      )}
      {found && figures["held_share"] !== undefined && (
        <dl class="key-figures">
          <div><dt>Held in the box</dt><dd>{percent(figures["held_share"])}</dd></div>
          <div><dt>Accepted as targets</dt><dd>{percent(figures["target_share"])}</dd></div>
          <div><dt>Lowest resonance</dt><dd>{figures["lowest_resonance_Hz"]?.toFixed(0)} Hz</dd></div>
          <div><dt>Longest cable</dt><dd>{figures["longest_cable_m"]?.toFixed(2)} m</dd></div>
        </dl>
      )}
    </section>
  );
}

const NAME = /^[a-z0-9][a-z0-9_-]{0,39}$/;

function File({ shown, answers }: { shown: Described; answers: Answers }) {
  const [name, setName] = useState("my-robot");
  const [saved, setSaved] = useState("");
  const [exists, setExists] = useState("");
  const toml = shown.toml ?? "";
  const valid = NAME.test(name);
  const save = async (replace: boolean): Promise<void> => {
    setSaved("");
    setExists("");
    try {
      const { file } = await request<{ file: string }>("PUT", "/robot-file", { answers, name, replace, client: clientName() });
      setSaved(file);
    } catch (error) {
      if (!(error instanceof Rejected)) throw error;
      if (error.message.includes("already exists")) setExists(error.message);
      else store.change({ rejected: error.message });
    }
  };
  const download = (): void => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([toml], { type: "application/toml" }));
    link.download = `${name}.toml`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1e4);
  };
  return (
    <section class="card" aria-labelledby="file">
      <h2 id="file">The robot's file</h2>
      <div class="fields one">
        <div class={`field ${valid ? "typed" : "wrong"}`}>
          <label for="file-name">Name of the file</label>
          <input id="file-name" value={name} autocomplete="off" spellcheck={false} aria-invalid={!valid} aria-describedby="file-hint" onInput={(event) => { setName(event.currentTarget.value); setExists(""); }} />
          <small id="file-hint">{valid ? `${shown.folder}/${name}.toml` : "Allowed: lower-case letters, digits, - and _"}</small>
        </div>
      </div>
      <div class="row">
        <button class="go" disabled={!valid || !shown.writable} onClick={() => void save(false)}>Save</button>
        <button disabled={!valid} onClick={download}>Download</button>
      </div>
      {!shown.writable && <p class="busy">The daemon cannot write into {shown.folder}. Download the file.</p>}
      {exists && <p class="busy" role="alert" ref={(text) => text?.scrollIntoView({ block: "nearest" })}>A file of this name exists. <button onClick={() => void save(true)}>Replace it</button></p>}
      {saved && <p class="on" role="status" ref={(text) => text?.scrollIntoView({ block: "nearest" })}>Saved. Try it: <code>cdpr run {name} --bus simbus: --open</code></p>}
      <details><summary>Show the file</summary><pre tabIndex={0}>{toml}</pre></details>
    </section>
  );
}
