// The operator's page.
import { render } from "preact";
import { Move, NextStep, PowerOff, Simulation, StopButton, useSituation } from "./act";
import { Axes, Events, Recording, RobotView, Tensions, Trends } from "./look";
import { useStore } from "./store";
import "uplot/dist/uPlot.min.css";
import "./style.css";

const SLOW = 0.9;

function Header() {
  const { status, description, right, connected } = useStore();
  const { tone, title } = useSituation();
  const factor = (status as { real_time_factor?: number | null } | null)?.real_time_factor;
  const holder = right.held ? "You have the right to move" : status?.control.held ? `${status.control.client} has the right to move` : "";
  return (
    <header>
      <img src="page/icon.svg" alt="" width="28" height="28" />
      <div class="who">
        <strong>{description?.robot ?? status?.robot ?? "cdpr-rt"}</strong>
        <span class="facts">
          {description && <span>{description.simulated ? "simulated" : "real drives"}</span>}
          {connected && factor != null && factor < SLOW && <span>runs at {factor.toFixed(2)} of real time</span>}
          {holder && <span>{holder}</span>}
        </span>
      </div>
      <span class={`pill ${tone}`}>{title.length > 40 ? `${title.slice(0, 38)}…` : title}</span>
      <div class="stops"><PowerOff /><StopButton /></div>
    </header>
  );
}

function App() {
  return (
    <>
      <Header />
      <main>
        <div class="column wide">
          <RobotView />
          <Trends />
          <Axes />
        </div>
        <div class="column">
          <NextStep />
          <Move />
          <Tensions />
          <Events />
          <Recording />
          <Simulation />
        </div>
      </main>
    </>
  );
}

render(<App />, document.body);
