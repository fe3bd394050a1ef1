// "All keys": a form with every key of the schema. A key that is absent shows its default, dimmed.

import { button, element } from "../elements/dom";
import { equal, is_object, type Json, type Path } from "../state/json";
import {
  alternatives_of, fault_of, is_required, kind_of, kinds_of, number_of, names_of, owners_of, properties_of, text_of,
  with_kind,
  type Schema,
} from "../state/schema";
import type { State } from "../state/state";

interface Row {
  readonly node: HTMLElement;
  update(): void;
  /** Hides what does not contain `words`. @returns true if something is left. */
  filter(words: string[]): boolean;
}

export class SchemaForm {
  private root: Row | null = null;
  private readonly body = element("div", { id: "all-keys-form" });
  private readonly filter_box = element("input", {
    type: "search", id: "all-keys-filter", placeholder: "Filter keys", "aria-label": "Filter keys", spellcheck: "false",
  });
  private readonly nothing = element("p", { class: "hint", hidden: true }, "No key has these words.");

  constructor(private readonly container: HTMLElement, private readonly state: State) {
    container.append(this.filter_box, this.nothing, this.body);
    this.filter_box.addEventListener("input", () => this.filter());
  }

  build(schema: Schema): void {
    this.root = new Section(this.state, schema, [], null);
    this.body.replaceChildren(this.root.node);
    this.update();
    this.filter();
  }

  /** Shows the present scene, if the form is visible. */
  update(): void {
    if (!this.container.hidden) this.root?.update();
  }

  private filter(): void {
    const words = this.filter_box.value.toLowerCase().split(/\s+/).filter((word) => word !== "");
    const found = this.root?.filter(words) ?? false;
    this.nothing.hidden = found;
  }
}

function contains(words: string[], path: Path, schema: Schema): boolean {
  const text = (path.join(".") + " " + text_of(schema, "description")).toLowerCase();
  return words.every((word) => text.includes(word));
}

function row_of(state: State, schema: Schema, path: Path, owner: Schema): Row {
  const is_section = properties_of(schema).length > 0 || (kinds_of(schema).length > 0 && alternatives_of(schema).length > 0);
  return is_section ? new Section(state, schema, path, owner) : new Leaf(state, schema, path, owner);
}

/** Dims a row whose key belongs to another kind of its object. */
function update_ownership(state: State, node: HTMLElement, path: Path, owner: Schema): void {
  const owners = owners_of(owner, path[path.length - 1] ?? "");
  if (!owners) return;
  const kind = kind_of(owner, state.get(path.slice(0, -1)));
  const belongs = kind !== undefined && owners.includes(kind);
  node.classList.toggle("other-kind", !belongs);
}

/** An object: a section that can be closed. */
class Section implements Row {
  readonly node: HTMLElement;
  private readonly details: HTMLDetailsElement | null = null;
  private readonly body = element("div", { class: "section-body" });
  private readonly remove: HTMLButtonElement;
  private readonly kind_select: HTMLSelectElement | null = null;
  private rows: Row[] = [];
  private shown_kind: string | null = null;
  private words: string[] = [];
  private opened_by_filter = false;

  constructor(
    private readonly state: State,
    private readonly schema: Schema,
    private readonly path: Path,
    private readonly owner: Schema | null,
  ) {
    const key = path[path.length - 1];
    this.remove = remove_button(state, path);
    if (key === undefined) {
      this.node = this.body;
    } else {
      const description = text_of(schema, "description");
      const summary = element("summary", {}, element("span", { class: "key" }, key), element("span", { class: "description" }, description));
      this.details = element("details", { class: "section", "data-key": path.join(".") }, summary, this.body);
      this.node = this.details;
      const actions = element("div", { class: "section-actions" }, this.remove);
      this.body.append(actions);
      if (kinds_of(schema).length > 0) {
        this.kind_select = this.make_kind_select();
        actions.prepend(this.kind_select);
      }
    }
    if (!this.kind_select) this.build_rows(schema);
  }

