// A knob for a number: label, slider, number box, and a button that makes the value automatic again.

import { button, element } from "../elements/dom";
import { short_text, trimmed } from "../elements/numbers";

export interface SliderOptions {
  /** For ids. */
  name: string;
  label: string;
  unit?: string;
  hint?: string;
  /** Values at the ends. They may change, as when the scale of a field becomes known. */
  range: () => [number, number];
  logarithmic?: boolean;
  integer?: boolean;
  /** The present value, and whether it is automatic; null if it is not known yet. */
  value: () => { number: number | null; automatic: boolean };
  /** The hand moves the slider. */
  on_input: (value: number) => void;
  /** The hand has let go. @param by_key  Key presses may follow. */
  on_finish: (by_key: boolean) => void;
  /** Makes the value automatic; none: there is no button for it. */
  on_automatic?: () => void;
}

const positions = 1000;

export class Slider {
  readonly node: HTMLElement;
  private readonly track: HTMLInputElement;
  private readonly box: HTMLInputElement;
  private readonly automatic: HTMLButtonElement | null = null;
  private held = false;
  private by_key = false;
  private ends: [number, number] = [0, 1];

  constructor(private readonly options: SliderOptions) {
    const id = "knob-" + options.name;
    this.track = element("input", { type: "range", id, min: 0, max: positions, step: 1 });
    this.box = element("input", { type: "text", inputmode: "decimal", id: id + "-number", class: "number" });
    this.box.setAttribute("aria-label", options.label + ", number");
    this.node = element("div", { class: "knob slider", "data-knob": options.name, title: options.hint ?? "" });
    const label = element("label", { for: id }, options.label);
    if (options.unit) label.append(element("span", { class: "unit" }, " " + options.unit));
    const head = element("div", { class: "knob-head" }, label);
    this.node.append(head, this.track, this.box);
    if (options.on_automatic) {
      this.automatic = button("auto", { class: "automatic", id: id + "-automatic" }, options.on_automatic);
      this.automatic.setAttribute("aria-label", options.label + ": automatic");
      this.automatic.title = options.label + ": automatic";
      head.append(this.automatic);
    }
    this.listen();
  }

  update(): void {
    const { number, automatic } = this.options.value();
    if (!this.held) this.ends = this.options.range();
    if (!this.held) this.track.value = String(number === null ? positions / 2 : this.position_of(number));
    this.box.placeholder = number === null ? "auto" : "";
    this.track.setAttribute("aria-valuetext", number === null ? "automatic" : short_text(number));
    if (document.activeElement !== this.box) this.box.value = number === null ? "" : short_text(number);
    this.node.classList.toggle("is-automatic", automatic);
    this.automatic?.setAttribute("aria-pressed", String(automatic));
  }

  private position_of(value: number): number {
    const [low, high] = this.ends;
    const part = this.options.logarithmic
      ? Math.log(Math.abs(value) / low) / Math.log(high / low)
      : (value - low) / (high - low);
    return Math.round(Math.min(1, Math.max(0, part)) * positions);
  }

  private value_of(position: number): number {
    const [low, high] = this.ends;
    const part = position / positions;
    if (this.options.logarithmic) {
      // A negative number keeps its sign.
      const sign = (this.options.value().number ?? 1) < 0 ? -1 : 1;
      return this.tidied(sign * low * Math.pow(high / low, part));
    }
    return this.tidied(low + (high - low) * part);
  }

  private tidied(value: number): number {
    if (this.options.logarithmic) return this.options.integer ? Math.round(trimmed(value, 3)) : trimmed(value, 3);
    if (this.options.integer) return Math.round(value);
    const [low, high] = this.ends;
    const digits = Math.max(0, Math.ceil(-Math.log10((high - low) / positions)));
    return Number(value.toFixed(digits));
  }

  private listen(): void {
    this.track.addEventListener("pointerdown", () => (this.held = true));
    this.track.addEventListener("keydown", () => (this.by_key = true));
    this.track.addEventListener("pointerup", () => (this.by_key = false));
    this.track.addEventListener("input", () => this.options.on_input(this.value_of(this.track.valueAsNumber)));
    this.track.addEventListener("change", () => {
      this.options.on_finish(this.by_key && !this.held);
      this.held = false;
      this.by_key = false;
      this.update();
    });
    for (const end of ["pointerup", "pointercancel"]) this.track.addEventListener(end, () => (this.held = false));
    this.box.addEventListener("keydown", (event) => {
      if (event.key === "ArrowUp" || event.key === "ArrowDown") {
        event.preventDefault();
        const step = event.key === "ArrowUp" ? 1 : -1;
        this.options.on_input(this.value_of(this.track.valueAsNumber + step * 10));
        this.options.on_finish(true);
        const { number } = this.options.value();
        if (number !== null) this.box.value = short_text(number);
      }
      if (event.key === "Escape") {
        this.box.blur();
        this.update();
      }
    });
    this.box.addEventListener("change", () => {
      const value = Number(this.box.value.replace(",", "."));
      if (this.box.value.trim() !== "" && Number.isFinite(value)) {
        this.options.on_input(this.options.integer ? Math.round(value) : value);
        this.options.on_finish(false);
      }
      const { number } = this.options.value();
      this.box.value = number === null ? "" : short_text(number);
    });
  }
}
