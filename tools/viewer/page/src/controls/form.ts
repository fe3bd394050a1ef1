// The panel: a form of the keys of the scene, which the schema describes. All of it is shown, or only the knobs: the keys
// that the schema marks so, without those of other methods and kinds.

import { button, element } from "../elements/dom";
import { is_object, value_at, type Json, type Path } from "../state/json";
import { kinds_of, properties_of, text_of, texts_of, users_of, type Schema } from "../state/schema";
import type { State } from "../state/state";
import { DirectionSphere } from "./direction_sphere";
import { FlexibilityLine } from "./flexibility_line";
import { Key, type Control } from "./key";
import { make_sliders } from "./slider";
import { Choice, TextBox } from "./text";

interface Row extends Control {
  readonly has_knobs: boolean;
  /** Hides what does not contain `words`. @returns true if something is left. */
  filter(words: string[]): boolean;
  /** Shows what is wrong with a key. @returns false if the key is not here. */
  show_fault(path: Path, fault: string): boolean;
}

export class Form {
  private root: Section | null = null;
  private readonly body = element("div", { id: "keys-form" });
  private readonly filter_box = element("input", {
    type: "search", id: "keys-filter", placeholder: "Filter keys", "aria-label": "Filter keys", spellcheck: "false",
  });
  private readonly nothing = element("p", { class: "hint", hidden: true }, "No key has these words.");

  constructor(private readonly container: HTMLElement, private readonly state: State) {
    container.append(this.filter_box, this.nothing, this.body);
    this.filter_box.addEventListener("input", () => this.filter());
  }

  build(schema: Schema): void {
    const methods = texts_of((value_at(schema, ["properties", "integrator", "properties", "type"]) ?? {}) as Schema, "enum");
    this.root = new Section(new Key(this.state, schema, [], {}), methods);
    this.body.replaceChildren(this.root.node);
    this.show(true);
    this.update();
  }

  /** @param only_knobs  Otherwise all keys. */
  show(only_knobs: boolean): void {
    this.container.classList.toggle("knobs", only_knobs);
    for (const details of this.body.querySelectorAll("details")) details.open = only_knobs;
    for (const summary of this.body.querySelectorAll("summary")) summary.tabIndex = only_knobs ? -1 : 0;
    this.filter_box.hidden = only_knobs;
    if (only_knobs) this.filter_box.value = "";
    this.filter();
  }

  /** Shows the present scene. */
  update(): void {
    this.root?.update();
  }

