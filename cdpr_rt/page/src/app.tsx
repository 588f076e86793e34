// The operator's page.
import { type ComponentType, render } from "preact";
import { useEffect } from "preact/hooks";
import { NextStep, PowerOff, RejectedMessage, Simulation, StopButton, useSituation } from "./act";
import { linkTo, useView } from "./address";
import { Calibrate } from "./calibrate";
import { Commission } from "./commission";
import { type Description, hasKey } from "./daemon";
import { Describe } from "./describe";
import { Axes, Events, Recording, RobotView, Tensions, Trends } from "./look";
import { Drives } from "./drives";
import { Recordings } from "./recordings";
import { Scope } from "./scope";
import { useStore } from "./store";
import { Move } from "./move";
import { Path } from "./path";
import "uplot/dist/uPlot.min.css";
import "./style.css";

const SLOW = 0.9;

function Header() {
  const { status, description, right, connected } = useStore();
  const { tone, title } = useSituation();
  const factor = (status as { real_time_factor?: number | null } | null)?.real_time_factor;
  const procedure = status?.control.procedure ? `, lent to the ${status.control.procedure}` : "";
  const holder = right.held ? "You have the right to move" : status?.control.held ? `${status.control.client} has the right to move` : "";
  return (
    <header>
      <img src="page/icon.svg" alt="" width="28" height="28" />
      <div class="who">
        <strong>{description?.robot ?? status?.robot ?? "cdpr-rt"}</strong>
        <span class="facts">
          {description && <span>{description.simulated ? "simulated" : "real drives"}</span>}
          {connected && factor != null && factor < SLOW && <span>runs at {factor.toFixed(2)} of real time</span>}
          {holder && <span>{holder}{procedure}</span>}
        </span>
      </div>
      <span class={`pill ${tone}`}>{title.length > 40 ? `${title.slice(0, 38)}…` : title}</span>
      <div class="stops"><PowerOff /><StopButton /></div>
    </header>
  );
}

function Robot() {
  return (
    <div class="columns">
      <div class="column wide">
        <RobotView />
        <Trends />
        <Axes />
        <Simulation />
      </div>
      <div class="column">
        <Move />
        <Path />
        <Tensions />
        <Events />
        <Recording />
      </div>
    </div>
  );
}

interface View {
  /** In the address, after #. */
  name: string;
  title: string;
  component: ComponentType;
  /** Whether the navigation shows it for this robot; always if omitted. */
  suits?: (description: Description) => boolean;
}

/** The page's views in the order of the navigation; the first is shown without a name in the address. */
const VIEWS: View[] = [
  { name: "robot", title: "Robot", component: Robot },
  { name: "scope", title: "Scope", component: Scope },
  { name: "recordings", title: "Recordings", component: Recordings },
  { name: "drives", title: "Drives and bus", component: Drives },
  { name: "commission", title: "Commission", component: Commission },
  { name: "calibrate", title: "Calibrate", component: Calibrate },
  { name: "describe", title: "Describe", component: Describe },
];

function App() {
  const { description, connected } = useStore();
  const { view } = useView();
  const views = VIEWS.filter(({ suits }, number) => number === 0 || (hasKey() && description && (suits?.(description) ?? true)));
  const { name, title, component: Shown } = views.find((one) => one.name === view) ?? views[0]!;
  useEffect(() => {
    document.title = `${title} – ${description?.robot ?? "cdpr-rt"}`;
    scrollTo(0, 0);
  }, [name, description?.robot]);
  return (
    <>
      <div class="top">
        <Header />
        {views.length > 1 && (
          <nav aria-label="Views">
            {views.map((one) => <a key={one.name} href={linkTo(one.name)} aria-current={one.name === name ? "page" : undefined}>{one.title}</a>)}
          </nav>
        )}
        <RejectedMessage />
      </div>
      <main class={connected ? "" : "stale"}>
        <NextStep />
        <Shown />
      </main>
    </>
  );
}

render(<App />, document.body);
