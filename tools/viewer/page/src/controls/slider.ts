// A number: slider and number box. A list of a few numbers has several.

import { element } from "../elements/dom";
import { short_text, trimmed } from "../elements/numbers";
import { is_object, type Json } from "../state/json";
import { text_of } from "../state/schema";
import type { Control, Key } from "./key";

const positions = 1000;

/** The sliders of a key. */
export function make_sliders(key: Key): Control {
  const count = key.main["maxItems"];
  if (typeof count !== "number") return new Slider(key, null);
  const sliders = Array.from({ length: count }, (_, i) => new Slider(key, i));
  const node = element("div", {}, ...sliders.map((slider) => slider.node));
  return { node, update: () => sliders.forEach((slider) => slider.update()) };
}

function number_of(value: Json | undefined): number | null {
  return typeof value === "number" ? value : null;
}

class Slider implements Control {
  readonly node: HTMLElement;
  private readonly track: HTMLInputElement;
  private readonly box: HTMLInputElement;
  private readonly integer: boolean;
  /** Values at the ends; null: about the value that the render has chosen. */
  private readonly fixed_ends: [number, number] | null;
  private ends: [number, number] = [0, 1];
  private middle: number | null = null;
  private held = false;
  private by_key = false;

  /** @param index  Of the number in a list; null: the value is a number. */
  constructor(private readonly key: Key, private readonly index: number | null) {
    const items = key.main["items"];
    const schema = is_object(items) ? items : key.main;
    const range = Array.isArray(key.schema["knob"]) ? key.schema["knob"] : [schema["minimum"], schema["maximum"]];
    const [low, high] = [number_of(range[0]), number_of(range[1])];
    this.fixed_ends = low !== null && high !== null ? [low, high] : null;
    this.integer = text_of(schema, "type") === "integer";
    const id = key.id + (index === null ? "" : "-" + index);
    const label = key.name + (index === null ? "" : ` ${index + 1}`);
    this.track = element("input", { type: "range", id, min: 0, max: positions, step: 1, "aria-label": label });
    this.box = element("input", { type: "text", inputmode: "decimal", id: id + "-number", class: "number", "aria-label": label + ", number" });
    this.node = element("div", { class: "slider" }, this.track, this.box);
    this.listen();
  }

  update(): void {
    const number = this.number;
    if (!this.held) {
      this.set_ends(number);
      this.track.value = String(number === null ? positions / 2 : this.position_of(number));
    }
    this.box.placeholder = number === null ? "auto" : "";
    this.track.setAttribute("aria-valuetext", number === null ? "automatic" : short_text(number));
    if (document.activeElement !== this.box) this.show_number();
  }

  private get number(): number | null {
    const value = this.key.value;
    return number_of(this.index === null ? value : Array.isArray(value) ? value[this.index] : undefined);
  }

  private set number(number: number) {
    const list = Array.isArray(this.key.value) ? this.key.value.map((x) => (typeof x === "number" ? trimmed(x) : x)) : [];
    if (this.index !== null) list[this.index] = number;
    this.key.set(this.index === null ? number : list, ` ${this.index ?? ""}`);
  }

  private show_number(): void {
    this.box.value = this.number === null ? "" : short_text(this.number);
  }

  private set_ends(number: number | null): void {
    if (number && (this.middle === null || this.key.automatic)) this.middle = Math.abs(number);
    const middle = this.middle ?? 1;
    const present = Math.abs(number || middle);
    this.ends = this.fixed_ends ?? [Math.min(middle / 100, present), Math.max(middle * 100, present)];
  }

  private get logarithmic(): boolean {
    const [low, high] = this.ends;
    return low > 0 && high > 10 * low;
  }

  private position_of(value: number): number {
    const [low, high] = this.ends;
    const part = this.logarithmic ? Math.log(Math.abs(value) / low) / Math.log(high / low) : (value - low) / (high - low);
    return Math.round(Math.min(1, Math.max(0, part)) * positions);
  }

  private value_of(position: number): number {
    const [low, high] = this.ends;
    const part = position / positions;
    // A negative number keeps its sign.
    const sign = (this.number ?? 1) < 0 ? -1 : 1;
    const value = this.logarithmic ? trimmed(sign * low * Math.pow(high / low, part), 3) : low + (high - low) * part;
    if (this.integer) return Math.round(value);
    const digits = Math.max(0, Math.ceil(-Math.log10((high - low) / positions)));
    return this.logarithmic ? value : Number(value.toFixed(digits));
  }

  private listen(): void {
    this.track.addEventListener("pointerdown", () => (this.held = true));
    this.track.addEventListener("keydown", () => (this.by_key = true));
    this.track.addEventListener("pointerup", () => (this.by_key = false));
    this.track.addEventListener("input", () => (this.number = this.value_of(this.track.valueAsNumber)));
    this.track.addEventListener("change", () => {
      this.key.state.finish(this.by_key && !this.held);
      this.held = false;
      this.by_key = false;
      this.update();
    });
    for (const end of ["pointerup", "pointercancel"]) this.track.addEventListener(end, () => (this.held = false));
    this.box.addEventListener("keydown", (event) => {
      if (event.key === "ArrowUp" || event.key === "ArrowDown") {
        event.preventDefault();
        this.number = this.value_of(this.track.valueAsNumber + (event.key === "ArrowUp" ? 10 : -10));
        this.key.state.finish(true);
        this.show_number();
      }
      if (event.key === "Escape") {
        this.box.blur();
        this.update();
      }
    });
    this.box.addEventListener("change", () => {
      const value = Number(this.box.value.replace(",", "."));
      if (this.box.value.trim() !== "" && Number.isFinite(value)) {
        this.number = value;
        this.key.state.finish(false);
      }
      this.show_number();
    });
  }
}
