// Recordings: their list, download, and the way to the scope.
import { useEffect, useState } from "preact/hooks";
import { linkTo } from "./address";
import { type RecordingFile, download, repeat, request } from "./daemon";
import { store, useStore } from "./store";
import "./data.css";

const LOOK_MS = 5000;
const SHOWN = 50;

const sizeOf = (bytes: number): string => (bytes < 1e6 ? `${(bytes / 1e3).toFixed(0)} kB` : bytes < 1e9 ? `${(bytes / 1e6).toFixed(1)} MB` : `${(bytes / 1e9).toFixed(2)} GB`);

function timeOf(duration_s: number): string {
  const seconds = Math.round(duration_s);
  const parts = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60];
  return parts[0] ? `${parts[0]} h ${parts[1]} min` : parts[1] ? `${parts[1]} min ${parts[2]} s` : `${parts[2]} s`;
}

const began = (one: RecordingFile): string => new Date(one.begin).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "medium" });

export function Recordings() {
  const { status } = useStore();
  const [files, setFiles] = useState<RecordingFile[] | null>(null);
  const [most, setMost] = useState(SHOWN);
  useEffect(() => repeat(async () => {
    if (document.visibilityState !== "visible") return;
    try {
      setFiles((await request<{ recordings: RecordingFile[] }>("GET", "/recordings")).recordings);
    } catch {
      // the list stays; the header shows that the daemon does not answer
    }
  }, LOOK_MS), []);
  const part = status?.parts["recording"] as { recording?: boolean; error?: string } | undefined;
  return (
    <section class="card" aria-labelledby="recordings">
      <h2 id="recordings">Recordings</h2>
      {!part && <p class="quiet">Nothing is recorded: the daemon was started with <code>--no-record</code>.</p>}
      {part && !part.recording && <p class="fault">Not recording: {part.error || "ended"}</p>}
      {files?.length === 0 && part && <p class="quiet">There are no recordings of this robot yet.</p>}
      <ul class="recordings">
        {files?.slice(0, most).map((one) => <Row key={one.name} one={one} />)}
      </ul>
      {files && files.length > most && <div class="row"><button onClick={() => setMost(most + SHOWN)}>Show {Math.min(SHOWN, files.length - most)} more of {files.length}</button></div>}
      <p class="quiet note">Every cycle is recorded. MCAP files open in Foxglove and in <code>cdpr log</code>; CSV is a table of all cycles, about five times as large.</p>
    </section>
  );
}

function Row({ one }: { one: RecordingFile }) {
  const path = `/recordings/${encodeURIComponent(one.name)}` as const;
  const [asked, setAsked] = useState(false);
  const save = (kind: "" | "/table.csv" | "/picture.png") => (): void => {
    setAsked(kind !== "");
    void store.attempt(() => download(`${path}${kind}`));
  };
  return (
    <li>
      <div>
        <strong>{began(one)}</strong> {one.live && <span class="live">being recorded</span>}
        <small>{timeOf(one.duration_s)}, {sizeOf(one.bytes)}, <code>{one.name}</code></small>
        {asked && <small role="status">The daemon reads the recording. Then the browser saves the file.</small>}
      </div>
      <div class="row" role="group" aria-label={one.name}>
        <a class="button" href={linkTo("scope", { file: one.name })}>Plot</a>
        <button onClick={save("")}>Download MCAP</button>
        <button onClick={save("/table.csv")}>Download CSV</button>
        <button onClick={save("/picture.png")}>Download picture</button>
      </div>
    </li>
  );
}
