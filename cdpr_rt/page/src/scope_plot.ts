// The scope's plot: one vertical axis per unit, zoom by dragging, two cursors.
import uPlot from "uplot";
import { type Samples, type ScopeCurve, figure } from "./scope_data";
import { curveColour } from "./trend";

const css = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const CURSOR_NAMES = ["A", "B"];
const FONT = "11px system-ui";

export class ScopePlot {
  #plot: uPlot;
  #observer: ResizeObserver;
  #cursors: (number | null)[] = [null, null];

  constructor(host: HTMLElement, curves: ScopeCurve[], listener: { zoomed(from_s: number, until_s: number): void; pressed(at_s: number): void }) {
    const units = [...new Set(curves.map((one) => one.unit))];
    const axis = { stroke: () => css("--muted"), ticks: { show: false }, font: FONT, labelFont: FONT };
    let pressed = 0;
    this.#plot = new uPlot(
      {
        width: host.clientWidth || 600,
        height: host.clientHeight || 320,
        legend: { show: false },
        cursor: { y: false, drag: { x: true, y: false, setScale: false } },
        scales: { x: { time: false }, ...Object.fromEntries(units.map((unit) => [scaleOf(unit), {}])) },
        axes: [
          { ...axis, size: 34, grid: { width: 1, stroke: () => css("--line") }, values: (_, ticks) => ticks.map((one) => `${+one.toFixed(6)} s`) },
          ...units.map((unit, number) => ({
            ...axis, scale: scaleOf(unit), side: number % 2 ? 1 : 3, size: 60, values: (_: uPlot, ticks: number[]) => ticks.map(figure), label: unit || "–", labelSize: 16,
            grid: { width: 1, show: number === 0, stroke: () => css("--line") },
          })),
        ],
        series: [
          {},
          ...curves.map(({ id, unit }, number) => ({ label: id, scale: scaleOf(unit), stroke: curveColour(number), width: 1.5, points: { show: false } })),
        ],
        hooks: {
          setSelect: [(plot) => {
            const { left, width } = plot.select;
            if (width > 3) listener.zoomed(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
            plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          }],
          draw: [(plot) => this.#drawCursors(plot)],
        },
      },
      [[], ...curves.map(() => [])] as uPlot.AlignedData,
      host,
    );
    this.#plot.over.addEventListener("pointerdown", (event) => (pressed = event.clientX));
    this.#plot.over.addEventListener("click", (event) => {
      if (Math.abs(event.clientX - pressed) < 4) listener.pressed(this.#plot.posToVal(event.offsetX, "x"));
    });
    this.#observer = new ResizeObserver(() => {
      if (host.clientWidth) this.#plot.setSize({ width: host.clientWidth, height: host.clientHeight });
    });
    this.#observer.observe(host);
  }

  show(samples: Samples, window: [number, number], cursors: (number | null)[]): void {
    this.#cursors = cursors;
    this.#plot.setData([samples.time_s, ...samples.values] as uPlot.AlignedData, false);
    this.#plot.setScale("x", { min: window[0], max: window[1] });
  }

  #drawCursors({ ctx, bbox, valToPos }: uPlot): void {
    ctx.save();
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.font = `${12 * devicePixelRatio}px system-ui`;
    this.#cursors.forEach((at_s, number) => {
      if (at_s === null) return;
      const x = valToPos(at_s, "x", true);
      if (x < bbox.left || x > bbox.left + bbox.width) return;
      ctx.strokeStyle = ctx.fillStyle = css("--text");
      ctx.setLineDash(number ? [6, 4] : []);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.fillText(CURSOR_NAMES[number]!, x + 4 * devicePixelRatio, bbox.top + 13 * devicePixelRatio);
    });
    ctx.restore();
  }

  close(): void {
    this.#observer.disconnect();
    this.#plot.destroy();
  }
}

const scaleOf = (unit: string): string => unit || "number";
