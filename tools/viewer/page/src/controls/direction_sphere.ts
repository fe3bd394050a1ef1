// The knob for a direction: a sphere that one turns, with the axes of the world as the 3D pane shows them.

import { button, element, style_value } from "../elements/dom";
import type { Vector } from "../state/protocol";
import { dot, normalized, rounded, times, turned } from "../state/vector";

const size = 132;  // CSS pixels
const radius = 54;
const key_angle = (5 * Math.PI) / 180;

export interface DirectionOptions {
  /** The present direction, and whether it is automatic; null if it is not known yet. */
  value: () => { direction: Vector | null; automatic: boolean };
  on_input: (direction: Vector) => void;
  on_finish: (by_key: boolean) => void;
  on_automatic: () => void;
}

export class DirectionSphere {
  readonly node: HTMLElement;
  private readonly canvas: HTMLCanvasElement;
  private readonly text = element("output", { class: "direction-text", id: "knob-direction-text" });
  private readonly automatic: HTMLButtonElement;
  private readonly snaps: [Vector, HTMLButtonElement][] = [];
  private right: Vector = [1, 0, 0];
  private up: Vector = [0, 0, 1];
  private toward: Vector = [0, -1, 0];

  constructor(private readonly options: DirectionOptions) {
    this.canvas = element("canvas", {
      id: "knob-direction",
      class: "direction-sphere",
      tabindex: 0,
      role: "application",
      "aria-label": "Direction of light. Drag the sphere, or use the arrow keys.",
      "aria-describedby": "knob-direction-text",
      title: "Drag the sphere to turn the light. Arrow keys: 5 degrees, with shift 1 degree.",
    });
    const ratio = Math.min(2, devicePixelRatio);
    this.canvas.width = this.canvas.height = size * ratio;
    this.canvas.getContext("2d")?.scale(ratio, ratio);
    const snaps = element("div", { class: "snaps" });
    for (const [i, axis] of ["x", "y", "z"].entries()) {
      for (const sign of [1, -1]) {
        const direction: Vector = [0, 0, 0];
        direction[i] = sign;
        const name = (sign > 0 ? "+" : "−") + axis;
        const snap = button(name, { "data-snap": (sign > 0 ? "+" : "-") + axis, "aria-label": "Light along " + name }, () => {
          options.on_input(direction);
          options.on_finish(false);
        });
        this.snaps.push([direction, snap]);
        snaps.append(snap);
      }
    }
    this.automatic = button("automatic", { class: "automatic", id: "knob-direction-automatic", "aria-pressed": "false" }, () =>
      options.on_automatic(),
    );
    const side = element("div", { class: "direction-side" }, this.text, snaps, this.automatic);
    this.node = element("div", { class: "knob direction", "data-knob": "direction" }, this.canvas, side);
    this.listen();
  }

  /** Turns the sphere as the 3D pane is turned. */
  set_view(right: Vector, up: Vector, toward: Vector): void {
    [this.right, this.up, this.toward] = [right, up, toward];
    this.draw();
  }

  update(): void {
    const { direction, automatic } = this.options.value();
    this.text.textContent = direction ? direction.map((x) => x.toFixed(2).replace("-", "−")).join("  ") : "…";
    this.automatic.setAttribute("aria-pressed", String(automatic));
    for (const [axis, snap] of this.snaps) {
      snap.setAttribute("aria-pressed", String(direction !== null && !automatic && dot(normalized(direction), axis) > 0.9999));
    }
    this.draw();
  }

  private turn(horizontal: number, vertical: number): void {
    const { direction } = this.options.value();
    const start = direction ? normalized(direction) : this.toward;
    this.options.on_input(rounded(turned(turned(start, this.up, horizontal), this.right, vertical)));
  }

  private listen(): void {
    let last: [number, number] | null = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      last = [event.clientX, event.clientY];
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      this.turn((event.clientX - last[0]) / radius, (event.clientY - last[1]) / radius);
      last = [event.clientX, event.clientY];
    });
    const end = (): void => {
      if (last) this.options.on_finish(false);
      last = null;
    };
    this.canvas.addEventListener("pointerup", end);
    this.canvas.addEventListener("pointercancel", end);
    this.canvas.addEventListener("keydown", (event) => {
      const angle = event.shiftKey ? key_angle / 5 : key_angle;
      const turns: Record<string, [number, number]> = {
        ArrowLeft: [-angle, 0], ArrowRight: [angle, 0], ArrowUp: [0, -angle], ArrowDown: [0, angle],
      };
      const turn = turns[event.key];
      if (!turn) return;
      event.preventDefault();
      this.turn(...turn);
      this.options.on_finish(true);
    });
  }

  private draw(): void {
    const context = this.canvas.getContext("2d");
    if (!context) return;
    const middle = size / 2;
    const shown = (v: Vector): [number, number, number] => [
      middle + radius * dot(v, this.right),
      middle - radius * dot(v, this.up),
      dot(v, this.toward),
    ];
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
    const { direction } = this.options.value();
    if (direction) this.draw_arrow(context, normalized(direction), shown);
  }

  private draw_axes(context: CanvasRenderingContext2D, shown: (v: Vector) => [number, number, number]): void {
    context.font = "bold 11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    const axes: [string, string, Vector][] = [
      ["x", "#d64545", [1, 0, 0]], ["y", "#3c9a3c", [0, 1, 0]], ["z", "#3d6fe0", [0, 0, 1]],
    ];
    for (const [name, color, axis] of axes) {
      const [x, y, depth] = shown(axis);
      const [x0, y0] = shown(times(-1, axis));
      context.globalAlpha = depth < 0 ? 0.45 : 1;
      context.strokeStyle = context.fillStyle = color;
      context.lineWidth = 1;
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x, y);
      context.stroke();
      const [lx, ly] = shown(times(1.17, axis));
      context.fillText(name, lx, ly);
    }
    context.globalAlpha = 1;
  }

  /** The light comes from one side of the sphere and leaves at the other, where the handle is. */
  private draw_arrow(
    context: CanvasRenderingContext2D,
    direction: Vector,
    shown: (v: Vector) => [number, number, number],
  ): void {
    const [x0, y0] = shown(times(-1, direction));
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
      // Two heads along the arrow show which way light travels.
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
