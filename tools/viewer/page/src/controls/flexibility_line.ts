// The flexibility s(λ) = a + b λ: a line over the visible spectrum whose two ends one drags.

import { element, on_arrow_keys, on_drag, svg_element } from "../elements/dom";
import { short_text } from "../elements/numbers";
import { spectrum_color } from "../elements/spectrum_color";
import { is_object, value_at } from "../state/json";
import type { Control, Key } from "./key";

const ends = [380, 780] as const;  // nm
const [width, height] = [300, 128];
const [left, right, top, bottom] = [34, 290, 10, 96];

export class FlexibilityLine implements Control {
  readonly node: HTMLElement;
  private readonly svg: SVGSVGElement;
  private readonly grid = svg_element("g", { class: "grid" });
  private readonly line = svg_element("line", { class: "flexibility-line" });
  private readonly handles: SVGCircleElement[];
  private low = 0;
  private high = 1;
  private held = false;

  /** @param bending  The object that has a and b. */
  constructor(private readonly bending: Key) {
    this.svg = svg_element("svg", { viewBox: `0 0 ${width} ${height}`, class: "flexibility", id: "flexibility" });
    this.handles = ends.map((nm, i) =>
      svg_element("circle", {
        class: "handle", r: 7, tabindex: 0, role: "slider", "aria-label": `Flexibility at ${nm} nm`, id: `flexibility-${i}`,
      }),
    );
    this.svg.append(rainbow_strip(), this.grid, this.line, ...this.handles);
    this.node = element("div", { class: "drawing" }, this.svg);
    this.handles.forEach((handle, i) => this.listen(handle, i));
  }

  update(): void {
    this.node.hidden = is_object(this.bending.given) && "rgb" in this.bending.given;
    const values = this.values();
    if (!this.held) {
      // 0 is always visible. The range keeps its place during a drag.
      const [least, greatest] = [Math.min(0, ...values), Math.max(0, ...values)];
      const margin = Math.max(0.25 * (greatest - least), 0.05);
      this.low = least < 0 ? least - margin : -0.3 * margin;
      this.high = greatest + margin;
    }
    this.draw_grid();
    const [y0, y1] = values.map((value) => this.y_of(value)) as [number, number];
    set(this.line, { x1: left, y1: y0, x2: right, y2: y1 });
    this.handles.forEach((handle, i) => {
      const value = values[i]!;
      set(handle, {
        cx: i === 0 ? left : right,
        cy: Math.min(bottom + 6, Math.max(top - 6, this.y_of(value))),
        "aria-valuenow": short_text(value), "aria-valuemin": short_text(this.low), "aria-valuemax": short_text(this.high),
      });
    });
  }

  /** The flexibilities at the two ends. */
  private values(): [number, number] {
    const [a, b] = ["a", "b"].map((name) => {
      const value = value_at(this.bending.given, [name]) ?? value_at(this.bending.schema, ["properties", name, "default"]);
      return typeof value === "number" ? value : 0;
    }) as [number, number];
    return [a + b * ends[0], a + b * ends[1]];
  }

  private y_of(value: number): number {
    return bottom - ((value - this.low) / (this.high - this.low)) * (bottom - top);
  }

  private move(i: number, value: number): void {
    const values = this.values();
    values[i] = Math.round(value * 1000) / 1000;
    const b = (values[1] - values[0]) / (ends[1] - ends[0]);
    const a = Number((values[0] - b * ends[0]).toFixed(5));
    const others = is_object(this.bending.given) ? this.bending.given : {};
    this.bending.set({ ...others, a, b: Number(b.toFixed(7)) }, " line");
  }

  private listen(handle: SVGCircleElement, i: number): void {
    const drag = (_x: number, _y: number, event: PointerEvent): void => {
      this.held = true;
      const box = this.svg.getBoundingClientRect();
      const y = ((event.clientY - box.top) / box.height) * height;
      const part = Math.min(1, Math.max(0, (bottom - y) / (bottom - top)));
      this.move(i, this.low + part * (this.high - this.low));
    };
    on_drag(handle, drag, () => {
      this.held = false;
      this.bending.state.finish(false);
      this.update();
    });
    on_arrow_keys(handle, (x, y) => {
      this.move(i, this.values()[i]! + 0.01 * (x - y));
      this.bending.state.finish(true);
    });
  }

  private draw_grid(): void {
    const span = this.high - this.low;
    const power = Math.pow(10, Math.floor(Math.log10(span / 3)));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => span / size <= 4) ?? span;
    const parts: SVGElement[] = [];
    for (let i = Math.ceil(this.low / step); i * step <= this.high; ++i) {
      const y = this.y_of(i * step);
      parts.push(svg_element("line", { x1: left, x2: right, y1: y, y2: y, class: i === 0 ? "zero" : "" }));
      parts.push(svg_element("text", { x: left - 10, y: y + 3.5, "text-anchor": "end" }, short_text(i * step, 3)));
    }
    for (let nm = 400; nm <= 750; nm += 100) {
      const x = left + ((nm - ends[0]) / (ends[1] - ends[0])) * (right - left);
      parts.push(svg_element("text", { x, y: height - 4, "text-anchor": "middle" }, `${nm}`));
    }
    parts.push(svg_element("text", { x: right, y: height - 4, "text-anchor": "end" }, "nm"));
    this.grid.replaceChildren(...parts);
  }
}

function set(node: SVGElement, attributes: Record<string, string | number>): void {
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, String(value));
}

function rainbow_strip(): SVGGElement {
  const gradient = svg_element("linearGradient", { id: "rainbow" });
  const count = 20;
  for (let i = 0; i <= count; ++i) {
    const nm = ends[0] + ((ends[1] - ends[0]) * i) / count;
    gradient.append(svg_element("stop", { offset: i / count, "stop-color": spectrum_color(nm) }));
  }
  const strip = svg_element("rect", { x: left, y: bottom + 8, width: right - left, height: 7, rx: 2, fill: "url(#rainbow)" });
  return svg_element("g", {}, svg_element("defs", {}, gradient), strip);
}
