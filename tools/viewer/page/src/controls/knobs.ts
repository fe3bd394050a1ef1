// The panel of knobs: the keys that one changes most while one looks at a picture.

import { element } from "../elements/dom";
import { trimmed } from "../elements/numbers";
import { is_object, type Json, type JsonObject, type Path, with_value, without_value } from "../state/json";
import { default_distance, default_size, diagonal, normal_of, tilt_of, type Tilt } from "../state/plate";
import type { FieldInformation, PictureHeader, Vector } from "../state/protocol";
import { names_of, number_of, schema_at, text_of, with_kind, type Schema } from "../state/schema";
import type { State } from "../state/state";
import { rounded, vector_of } from "../state/vector";
import { Choice, SuggestedText } from "./choice";
import { DirectionSphere } from "./direction_sphere";
import { FlexibilityLine } from "./flexibility_line";
import { Slider, type SliderOptions } from "./slider";

interface Knob {
  readonly node: HTMLElement;
  update(): void;
}

interface NumberKnob {
  label: string;
  unit?: string;
  range: [number, number] | (() => [number, number]);
  logarithmic?: boolean;
  /** The value that counts if the key is absent and the schema has no default. */
  fallback?: () => number | null;
  /** There is a button that removes the key. */
  automatic?: boolean;
  /** What the button sets instead of removing the key. */
  automatic_value?: Json;
  /** A change to be made with that of the key. */
  also?: (scene: JsonObject) => JsonObject;
}

const views = ["Un-tone-mapped", "Soft highlights", "ACES SDR", "Raw"];
const displays = ["sRGB", "Rec.1886"];
const spectra = ["D65", "E", "A", "blackbody 3000", "blackbody 5500", "blackbody 9000"];

export class Knobs {
  private knobs: { knob: Knob; shown: () => boolean }[] = [];
  private groups: { node: HTMLElement; shown: () => boolean }[] = [];
  private schema: Schema = {};
  private corners: Vector[] = [];
  private picture: PictureHeader | null = null;
  private scale_middle: number | null = null;
  private sphere: DirectionSphere | null = null;
  private view: [Vector, Vector, Vector] | null = null;

  constructor(private readonly container: HTMLElement, private readonly state: State) {}

  build(schema: Schema): void {
    this.schema = schema;
    this.knobs = [];
    this.groups = [];
    this.container.replaceChildren();
    const method = (...names: string[]) => () => names.includes(this.method());
    const on_plate = method("photon_distribution", "lens");

    this.group("", () => true, [this.choice("method", "Method", ["integrator", "type"])]);
    this.group("Light", () => true, [this.direction()]);
    this.group("Field", () => true, [
      this.scale(),
      this.choice("eigenvalues", "Eigenvalues", ["field", "eigenvalues"]),
    ]);
    this.group("Flexibility s(λ) = a + b λ", () => true, [this.flexibility(), this.rgb_note(), ...this.flexibility_numbers()]);
    this.group("Density", method("photon_distribution"), [
      this.choice("density-kind", "Estimator", ["integrator", "density", "kind"]),
      this.of_density(["mesh"], "tolerance", { label: "Tolerance", unit: "px", range: [0.05, 5], logarithmic: true }),
      this.of_density(["gaussian"], "tau", { label: "Width τ", unit: "px", range: [0.3, 50], logarithmic: true }),
      this.of_density(["photon_differential"], "footprint", { label: "Footprint", range: [0.1, 10], logarithmic: true }),
      this.number("photons", ["light", "photons"], { label: "Photons", range: [1e3, 1e7], logarithmic: true }),
    ]);
    this.group("Lens", method("lens"), [
      this.choice("lens-mode", "Mode", ["integrator", "mode"]),
      this.text("lens-image", "Image", ["integrator", "image"], ["checkerboard", "grid", "color_wheel", "line"]),
      this.choice("lens-overlay", "Overlay", ["integrator", "overlay"]),
    ]);
    this.group("Paths", method("path_tracing"), [
      this.choice("seeds-kind", "Seeds", ["integrator", "seeds", "kind"]),
      this.number("seeds-count", ["integrator", "seeds", "count"], {
        label: "Number of seeds", range: [1, 5000], logarithmic: true,
      }),
      this.choice("style", "Style", ["integrator", "style"]),
      this.choice("color-by", "Colour by", ["integrator", "color", "by"]),
      this.choice("color-map", "Colour map", ["integrator", "color", "map"]),
      this.choice("shading", "Shading", ["integrator", "shading"]),
    ]);
    this.group("Stretch", method("stretch"), [
      this.number("stretch-wavelength", ["integrator", "stretch", "wavelength"], {
        label: "Wavelength", unit: "nm", range: [380, 780], fallback: () => 550, automatic: true,
      }),
      this.number("stretch-pixels", ["integrator", "stretch", "pixels"], { label: "Pixels", range: [32, 2048], logarithmic: true }),
    ]);
    this.group("Surfaces", method("scene"), [
      this.choice("conserve", "Light keeps", ["integrator", "conserve"]),
      this.choice("shading", "Shading", ["integrator", "shading"]),
    ]);
    this.group("Plate", on_plate, this.plate());
    this.group("Wavelengths", () => true, [
      this.number("wavelength-min", ["light", "wavelengths", "min"], { label: "From", unit: "nm", range: [380, 780] }),
      this.number("wavelength-max", ["light", "wavelengths", "max"], { label: "To", unit: "nm", range: [380, 780] }),
      this.number("wavelength-count", ["light", "wavelengths", "count"], { label: "Bands", range: [1, 128], logarithmic: true }),
      this.text("spectrum", "Spectrum", ["light", "spectrum"], spectra),
    ]);
    this.group("Picture", () => true, [
      this.number("exposure", ["output", "exposure"], {
        label: "Exposure", range: [-8, 8], fallback: () => this.picture?.exposure ?? null, automatic: true, automatic_value: "auto",
      }),
      this.text("view", "View transform", ["output", "view"], views),
      this.text("display", "Display", ["output", "display"], displays),
    ]);
    this.update();
  }

