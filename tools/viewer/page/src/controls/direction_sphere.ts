// A direction: a sphere that one turns, with the axes of the world as the 3D pane shows them.

import { Vector3 } from "three";
import { axis_colors, button, element, on_arrow_keys, on_drag, style_value } from "../elements/dom";
import type { Vector } from "../state/protocol";
import type { Control, Key } from "./key";

const size = 132;  // CSS pixels
const radius = 54;
const key_angle = (5 * Math.PI) / 180;

/** To the canvas, and towards the viewer. */
type Projection = (v: Vector3) => [number, number, number];

export class DirectionSphere implements Control {
  readonly node: HTMLElement;
  private static readonly all: DirectionSphere[] = [];
  private static view = { right: new Vector3(1, 0, 0), up: new Vector3(0, 0, 1), toward: new Vector3(0, -1, 0) };
  private readonly canvas: HTMLCanvasElement;
  private readonly text: HTMLOutputElement;
  private readonly snaps: [Vector3, HTMLButtonElement][] = [];

  /** Turns all spheres as the 3D pane is turned. */
  static set_view(right: Vector, up: Vector, toward: Vector): void {
    DirectionSphere.view = { right: new Vector3(...right), up: new Vector3(...up), toward: new Vector3(...toward) };
    for (const sphere of DirectionSphere.all) sphere.draw();
  }

  constructor(private readonly key: Key) {
    DirectionSphere.all.push(this);
    this.text = element("output", { class: "direction-text", id: key.id + "-text" });
    this.canvas = element("canvas", {
      id: key.id,
      class: "direction-sphere",
      tabindex: 0,
      role: "application",
      "aria-label": key.dotted + ". Drag the sphere, or use the arrow keys.",
      "aria-describedby": key.id + "-text",
      title: "Drag the sphere to turn the direction. Arrow keys: 5 degrees, with shift 1 degree.",
    });
    const ratio = Math.min(2, devicePixelRatio);
    this.canvas.width = this.canvas.height = size * ratio;
    this.canvas.getContext("2d")?.scale(ratio, ratio);
    const snaps = element("div", { class: "snaps" });
    for (const [i, axis] of ["x", "y", "z"].entries()) {
      for (const sign of [1, -1]) {
        const direction = new Vector3().setComponent(i, sign);
        const name = (sign > 0 ? "+" : "−") + axis;
        const snap = button(name, { "data-snap": (sign > 0 ? "+" : "-") + axis, "aria-label": key.dotted + " " + name }, () => {
          key.set(direction.toArray());
          key.state.finish(false);
        });
        this.snaps.push([direction, snap]);
        snaps.append(snap);
      }
    }
    const side = element("div", { class: "direction-side" }, this.text, snaps);
    this.node = element("div", { class: "direction" }, this.canvas, side);
    this.listen();
  }

  update(): void {
    const direction = this.direction;
    this.text.textContent = direction ? direction.toArray().map((x) => x.toFixed(2).replace("-", "−")).join("  ") : "…";
    for (const [axis, snap] of this.snaps) {
      const is_this = direction !== null && !this.key.automatic && direction.dot(axis) > 0.9999;
      snap.setAttribute("aria-pressed", String(is_this));
    }
    this.draw();
  }

  /** Null if it is not known yet. */
  private get direction(): Vector3 | null {
    const value = this.key.value;
    const fits = Array.isArray(value) && value.length === 3 && value.every((x) => typeof x === "number");
    return fits ? new Vector3(...(value as Vector)).normalize() : null;
  }

  private turn(horizontal: number, vertical: number): void {
    const { right, up, toward } = DirectionSphere.view;
    const turned = (this.direction ?? toward.clone()).applyAxisAngle(up, horizontal).applyAxisAngle(right, vertical);
    // Few digits, for scene files.
    this.key.set(turned.normalize().toArray().map((x) => Math.round(x * 1e4) / 1e4 + 0), " turned");
  }

  private listen(): void {
    on_drag(this.canvas, (x, y) => this.turn(x / radius, y / radius), () => this.key.state.finish(false));
    const turn = (x: number, y: number): void => {
      this.turn(key_angle * x, key_angle * y);
      this.key.state.finish(true);
    };
    on_arrow_keys(this.canvas, turn, 0.2);
  }

  private draw(): void {
    const context = this.canvas.getContext("2d");
    if (!context) return;
    const middle = size / 2;
    const { right, up, toward } = DirectionSphere.view;
    const shown: Projection = (v) => [middle + radius * v.dot(right), middle - radius * v.dot(up), v.dot(toward)];
    context.clearRect(0, 0, size, size);
    const shade = context.createRadialGradient(middle - 18, middle - 22, 6, middle, middle, radius);
    shade.addColorStop(0, style_value("--sphere-light"));
    shade.addColorStop(1, style_value("--sphere-dark"));
    context.fillStyle = shade;
    context.beginPath();
    context.arc(middle, middle, radius, 0, 2 * Math.PI);
    context.fill();
    context.strokeStyle = style_value("--line-strong");
    context.lineWidth = 1;
    context.stroke();

    this.draw_axes(context, shown);
    if (this.direction) this.draw_arrow(context, this.direction, shown);
  }

  private draw_axes(context: CanvasRenderingContext2D, shown: Projection): void {
    context.font = "bold 11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (const [i, [name, color]] of Object.entries(axis_colors).entries()) {
      const axis = new Vector3().setComponent(i, 1);
      const [x, y, depth] = shown(axis);
      const [x0, y0] = shown(axis.clone().negate());
      context.globalAlpha = depth < 0 ? 0.45 : 1;
      context.strokeStyle = context.fillStyle = color;
      context.lineWidth = 1;
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x, y);
      context.stroke();
      const [lx, ly] = shown(axis.clone().multiplyScalar(1.17));
      context.fillText(name, lx, ly);
    }
    context.globalAlpha = 1;
  }

  /** The arrow comes from one side of the sphere and leaves at the other, where the handle is. */
  private draw_arrow(context: CanvasRenderingContext2D, direction: Vector3, shown: Projection): void {
    const [x0, y0] = shown(direction.clone().negate());
    const [x, y, depth] = shown(direction);
    const color = style_value("--beam");
    context.strokeStyle = context.fillStyle = color;
    context.lineWidth = 3;
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x, y);
    context.stroke();
    const angle = Math.atan2(y - y0, x - x0);
    const flat = Math.hypot(x - x0, y - y0) / (2 * radius);
    if (flat > 0.12) {
      // Two heads along the arrow show the way.
      for (const part of [0.3, 0.62]) {
        const [hx, hy] = [x0 + (x - x0) * part, y0 + (y - y0) * part];
        context.beginPath();
        context.moveTo(hx + 8 * Math.cos(angle), hy + 8 * Math.sin(angle));
        for (const side of [2.4, -2.4]) context.lineTo(hx + 8 * Math.cos(angle + side), hy + 8 * Math.sin(angle + side));
        context.fill();
      }
    }
    context.beginPath();
    context.arc(x, y, 7, 0, 2 * Math.PI);
    context.fillStyle = depth >= 0 ? color : style_value("--surface");
    context.fill();
    context.lineWidth = 2;
    context.stroke();
  }
}
