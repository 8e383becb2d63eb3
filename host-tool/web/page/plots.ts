// Line plots of the page, in its colors.

import uPlot from "uplot";

export interface Line {
  label: string;
  // Name of a color of style.css, such as "s1".
  color: string;
  dash?: number[];
  width?: number;
}

export interface PlotOptions {
  // Text for people who do not see the plot.
  title: string;
  unit: string;
  xLabel?: string;
  lines: Line[];
  height?: number;
  // Range of the vertical axis; by default that of the data.
  range?: [number, number];
  // Logarithmic axes.
  xLog?: boolean;
  yLog?: boolean;
}

export function color(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

// A plot that fits the width of its parent and follows light and dark.
export class Plot {
  readonly element: HTMLElement;
  private plot: uPlot | null = null;
  private data: uPlot.AlignedData;
  private readonly options: PlotOptions;

  constructor(options: PlotOptions) {
    this.options = options;
    this.data = [[], ...options.lines.map(() => [])] as unknown as uPlot.AlignedData;
    this.element = document.createElement("div");
    this.element.className = "plot";
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", options.title);
    new ResizeObserver(() => this.resize()).observe(this.element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.rebuild());
  }

  // Replaces the data: x, then a list for each line. `null` leaves a gap.
  set(x: number[], ...lines: (number | null)[][]): void {
    this.data = [x, ...lines] as unknown as uPlot.AlignedData;
    this.plot?.setData(this.data);
  }

  private resize(): void {
    const width = this.element.clientWidth;
    if (width < 50) {
      return;
    }
    if (!this.plot) {
      this.rebuild();
    } else {
      this.plot.setSize({ width, height: this.options.height ?? 200 });
    }
  }

  private rebuild(): void {
    this.plot?.destroy();
    const { unit, xLabel, lines, height, range, xLog, yLog } = this.options;
    const axis = { stroke: color("soft"), grid: { stroke: color("grid"), width: 1 }, ticks: { stroke: color("grid") } };
    const options: uPlot.Options = {
      width: Math.max(this.element.clientWidth, 50),
      height: height ?? 200,
      scales: {
        x: { time: false, distr: xLog ? 3 : 1 },
        y: { distr: yLog ? 3 : 1, ...(range ? { range } : {}) },
      },
      axes: [
        { ...axis, label: xLabel ?? "time (s)", labelSize: 18, size: 32 },
        { ...axis, label: unit, labelSize: 18, size: 52 },
      ],
      series: [
        { label: xLabel ?? "time (s)" },
        ...lines.map((line) => ({
          label: line.label,
          stroke: color(line.color),
          width: line.width ?? 2,
          ...(line.dash ? { dash: line.dash } : {}),
          points: { show: false },
        })),
      ],
      cursor: { drag: { x: false, y: false } },
      legend: { live: false },
    };
    this.plot = new uPlot(options, this.data, this.element);
  }
}