  show_field(field: FieldInformation): void {
    this.corners = field.corners;
    this.update();
  }

  show_picture(header: PictureHeader): void {
    this.picture = header;
    if (this.scale_middle === null || this.state.get(["field", "scale"]) === "auto") {
      this.scale_middle = Math.abs(header.scale) || 1;
    }
    this.update();
  }

  /** Turns the sphere of the direction as the 3D pane is turned. */
  set_view(right: Vector, up: Vector, toward: Vector): void {
    this.view = [right, up, toward];
    this.sphere?.set_view(right, up, toward);
  }

  update(): void {
    for (const { node, shown } of this.groups) node.hidden = !shown();
    for (const { knob, shown } of this.knobs) {
      knob.node.hidden = !shown();
      if (!knob.node.hidden) knob.update();
    }
  }

  private method(): string {
    return String(this.state.get(["integrator", "type"]) ?? "");
  }

  /** The direction of light: the scene's, or that of the last picture. */
  private light(): Vector | null {
    const given = this.state.get(["light", "direction"]);
    return vector_of(given) ?? this.picture?.direction ?? (given === undefined ? vector_of(this.default_of(["light", "direction"])) : null);
  }

  private plate_up(): Vector | null {
    return vector_of(this.state.get(["receiver", "up"])) ?? vector_of(this.state.get(["light", "up"]));
  }

  private default_of(path: Path): Json | undefined {
    return schema_at(this.schema, path)?.["default"];
  }

  private hint(path: Path): string {
    const schema = schema_at(this.schema, path);
    return path.join(".") + (schema ? ": " + text_of(schema, "description") : "");
  }

  private group(title: string, shown: () => boolean, knobs: ((Knob & { shown?: () => boolean }) | null)[]): void {
    const present = knobs.filter((knob) => knob !== null);
    if (present.length === 0) return;
    const node = element("fieldset", { class: "group" });
    if (title !== "") node.append(element("legend", {}, title));
    for (const knob of present) {
      node.append(knob.node);
      this.knobs.push({ knob, shown: () => shown() && (knob.shown?.() ?? true) });
    }
    this.groups.push({ node, shown });
    this.container.append(node);
  }

  private choice(name: string, label: string, path: Path): Knob | null {
    const schema = schema_at(this.schema, path);
    if (!schema) return null;
    const parent = path.slice(0, -1);
    const fallback = schema["default"];
    return new Choice({
      name,
      label,
      hint: this.hint(path),
      names: () => names_of(schema),
      value: () => String(this.state.get(path) ?? fallback ?? ""),
      on_choice: (chosen) => {
        const owner = schema_at(this.schema, parent);
        const object = this.state.get(parent);
        if (path[path.length - 1] === "kind" && owner && is_object(object)) {
          this.state.set(parent, with_kind(owner, object, chosen));
        } else {
          this.state.set(path, chosen);
        }
      },
    });
  }

