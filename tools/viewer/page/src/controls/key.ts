// One key of the scene: what its schema says, its value, and how a control changes it.

import { is_object, value_at, type Json, type Path } from "../state/json";
import { main_schema, text_of, texts_of, with_key, word_of, type Schema } from "../state/schema";
import type { State } from "../state/state";

/** What shows a key and changes it. */
export interface Control {
  readonly node: HTMLElement;
  /** Shows the present scene. */
  update(): void;
}

export class Key {
  readonly name: string;
  readonly dotted: string;
  /** For elements. */
  readonly id: string;
  readonly word: string | null;
  /** Without words. */
  readonly main: Schema;
  readonly required: boolean;

  /** @param owner  The schema of the object that has the key. */
  constructor(readonly state: State, readonly schema: Schema, readonly path: Path, readonly owner: Schema) {
    this.name = path[path.length - 1] ?? "";
    this.dotted = path.join(".");
    this.id = "key-" + path.join("-");
    this.word = word_of(schema);
    this.main = main_schema(schema);
    this.required = texts_of(owner, "required").includes(this.name);
  }

  get given(): Json | undefined {
    return this.state.get(this.path);
  }

  /** Whether the render chooses the value. */
  get automatic(): boolean {
    return this.given === undefined || this.given === this.word;
  }

  /** The value that counts: the scene's, or what the last picture has chosen, or the default. */
  get value(): Json | undefined {
    if (!this.automatic) return this.given;
    return value_at(this.state.chosen, this.path) ?? this.given ?? this.schema["default"];
  }

  /** The words to choose from, and the only ones. */
  get names(): string[] {
    return text_of(this.schema, "type") === "boolean" ? ["true", "false"] : texts_of(this.schema, "enum");
  }

  /** Words that are suggested. */
  get examples(): string[] {
    const known = value_at(this.state.examples, this.path);
    return texts_of(Array.isArray(known) ? { examples: known } : this.schema, "examples");
  }

  /** Sets the key, and removes those that it excludes. @param gesture  Part of what the hand does, if it goes on. */
  set(value: Json, gesture = ""): void {
    const parent = this.path.slice(0, -1);
    const object = this.state.get(parent);
    const changed = with_key(this.owner, is_object(object) ? object : {}, this.name, value);
    this.state.set(parent, changed, gesture === "" ? null : this.dotted + gesture);
  }

  /** Makes the value automatic, or the default. */
  reset(): void {
    if (this.word !== null && this.given !== this.word) this.set(this.word);
    else this.state.remove(this.path);
  }
}