  update(): void {
    const value = this.state.get(this.path);
    const present = value !== undefined;
    this.remove.hidden = !present || (this.owner !== null && is_required(this.owner, this.path[this.path.length - 1] ?? ""));
    this.node.classList.toggle("absent", !present && this.path.length > 0);
    if (this.kind_select) {
      const kind = is_object(value) && typeof value["kind"] === "string" ? value["kind"] : "";
      this.kind_select.value = kind;
      if (kind !== this.shown_kind) {
        this.shown_kind = kind;
        for (const row of this.rows) row.node.remove();
        this.rows = [];
        const alternative = kinds_of(this.schema).find(([name]) => name === kind)?.[1];
        if (alternative) this.build_rows(alternative, ["kind"]);
        this.filter(this.words);
      }
    }
    if (this.owner) update_ownership(this.state, this.node, this.path, this.owner);
    for (const row of this.rows) row.update();
  }

  filter(words: string[]): boolean {
    this.words = words;
    // A section that is itself found shows all of its keys.
    const itself = this.path.length > 0 && contains(words, this.path, this.schema);
    const found = this.rows.map((row) => row.filter(itself ? [] : words)).includes(true);
    const visible = itself || found;
    this.node.hidden = !visible;
    if (this.details) {
      if (words.length > 0 && found && !this.details.open) {
        this.details.open = true;
        this.opened_by_filter = true;
      } else if (words.length === 0 && this.opened_by_filter) {
        this.details.open = false;
        this.opened_by_filter = false;
      }
    }
    return visible;
  }

  private build_rows(schema: Schema, except: string[] = []): void {
    this.rows = properties_of(schema)
      .filter(([key]) => !except.includes(key))
      .map(([key, child]) => row_of(this.state, child, [...this.path, key], schema));
    this.body.append(...this.rows.map((row) => row.node));
  }

  private make_kind_select(): HTMLSelectElement {
    const kinds = kinds_of(this.schema);
    const name = this.path.join(".");
    const select = element("select", { "aria-label": name + ", kind", "data-kind-of": name });
    select.append(element("option", { value: "" }, "not given"));
    select.append(...kinds.map(([kind]) => element("option", { value: kind }, kind)));
    select.addEventListener("change", () => {
      if (select.value === "") {
        this.state.remove(this.path);
        return;
      }
      // Keys that the new kind has, too, stay.
      const keys = properties_of(kinds.find(([kind]) => kind === select.value)?.[1] ?? {}).map(([key]) => key);
      const old = this.state.get(this.path);
      const kept = Object.entries(is_object(old) ? old : {}).filter(([key]) => keys.includes(key));
      this.state.set(this.path, { ...Object.fromEntries(kept), kind: select.value });
    });
    return select;
  }
}

function remove_button(state: State, path: Path): HTMLButtonElement {
  const name = path.join(".");
  return button("remove", { class: "remove", "aria-label": "Remove " + name, title: "Remove this key: its default counts again." }, () =>
    state.remove(path),
  );
}

let last_id = 0;

/** A key with one control. */
class Leaf implements Row {
  readonly node: HTMLElement;
  private readonly control: HTMLSelectElement | HTMLInputElement | HTMLTextAreaElement;
  private readonly remove: HTMLButtonElement;
  private readonly required: boolean;
  private readonly fault = element("p", { class: "fault", role: "alert", hidden: true });