  private text(name: string, label: string, path: Path, suggestions: string[]): Knob | null {
    const schema = schema_at(this.schema, path);
    if (!schema) return null;
    const fallback = schema["default"];
    const names = names_of(schema);
    const options = {
      name,
      label,
      hint: this.hint(path),
      value: () => String(this.state.get(path) ?? fallback ?? ""),
      fallback: String(fallback ?? "default"),
      on_choice: (chosen: string) => (chosen === "" ? this.state.remove(path) : this.state.set(path, chosen)),
    };
    if (names.length > 0) return new Choice({ ...options, names: () => names });
    return new SuggestedText({ ...options, names: () => suggestions });
  }

  private number(name: string, path: Path, knob: NumberKnob): Knob | null {
    const schema = schema_at(this.schema, path);
    if (!schema) return null;
    const gesture = "knob:" + name;
    const fallback = schema["default"];
    const options: SliderOptions = {
      name,
      label: knob.label,
      hint: this.hint(path),
      range: typeof knob.range === "function" ? knob.range : () => knob.range as [number, number],
      logarithmic: knob.logarithmic ?? false,
      integer: text_of(schema, "type") === "integer",
      value: () => {
        const given = this.state.get(path);
        if (typeof given === "number") return { number: given, automatic: false };
        return { number: knob.fallback ? knob.fallback() : typeof fallback === "number" ? fallback : null, automatic: true };
      },
      on_input: (value) => {
        const [least, greatest] = [number_of(schema, "minimum") ?? -Infinity, number_of(schema, "maximum") ?? Infinity];
        const scene = with_value(this.state.scene, path, Math.min(greatest, Math.max(least, value)));
        this.state.replace(knob.also ? knob.also(scene) : scene, gesture);
      },
      on_finish: (by_key) => this.state.finish(by_key),
    };
    if (knob.unit) options.unit = knob.unit;
    if (knob.automatic) {
      options.on_automatic = () =>
        knob.automatic_value === undefined ? this.state.remove(path) : this.state.set(path, knob.automatic_value);
    }
    return new Slider(options);
  }

  private of_density(kinds: string[], key: string, knob: NumberKnob): (Knob & { shown: () => boolean }) | null {
    const slider = this.number("density-" + key, ["integrator", "density", key], knob);
    const kind = (): string =>
      String(this.state.get(["integrator", "density", "kind"]) ?? this.default_of(["integrator", "density", "kind"]));
    return slider && { node: slider.node, update: () => slider.update(), shown: () => kinds.includes(kind()) };
  }

  private direction(): Knob | null {
    const path = ["light", "direction"];
    if (!schema_at(this.schema, path)) return null;
    this.sphere = new DirectionSphere({
      value: () => ({ direction: this.light(), automatic: this.state.get(path) === "auto" }),
      on_input: (direction) => {
        const old = this.light();
        let scene = with_value(this.state.scene, path, direction);
        const normal = vector_of(this.state.get(["receiver", "normal"]));
        if (normal && old) {
          // The plate turns with the light, so that its tilt stays.
          const tilt = tilt_of(normal, old, this.plate_up());
          scene = with_value(scene, ["receiver", "normal"], rounded(normal_of(tilt, direction, this.plate_up())));
        }
        this.state.replace(scene, "knob:direction");
      },
      on_finish: (by_key) => this.state.finish(by_key),
      on_automatic: () => this.state.set(path, "auto"),
    });
    if (this.view) this.sphere.set_view(...this.view);
    return this.sphere;
  }

  private scale(): Knob | null {
    return this.number("scale", ["field", "scale"], {
      label: "Scale",
      logarithmic: true,
      range: () => {
        const middle = this.scale_middle ?? 1;
        const given = this.state.get(["field", "scale"]);
        const present = Math.abs(typeof given === "number" && given !== 0 ? given : middle);
        return [Math.min(middle / 100, present), Math.max(middle * 100, present)];
      },
      fallback: () => this.picture?.scale ?? null,
      automatic: true,
      automatic_value: "auto",
    });
  }

  private coefficients(): { a: number; b: number } {
    const number = (key: string): number => {
      const value = this.state.get(["bending", key]) ?? this.default_of(["bending", key]);
      return typeof value === "number" ? value : 0;
    };
    return { a: number("a"), b: number("b") };
  }

