// What is under the pointer: values, colour, spectrum.

import uPlot from "uplot";
import { element, style_value } from "../elements/dom";
import { short_text } from "../elements/numbers";
import { spectrum_color } from "../elements/spectrum_color";
import type { Look } from "../state/protocol";

export class ReadOut {
  private readonly values = element("dl", { id: "read-out-values" });
  private readonly swatch = element("dd", { id: "read-out-swatch", role: "img" });
  private readonly hint = element("p", { class: "hint" }, "Move the pointer over the picture.");
  private readonly plot_frame = element("div", { id: "read-out-plot" });
  private plot: uPlot | null = null;
  private spectrum: Look["spectrum"] = null;

  constructor(private readonly container: HTMLElement) {
    container.append(element("div", { class: "read-out-column" }, this.hint, this.values), this.plot_frame);
    new ResizeObserver(() => this.plot?.setSize(this.size())).observe(this.plot_frame);
  }

  show(look: Look): void {
    this.hint.hidden = true;
    this.container.classList.remove("stale");
    this.values.replaceChildren();
    if (look.color !== null) {
      this.values.append(element("dt", {}, "colour"), this.swatch);
      this.swatch.style.backgroundColor = look.color;
      this.swatch.setAttribute("aria-label", "colour " + look.color);
      this.swatch.title = look.color;
    }
    this.values.append(...look.lines.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
    this.spectrum = look.spectrum;
    this.draw();
  }

  /** The values are those of an older picture. */
  age(): void {
    this.container.classList.add("stale");
  }

  show_fault(message: string): void {
    this.hint.hidden = false;
    this.hint.textContent = message;
    this.container.classList.add("stale");
  }

  /** Draws the spectrum in the colours of the theme. */
  restyle(): void {
    this.remove_plot();
    this.draw();
  }

  private remove_plot(): void {
    this.plot?.destroy();
    this.plot = null;
  }

  private draw(): void {
    if (!this.spectrum || this.spectrum.nm.length < 2) return this.remove_plot();
    const data: uPlot.AlignedData = [this.spectrum.nm, this.spectrum.values];
    if (this.plot) this.plot.setData(data);
    else this.plot = new uPlot(this.options(), data, this.plot_frame);
  }

  private size(): { width: number; height: number } {
    return { width: Math.max(80, this.plot_frame.clientWidth), height: Math.max(60, this.plot_frame.clientHeight) };
  }

  private options(): uPlot.Options {
    const ink = style_value("--ink-quiet");
    const grid = { stroke: style_value("--line"), width: 1 };
    const font = "11px system-ui, sans-serif";
    return {
      ...this.size(),
      legend: { show: false },
      cursor: { show: false },
      padding: [6, 10, 0, 0],
      scales: { x: { time: false }, y: { range: (_plot, low, high) => [Math.min(0, low), high > 0 ? high * 1.05 : 1] } },
      axes: [
        { stroke: ink, grid, ticks: grid, font, size: 24, space: 50, values: (_p, ticks) => ticks.map((nm) => `${nm}`) },
        { stroke: ink, grid, ticks: grid, font, size: 46, space: 28, values: (_p, ticks) => ticks.map((y) => short_text(y, 2)) },
      ],
      series: [{}, { stroke: ink, width: 1.5, points: { show: false }, fill: rainbow }],
    };
  }
}

/** The colours of the spectrum across the plot. */
function rainbow(plot: uPlot): CanvasGradient | string {
  const { min, max } = plot.scales["x"] ?? {};
  if (min == null || max == null || !(max > min)) return "transparent";
  const gradient = plot.ctx.createLinearGradient(plot.bbox.left, 0, plot.bbox.left + plot.bbox.width, 0);
  const count = 24;
  for (let i = 0; i <= count; ++i) gradient.addColorStop(i / count, spectrum_color(min + ((max - min) * i) / count));
  return gradient;
}