  constructor(
    private readonly state: State,
    private readonly schema: Schema,
    private readonly path: Path,
    private readonly owner: Schema,
  ) {
    const key = path[path.length - 1] ?? "";
    const id = `all-keys-${++last_id}`;
    this.required = is_required(owner, key);
    this.control = this.make_control();
    this.control.id = id;
    this.remove = remove_button(state, path);
    const owners = owners_of(owner, key);
    const description = text_of(schema, "description") + (owners ? ` (only: ${owners.join(", ")})` : "");
    this.node = element(
      "div",
      { class: "leaf", "data-key": path.join(".") },
      element("label", { for: id, class: "key" }, key),
      this.control,
      this.remove,
      element("p", { class: "description" }, description),
      this.fault,
    );
    this.control.addEventListener("change", () => this.commit());
  }

  update(): void {
    const value = this.state.get(this.path);
    const present = value !== undefined;
    this.node.classList.toggle("absent", !present);
    this.remove.hidden = !present || this.required;
    if (document.activeElement !== this.control || this.fault.hidden) {
      this.control.value = present ? this.text_for(value) : this.control instanceof HTMLSelectElement ? this.default_text() : "";
      this.show_fault(null);
    }
    update_ownership(this.state, this.node, this.path, this.owner);
  }

  filter(words: string[]): boolean {
    const visible = contains(words, this.path, this.schema);
    this.node.hidden = !visible;
    return visible;
  }

  private make_control(): HTMLSelectElement | HTMLInputElement | HTMLTextAreaElement {
    const type = text_of(this.schema, "type");
    const names = type === "boolean" ? ["true", "false"] : Array.isArray(this.schema["enum"]) ? names_of(this.schema) : [];
    if (names.length > 0) {
      const select = element("select");
      if (!("default" in this.schema) && !this.required) select.append(element("option", { value: "" }, "not given"));
      select.append(...names.map((name) => element("option", { value: name }, name)));
      return select;
    }
    const items = this.schema["items"];
    if (type === "array" && is_object(items) && ["object", "array"].includes(text_of(items, "type"))) {
      return element("textarea", { rows: 2, spellcheck: "false", placeholder: this.default_text() || "[ ]" });
    }
    return element("input", { type: "text", spellcheck: "false", autocomplete: "off", placeholder: this.default_text() || "not given" });
  }

  private default_text(): string {
    const value = this.schema["default"];
    return value === undefined ? "" : this.text_for(value);
  }

  private text_for(value: Json): string {
    if (typeof value === "string") return value;
    const text = JSON.stringify(value);
    return text.replace(/,(?=\S)/g, ", ");
  }

  /** The value that `text` means. @throws SyntaxError if it is not JSON where it must be. */
  private value_for(text: string): Json {
    const type = text_of(this.schema, "type");
    if (type === "string") return text;
    try {
      return JSON.parse(text) as Json;
    } catch (error) {
      // Where a name is possible, text without quotes is a name.
      const takes_text = alternatives_of(this.schema).some((a) => "const" in a || text_of(a, "type") === "string");
      if ((takes_text || "enum" in this.schema) && /^[A-Za-z]/.test(text)) return text;
      throw error;
    }
  }

  private commit(): void {
    const text = this.control.value.trim();
    if (text === "") {
      this.show_fault(null);
      this.state.remove(this.path);
      this.update();
      return;
    }
    try {
      const value = this.value_for(text);
      const fault = fault_of(this.schema, value);
      this.show_fault(fault);
      if (fault || equal(value, this.state.get(this.path))) return;
      const key = this.path[this.path.length - 1];
      const parent = this.path.slice(0, -1);
      const object = this.state.get(parent);
      if (key === "kind" && is_object(object) && typeof value === "string") {
        this.state.set(parent, with_kind(this.owner, object, value));
      } else {
        this.state.set(this.path, value);
      }
    } catch {
      const number = number_of(this.schema, "default") !== undefined || /number|integer/.test(text_of(this.schema, "type"));
      this.show_fault(number ? "Must be a number." : "Is not JSON.");
    }
  }

  private show_fault(fault: string | null): void {
    this.fault.hidden = fault === null;
    this.fault.textContent = fault ?? "";
    this.control.toggleAttribute("aria-invalid", fault !== null);
  }
}
