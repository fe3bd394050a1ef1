// The present scene, with undo and redo. One gesture, such as a drag, is one step.

import { apply_patch, equal, merge_patch, value_at, with_value, without_value } from "./json";
import type { Json, JsonObject, Path } from "./json";

/** Repeated key presses on one control within this time are one step; ms. */
const repeat_time = 600;
const max_steps = 500;

export class State {
  original: JsonObject = {};
  scene: JsonObject = {};
  /** What the render of the last picture has chosen where the scene leaves it open, and suggestions: as parts of scenes. */
  chosen: JsonObject = {};
  examples: JsonObject = {};
  past: readonly JsonObject[] = [];
  future: readonly JsonObject[] = [];
  private gesture: string | null = null;
  private gesture_open = false;
  private last_change = 0;
  /** Called when the scene is another one. */
  on_change: () => void = () => undefined;

  /** Begins with the scene of the server, changed by `patch`. */
  begin(original: JsonObject, patch: JsonObject): void {
    this.original = original;
    this.scene = apply_patch(original, patch);
    this.past = [];
    this.future = [];
    this.gesture = null;
    this.on_change();
  }

  get(path: Path): Json | undefined {
    return value_at(this.scene, path);
  }

  patch(): JsonObject {
    return merge_patch(this.original, this.scene);
  }

  /**
   * Replaces the scene. Changes with the same `gesture` are one step until finish() is called.
   * Without `gesture`, the change is a step of its own.
   */
  replace(scene: JsonObject, gesture: string | null = null): void {
    if (equal(scene, this.scene)) return;
    const now = Date.now();
    const same = gesture !== null && gesture === this.gesture;
    const continues = same && (this.gesture_open || now - this.last_change < repeat_time);
    if (!continues) this.past = [...this.past, this.scene].slice(-max_steps);
    this.future = [];
    this.gesture = gesture;
    this.gesture_open = gesture !== null;
    this.last_change = now;
    this.scene = scene;
    this.on_change();
  }

  set(path: Path, value: Json, gesture: string | null = null): void {
    this.replace(with_value(this.scene, path, value), gesture);
  }

  remove(path: Path): void {
    this.replace(without_value(this.scene, path));
  }

  /**
   * Ends the gesture: the hand has let go.
   * @param may_continue  The same gesture may go on soon, as key presses do.
   */
  finish(may_continue = false): void {
    this.gesture_open = false;
    if (!may_continue) this.gesture = null;
    this.last_change = Date.now();
  }

  undo(): void {
    this.move("past", "future");
  }

  redo(): void {
    this.move("future", "past");
  }

  private move(from: "past" | "future", to: "past" | "future"): void {
    const scene = this[from].at(-1);
    if (!scene) return;
    this[from] = this[from].slice(0, -1);
    this[to] = [...this[to], this.scene];
    this.scene = scene;
    this.gesture = null;
    this.on_change();
  }
}
