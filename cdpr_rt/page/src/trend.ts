// The last 30 s of a few curves.
import uPlot from "uplot";

export const SPAN_S = 30;
const RATE_Hz = 30;
/** Ten pictures a second are enough for a curve. */
const DRAW_MS = 100, SHARE = 3;
const POINTS = SPAN_S * RATE_Hz;
const COLOURS = ["#2f6fb0", "#d1581a", "#3b8f5a", "#7a3fa0", "#1f8a8a", "#b03a5b", "#8a6d1f", "#7a8797"];

export interface Curve {
  name: string;
  unit: string;
}

const css = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** How the axes of all plots look. */
export const axisStyle = () => ({ stroke: () => css("--muted"), grid: { width: 1, stroke: () => css("--line") }, ticks: { show: false }, font: "11px system-ui" });

/** A plot against bus time that keeps `SPAN_S`; older points leave it. */
export class Trend {
  #plot: uPlot;
  #data: (number | null)[][];
  #observer: ResizeObserver;
  /** When the next picture may begin; not before the present one is shown. */
  #next_ms = 0;

  /** `floor`: the vertical axis ends there or higher. */
  constructor(host: HTMLElement, curves: Curve[], floor: number) {
    this.#data = [[], ...curves.map(() => [])];
    const axis = axisStyle();
    this.#plot = new uPlot(
      {
        width: host.clientWidth || 300,
        height: host.clientHeight || 140,
        cursor: { y: false },
        legend: { show: false },
        scales: { x: { time: false }, y: { range: (_, low, high) => [Math.min(low ?? 0, 0), Math.max(1.05 * (high ?? 0), floor)] } },
        axes: [
          { ...axis, size: 26, values: (_, ticks) => ticks.map((one) => `${one} s`) },
          { ...axis, size: 46 },
        ],
        series: [
          {},
          ...curves.map(({ name }, number) => ({ label: name, stroke: COLOURS[number % COLOURS.length]!, width: 1.4, spanGaps: false })),
        ],
      },
      this.#data as uPlot.AlignedData,
      host,
    );
    this.#observer = new ResizeObserver(() => {
      if (host.clientWidth) this.#plot.setSize({ width: host.clientWidth, height: host.clientHeight });
    });
    this.#observer.observe(host);
  }

  add(time_s: number, values: (number | null)[]): void {
    const times = this.#data[0]!;
    if (times.length && time_s < times[times.length - 1]!) this.#data.forEach((one) => one.splice(0)); // the loop has restarted
    times.push(time_s);
    values.forEach((value, number) => this.#data[number + 1]?.push(value));
    if (times.length > POINTS) this.#data.forEach((one) => one.shift());
  }

  draw(): void {
    const times = this.#data[0]!;
    const began_ms = performance.now();
    if (!times.length || began_ms < this.#next_ms) return;
    this.#next_ms = Infinity;
    requestAnimationFrame(() => setTimeout(() => {
      const cost_ms = performance.now() - began_ms;
      this.#next_ms = began_ms + Math.max(DRAW_MS, SHARE * cost_ms); // a slow machine has time for a stop, too
    }));
    const end = times[times.length - 1]!;
    this.#plot.setData(this.#data as uPlot.AlignedData, false);
    this.#plot.setScale("x", { min: end - SPAN_S, max: end });
  }

  close(): void {
    this.#observer.disconnect();
    this.#plot.destroy();
  }
}

export const curveColour = (number: number): string => COLOURS[number % COLOURS.length]!;