  /** Shows an error of the server at the key that it names. */
  show_fault(message: string | null): void {
    const path = /`\/([^`]*)`/.exec(message ?? "")?.[1]?.split("/") ?? [];
    this.root?.show_fault(path, message ?? "");
  }

  private filter(): void {
    const words = this.filter_box.value.toLowerCase().split(/\s+/).filter((word) => word !== "");
    this.nothing.hidden = this.root?.filter(words) ?? false;
  }
}

function contains(words: string[], key: Key): boolean {
  const text = (key.dotted + " " + text_of(key.schema, "description")).toLowerCase();
  return words.every((word) => text.includes(word));
}

/** Whether the scene's method, and the kind of the key's object, have this key. */
function is_used(key: Key, methods: string[]): boolean {
  const by = (names: string[], name: Json | undefined): boolean =>
    users_of(key.schema, names)?.includes(String(name)) ?? true;
  const kind = value_at(key.owner, ["properties", "kind"]);
  const of_kind = !is_object(kind) ||
    by(texts_of(kind, "enum"), key.state.get([...key.path.slice(0, -1), "kind"]) ?? kind["default"]);
  return of_kind && by(methods, key.state.get(["integrator", "type"]));
}

/** The button that makes a key automatic or removes it. */
class ResetButton implements Control {
  readonly node: HTMLButtonElement;

  constructor(private readonly key: Key) {
    const title = key.word ? "The render chooses the value" : "Remove this key: its default counts again";
    const label = `${key.dotted}: ${key.word ?? "remove"}`;
    this.node = button(key.word ?? "×", { class: "reset", "aria-label": label, title }, () => key.reset());
  }

  update(): void {
    this.node.hidden = this.key.required || (this.key.word === null && this.key.given === undefined);
    if (this.key.word) this.node.setAttribute("aria-pressed", String(this.key.automatic));
  }
}

/** An object: a section that can be closed. */
class Section implements Row {
  readonly node: HTMLElement;
  private readonly details: HTMLDetailsElement | null = null;
  private readonly body = element("div", { class: "section-body" });
  private readonly reset: ResetButton;
  private readonly kind_select: HTMLSelectElement | null = null;
  private readonly drawing: FlexibilityLine | null = null;
  private rows: Row[] = [];
  private shown_kind: string | null = null;
  private words: string[] = [];
  private opened_by_filter = false;

  constructor(private readonly key: Key, private readonly methods: string[]) {
    this.reset = new ResetButton(key);
    this.node = this.body;
    if (key.path.length > 0) {
      const description = element("span", { class: "description" }, text_of(key.schema, "description"));
      const summary = element("summary", {}, element("span", { class: "key" }, key.name), description);
      this.details = element("details", { class: "section", "data-key": key.dotted }, summary, this.body);
      this.node = this.details;
      const actions = element("div", { class: "section-actions" }, this.reset.node);
      this.body.append(actions);
      if (kinds_of(key.schema).length > 0) {
        this.kind_select = this.make_kind_select();
        actions.prepend(this.kind_select);
      }
    }
    if (key.dotted === "bending") {
      this.drawing = new FlexibilityLine(key);
      this.body.append(this.drawing.node);
    }
    if (!this.kind_select) this.build_rows(key.schema);
    this.node.classList.toggle("is-knob", this.has_knobs);
  }

  get has_knobs(): boolean {
    return this.rows.some((row) => row.has_knobs);
  }

  update(): void {
    const { given } = this.key;
    this.reset.update();
    this.drawing?.update();
    this.node.classList.toggle("absent", given === undefined);
    this.node.classList.toggle("unused", !is_used(this.key, this.methods));
    if (this.kind_select) {
      const kind = is_object(given) && typeof given["kind"] === "string" ? given["kind"] : "";
      this.kind_select.value = kind;
      if (kind !== this.shown_kind) {
        this.shown_kind = kind;
        for (const row of this.rows) row.node.remove();
        this.rows = [];
        const alternative = kinds_of(this.key.schema).find(([name]) => name === kind)?.[1];
        if (alternative) this.build_rows(alternative, ["kind"]);
        this.filter(this.words);
      }
    }
    for (const row of this.rows) row.update();
  }

  filter(words: string[]): boolean {
    this.words = words;
    // A section that is itself found shows all of its keys.
    const itself = this.key.path.length > 0 && contains(words, this.key);
    const found = this.rows.map((row) => row.filter(itself ? [] : words)).includes(true);
    this.node.hidden = !itself && !found;
    if (this.details) {
      if (words.length > 0 && found && !this.details.open) {
        this.details.open = this.opened_by_filter = true;
      } else if (words.length === 0 && this.opened_by_filter) {
        this.details.open = this.node.closest(".knobs") !== null;  // There all sections are open.
        this.opened_by_filter = false;
      }
    }
    return !this.node.hidden;
  }

  show_fault(path: Path, fault: string): boolean {
    const inside = path.slice(0, this.key.path.length).join() === this.key.path.join();
    return this.rows.map((row) => row.show_fault(inside ? path : [], fault)).includes(true);
  }

  private build_rows(schema: Schema, except: string[] = []): void {
    const properties = properties_of(schema).filter(([key]) => !except.includes(key));
    // The method decides what the others mean.
    if (this.key.path.length === 0) properties.sort(([a], [b]) => Number(b === "integrator") - Number(a === "integrator"));
    this.rows = properties.map(([name, child]) => {
      const key = new Key(this.key.state, child, [...this.key.path, name], schema);
      const is_section = properties_of(child).length > 0 || kinds_of(child).length > 0;
      return is_section ? new Section(key, this.methods) : new Leaf(key, this.methods);
    });
    this.body.append(...this.rows.map((row) => row.node));
  }

  private make_kind_select(): HTMLSelectElement {
    const { key } = this;
    const kinds = kinds_of(key.schema);
    const select = element("select", { "aria-label": key.dotted + ", kind", "data-kind-of": key.dotted });
    select.append(element("option", { value: "" }, "not given"));
    select.append(...kinds.map(([kind]) => element("option", { value: kind }, kind)));
    select.addEventListener("change", () => {
      if (select.value === "") return key.reset();
      // Keys that the new kind has, too, stay.
      const names = properties_of(kinds.find(([kind]) => kind === select.value)?.[1] ?? {}).map(([name]) => name);
      const kept = Object.entries(is_object(key.given) ? key.given : {}).filter(([name]) => names.includes(name));
      key.set({ ...Object.fromEntries(kept), kind: select.value });
    });
    return select;
  }
}

function make_control(key: Key): Control {
  if (key.names.length > 0) return new Choice(key);
  const type = text_of(key.main, "type");
  if (!("knob" in key.schema) || !["number", "integer", "array"].includes(type)) return new TextBox(key);
  // A list that must not be zero is a direction.
  return type === "array" && "not" in key.main ? new DirectionSphere(key) : make_sliders(key);
}

/** A key with one control. */
class Leaf implements Row {
  readonly node: HTMLElement;
  readonly has_knobs: boolean;
  private readonly control: Control;
  private readonly reset: ResetButton;
  private readonly fault = element("p", { class: "fault", role: "alert", hidden: true });

  constructor(private readonly key: Key, private readonly methods: string[]) {
    this.control = make_control(key);
    this.reset = new ResetButton(key);
    this.has_knobs = "knob" in key.schema;
    const description = text_of(key.schema, "description");
    const label = element("label", { for: key.id, class: "key" }, key.name.replace(/_/g, " "));
    this.node = element(
      "div",
      { class: "leaf", "data-key": key.dotted, title: `${key.dotted}: ${description}` },
      element("div", { class: "leaf-head" }, label, this.reset.node),
      element("div", { class: "leaf-control" }, this.control.node),
      element("p", { class: "description" }, description),
      this.fault,
    );
    this.node.classList.toggle("is-knob", this.has_knobs);
  }

  update(): void {
    this.control.update();
    this.reset.update();
    this.node.classList.toggle("absent", this.key.given === undefined);
    this.node.classList.toggle("unused", !is_used(this.key, this.methods));
  }

  filter(words: string[]): boolean {
    this.node.hidden = !contains(words, this.key);
    return !this.node.hidden;
  }

  show_fault(path: Path, fault: string): boolean {
    const found = path.slice(0, this.key.path.length).join() === this.key.path.join();
    this.fault.hidden = !found;
    this.fault.textContent = found ? fault : "";
    this.node.classList.toggle("invalid", found);
    return found;
  }
}
