// A word from a list, and any other value as text.

import { element } from "../elements/dom";
import { is_object, type Json } from "../state/json";
import { text_of } from "../state/schema";
import type { Control, Key } from "./key";

function written(value: Json | undefined): string {
  if (value === undefined || typeof value === "string") return value ?? "";
  return JSON.stringify(value).replace(/,(?=\S)/g, ", ");
}

/** As --set reads it: JSON, or text that is not JSON. */
function parsed(text: string): Json {
  try {
    return JSON.parse(text) as Json;
  } catch {
    return text;
  }
}

/** A list of words. */
export class Choice implements Control {
  readonly node: HTMLSelectElement;

  constructor(private readonly key: Key) {
    this.node = element("select", { id: key.id });
    if (!("default" in key.schema) && !key.required) this.node.append(element("option", { value: "" }, "not given"));
    this.node.append(...key.names.map((name) => element("option", { value: name }, name.replace(/_/g, " "))));
    this.node.addEventListener("change", () => {
      if (this.node.value === "") key.reset();
      else key.set(text_of(key.schema, "type") === "boolean" ? this.node.value === "true" : this.node.value);
    });
  }

  update(): void {
    this.node.value = written(this.key.value);
  }
}

/** A text, with suggestions. Where it is empty, the value that counts is dimmed. */
export class TextBox implements Control {
  readonly node: HTMLElement;
  private readonly box: HTMLInputElement | HTMLTextAreaElement;
  private readonly suggestions = element("datalist");

  constructor(private readonly key: Key) {
    const items = key.schema["items"];
    const has_lines = is_object(items) && ["object", "array"].includes(text_of(items, "type"));
    const attributes = { id: key.id, spellcheck: "false", autocomplete: "off" };
    this.suggestions.id = key.id + "-list";
    this.box = has_lines
      ? element("textarea", { ...attributes, rows: 2 })
      : element("input", { ...attributes, type: "text", list: this.suggestions.id });
    this.node = element("div", { class: "text" }, this.box, this.suggestions);
    this.box.addEventListener("change", () => {
      const text = this.box.value.trim();
      if (text === "") key.state.remove(key.path);
      else key.set(text_of(key.schema, "type") === "string" ? text : parsed(text));
    });
  }

  update(): void {
    if (document.activeElement !== this.box) this.box.value = written(this.key.given);
    this.box.placeholder = written(this.key.value) || "not given";
    const names = this.key.examples;
    if ([...this.suggestions.options].map((option) => option.value).join("\n") === names.join("\n")) return;
    this.suggestions.replaceChildren(...names.map((name) => element("option", { value: name })));
  }
}