  private has_rgb(): boolean {
    return this.state.get(["bending", "rgb"]) !== undefined;
  }

  private flexibility(): (Knob & { shown: () => boolean }) | null {
    if (!schema_at(this.schema, ["bending", "a"]) || !schema_at(this.schema, ["bending", "b"])) return null;
    const line = new FlexibilityLine({
      value: () => this.coefficients(),
      on_input: (a, b) =>
        this.state.replace(
          with_value(with_value(this.state.scene, ["bending", "a"], a), ["bending", "b"], b),
          "knob:flexibility",
        ),
      on_finish: (by_key) => this.state.finish(by_key),
    });
    return { node: line.node, update: () => line.update(), shown: () => !this.has_rgb() };
  }

  private rgb_note(): Knob & { shown: () => boolean } {
    const note = element("p", { class: "hint" }, "The key bending.rgb gives three flexibilities instead (see “All keys”).");
    return { node: note, update: () => undefined, shown: () => this.has_rgb() };
  }

  private flexibility_numbers(): ((Knob & { shown: () => boolean }) | null)[] {
    const knobs: [string, string, [number, number]][] = [["a", "", [-2, 2]], ["b", "1/nm", [-0.004, 0.004]]];
    return knobs.map(([key, unit, range]) => {
      const knob = this.number("flexibility-" + key, ["bending", key], unit ? { label: key, unit, range } : { label: key, range });
      return knob && { node: knob.node, update: () => knob.update(), shown: () => !this.has_rgb() };
    });
  }

  private plate(): (Knob | null)[] {
    const light = (): Vector => this.light() ?? [0, 0, -1];
    const size = (): [number, number] => {
      const given = this.state.get(["receiver", "size"]);
      return Array.isArray(given) && given.length === 2 && given.every((x) => typeof x === "number")
        ? (given as [number, number])
        : default_size(this.corners, light(), this.plate_up());
    };
    const distance = this.number("distance", ["receiver", "distance"], {
      label: "Distance",
      range: () => [0, 2 * diagonal(this.corners)],
      fallback: () => (this.state.get(["receiver", "center"]) === undefined ? default_distance(this.corners, light()) : null),
      automatic: true,
      also: (scene) => without_value(scene, ["receiver", "center"]),
    });
    return [distance, ...this.plate_size(size), ...this.plate_tilt(light)];
  }

  private plate_size(size: () => [number, number]): (Knob | null)[] {
    const path = ["receiver", "size"];
    if (!schema_at(this.schema, path)) return [];
    return ["Width", "Height"].map((label, i) => {
      const options: SliderOptions = {
        name: "size-" + label.toLowerCase(),
        label,
        hint: this.hint(path),
        range: () => [diagonal(this.corners) / 30, diagonal(this.corners) * 4],
        logarithmic: true,
        value: () => ({ number: size()[i] ?? null, automatic: this.state.get(path) === undefined }),
        on_input: (value) => {
          const changed = size().map((x) => trimmed(x));
          changed[i] = Math.max(1e-9, value);
          this.state.set(path, changed, "knob:size" + i);
        },
        on_finish: (by_key) => this.state.finish(by_key),
      };
      if (i === 0) {
        options.on_automatic = () => this.state.remove(path);
      }
      return new Slider(options);
    });
  }

  private plate_tilt(light: () => Vector): (Knob | null)[] {
    const path = ["receiver", "normal"];
    if (!schema_at(this.schema, path)) return [];
    const tilt = (): Tilt => {
      const normal = vector_of(this.state.get(path));
      return normal ? tilt_of(normal, light(), this.plate_up()) : { right: 0, up: 0 };
    };
    return (["right", "up"] as const).map((side) => {
      const options: SliderOptions = {
        name: "tilt-" + side,
        label: side === "right" ? "Tilt right" : "Tilt up",
        unit: "°",
        hint: this.hint(path),
        range: () => [-80, 80],
        value: () => ({ number: Math.round(tilt()[side] * 10) / 10, automatic: this.state.get(path) === undefined }),
        on_input: (value) => {
          const changed = { ...tilt(), [side]: Math.min(85, Math.max(-85, value)) };
          this.state.set(path, rounded(normal_of(changed, light(), this.plate_up())), "knob:tilt-" + side);
        },
        on_finish: (by_key) => this.state.finish(by_key),
      };
      if (side === "right") {
        options.on_automatic = () => this.state.remove(path);
      }
      return new Slider(options);
    });
  }
}
