// Knobs for names: a list to choose from, and a text with suggestions.

import { element } from "../elements/dom";

export interface ChoiceOptions {
  name: string;
  label: string;
  hint?: string;
  names: () => string[];
  /** The present name; it need not be among the names. */
  value: () => string;
  /** The name that is used if none is given. */
  fallback?: string;
  /** @param name  Empty: the default. */
  on_choice: (name: string) => void;
}

/** A list to choose from. */
export class Choice {
  readonly node: HTMLElement;
  private readonly select: HTMLSelectElement;

  constructor(private readonly options: ChoiceOptions) {
    const id = "knob-" + options.name;
    this.select = element("select", { id });
    this.node = element("div", { class: "knob choice", "data-knob": options.name, title: options.hint ?? "" });
    this.node.append(element("label", { for: id }, options.label), this.select);
    this.select.addEventListener("change", () => options.on_choice(this.select.value));
  }

  update(): void {
    const value = this.options.value();
    const names = this.options.names();
    const all = names.includes(value) ? names : [...names, value];
    const shown = [...this.select.options].map((option) => option.value);
    if (shown.join("\n") !== all.join("\n")) {
      this.select.replaceChildren(...all.map((name) => element("option", { value: name }, name.replace(/_/g, " "))));
    }
    this.select.value = value;
  }
}

/** A text with suggestions. */
export class SuggestedText {
  readonly node: HTMLElement;
  private readonly box: HTMLInputElement;
  private readonly list: HTMLDataListElement;

  constructor(private readonly options: ChoiceOptions) {
    const id = "knob-" + options.name;
    this.box = element("input", { id, type: "text", list: id + "-list", spellcheck: "false", autocomplete: "off" });
    if (options.fallback) this.box.placeholder = options.fallback;
    this.list = element("datalist", { id: id + "-list" });
    this.node = element("div", { class: "knob choice", "data-knob": options.name, title: options.hint ?? "" });
    this.node.append(element("label", { for: id }, options.label), this.box, this.list);
    this.box.addEventListener("change", () => options.on_choice(this.box.value.trim()));
  }

  update(): void {
    if (document.activeElement !== this.box) this.box.value = this.options.value();
    const names = this.options.names();
    if (this.list.childElementCount !== names.length) {
      this.list.replaceChildren(...names.map((name) => element("option", { value: name })));
    }
  }
}
