// The robot's situation in plain words, and the one next step.
import { type Description, type Status, hasKey } from "./daemon";

export type Tone = "off" | "ready" | "on" | "busy" | "fault";
export type Step = "configure" | "check" | "enable" | "tighten" | "tighten-home" | "acknowledge" | "move";

export interface Situation {
  tone: Tone;
  title: string;
  /** What has happened, or what to know before the next step. */
  detail: string;
  next: Step | null;
}

export const STEP_LABELS: Record<Step, string> = {
  configure: "Boot the drives",
  check: "Check the bus",
  enable: "Enable",
  tighten: "Tighten",
  "tighten-home": "Platform stands at home: tighten",
  acknowledge: "Acknowledge",
  move: "Move",
};

const STAGES: Record<string, string> = {
  "tighten slack": "Winding in the slack of the cables",
  "tighten pull": "Pulling the cables tight",
  "tighten below": "Measuring friction with less tension",
  "tighten beyond": "Measuring friction with more tension",
  "tighten back": "Returning to the first tensions",
  "tighten lengths": "Measuring the cable lengths",
  "tighten index": "Searching the index of each motor",
  "tighten held": "Settling on tight cables",
  "lower home": "Moving home, above the stand",
  "lower down": "Lowering the platform",
  "lower fade": "Slackening the cables",
  "path to the path": "Moving to the path",
  "path path": "Following the path",
};

/** Progress of the running program, as far as the page shows it. */
export interface Progress {
  stage?: string;
  tight?: boolean;
  done?: number;
  trouble?: string;
  missing?: string;
  held_back?: string;
  target_m?: number[];
  target_rotation_rad?: number[];
  position_m?: number[];
  rotation_rad?: number[];
  path?: PathProgress;
}

export interface PathProgress {
  name: string;
  plan: string;
  stage?: string;
  /** Why it rests, "" if it does not. */
  waiting: string;
  time_s: number;
  duration_s: number;
  feed: number;
  line: number;
  along_m: number;
  length_m: number;
}

export const progressOf = (status: Status): Progress => (status.program_progress ?? {}) as Progress;

interface LastStop {
  fallen: boolean;
  broken: string[];
}

export const lastStop = (status: Status): LastStop =>
  ((status as { last_stop?: LastStop | null }).last_stop ?? { fallen: false, broken: [] });

const sentence = (text: string): string => {
  const trimmed = text.trim();
  if (!trimmed) return "";
  const begun = trimmed[0]!.toUpperCase() + trimmed.slice(1);
  return /[.!?]$/.test(begun) ? begun : `${begun}.`;
};

const situation = (tone: Tone, title: string, detail = "", next: Step | null = null): Situation => ({
  tone, title, detail: sentence(detail), next,
});

/** `interrupted` names the program that was stopped before its end. */
export function situationOf(status: Status | null, description: Description | null, connected: boolean, interrupted: string): Situation {
  if (!connected && !hasKey()) return situation("off", "This page needs its key", "Open the address that `cdpr page` prints, or enter the key");
  if (!connected || !status) return situation("off", "No connection", "The daemon does not answer. This page keeps trying");
  switch (status.state) {
    case "starting": return situation("busy", "Starting", "The control loop is starting");
    case "dead": return situation("fault", "The control loop has ended", `${status.reason}. Start it again with \`cdpr run\``);
    case "fault": return faultOf(status, description);
    case "unconfigured": return status.released
      ? situation("busy", "A procedure runs the drives", "The control loop takes them again when it ends")
      : situation("off", "Drives not booted", status.reason, "configure");
    case "inactive": return situation("off", "No power", status.reason || "The drives are booted", "check");
    case "ready": return status.read_only
      ? situation("ready", "Listening only", status.reason || "Another master moves this robot")
      : readyOf(status, description);
    case "active": return activeOf(status, description, interrupted);
    default: return situation("off", status.state, status.reason);
  }
}

const MEND = "Mend everything, in the card Break the simulation, repairs the cables and puts the platform back";

/** What to do about cables that seem broken; their texts begin with the name of the axis. */
function repairOf(broken: string[], description: Description | null): string {
  if (description?.simulated) return MEND;
  return `Repair before you enable: ${broken.map((one) => one.split(":")[0]).join(", ")}`;
}

function faultOf(status: Status, description: Description | null): Situation {
  const texts = status.faults.map((fault) => (fault as { text: string }).text);
  const [cause = status.reason, ...others] = texts;
  const { broken } = lastStop(status);
  const repair = broken.length && description?.simulated ? `${MEND}. Then acknowledge` : `${broken.length ? "Repair the cable" : "Remove the cause"}, then acknowledge`;
  const detail = others.length ? `${repair}. After it: ${others.join("; ")}` : repair;
  return situation("fault", `Fault: ${cause}`, detail, "acknowledge");
}

function readyOf(status: Status, description: Description | null): Situation {
  const { fallen, broken } = lastStop(status);
  const [, who] = /^disable by (.*)$/.exec(status.commanded ?? "") ?? [];
  const why = /right to move/.test(status.reason) ? "" : status.reason;
  const words = [why, who && `${who} has switched the power off`];
  if (broken.length) words.push(repairOf(broken, description));
  else if (fallen) words.push("The platform has come down: look at it before you enable");
  return situation("ready", "No power", words.filter(Boolean).join(". ") || "The drives are ready. Keep clear of the robot", "enable");
}

function activeOf(status: Status, description: Description | null, interrupted: string): Situation {
  const progress = progressOf(status);
  if ((status as { reacting?: string }).reacting !== "none") return situation("busy", "Stopping", status.reason);
  const stage = STAGES[`${status.program} ${progress.path?.stage ?? progress.stage ?? ""}`];
  if (description && status.program === "tighten" && progress.tight === false) {
    if (progress.trouble) return situation("busy", "The cables are not tight", progress.trouble.split("; before that, ")[0], slackOf(status, description).next);
    return situation("busy", stage ?? "Tightening", "Keep clear of the robot");
  }
  if (status.program === "lower") {
    return (progress.done ?? 0) < 1
      ? situation("busy", stage ?? "Lowering the platform", progress.trouble)
      : situation("ready", "On its stand", "The cables are loose, the power is on", "tighten");
  }
  const jogs = status.program === "jog" && (progress.done ?? 0) < 1;
  if (description?.platform && progress.tight === false && !jogs) return slackOf(status, description);
  if (status.program === "path" && progress.path?.waiting) return situation("on", "Paused on the path", progress.path.waiting === "paused" ? "Resume it in the card Path" : progress.path.waiting);
  if (progress.done !== undefined && progress.done < 1 && status.program !== "hold") {
    return situation("busy", stage ?? "Moving", progress.held_back || progress.missing || progress.trouble);
  }
  const isLost = /right to move/.test(status.reason);
  const lost = interrupted ? "The page or program that led the last motion no longer has the right to move. The robot holds" : "";
  const detail = progress.trouble || status.failure || (isLost ? lost : status.reason);
  if (!description?.platform) return situation("on", "Holding", detail);
  return situation("on", "Holding the platform", detail || "Ready to move: enter a target, drag one in the picture, or choose a path", "move");
}

function slackOf(status: Status, description: Description): Situation {
  const { fallen, broken } = lastStop(status);
  const unsure = fallen || broken.length > 0;
  const detail = unsure
    ? "The cables are slack. Put the platform on its stand, upright, then tighten from there"
    : status.failure || "The cables are slack";
  return situation("ready", "Power on", unsure && description.simulated ? `${MEND}. Then tighten` : detail, unsure ? "tighten-home" : "tighten");
}
