// The picture: draws coarse stages at the size of the finished one, and tells where the pointer is.

import { on_arrow_keys } from "../elements/dom";
import type { PictureHeader } from "../state/protocol";

/** The longest side of the canvas; browsers limit it. */
const longest_side = 4096;
const key_step = 0.02;

export class Picture {
  /** Called with picture coordinates, 0 to 1, from the top left. */
  on_pointer: (x: number, y: number) => void = () => undefined;
  /** Called when a new picture is on the canvas. */
  on_drawn: () => void = () => undefined;
  mark: [number, number] | null = null;
  private newest = 0;

  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly frame: HTMLElement,
    private readonly cross_hair: HTMLElement,
  ) {
    new ResizeObserver(() => this.fit()).observe(frame);
    const point = (event: PointerEvent): void => {
      const box = canvas.getBoundingClientRect();
      this.point((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
    };
    canvas.addEventListener("pointermove", point);
    canvas.addEventListener("pointerdown", point);
    on_arrow_keys(canvas, (x, y) => {
      const [x0, y0] = this.mark ?? [0.5, 0.5];
      this.point(x0 + key_step * x, y0 + key_step * y);
    });
  }

  get aspect(): number {
    return this.canvas.width / this.canvas.height;
  }

  /** Marks a point and tells of it. */
  point(x: number, y: number): void {
    const limited = (value: number): number => Math.min(1, Math.max(0, value));
    this.mark = [limited(x), limited(y)];
    this.place_mark();
    this.on_pointer(...this.mark);
  }

  /** Draws a picture, unless a newer one is decoded before it. */
  async draw(header: PictureHeader, content: Uint8Array<ArrayBuffer>): Promise<void> {
    const order = ++this.newest;
    const bitmap = await createImageBitmap(new Blob([content], { type: header.format }));
    if (order < this.newest) return bitmap.close();
    const reduction = Math.min(1, longest_side / Math.max(header.full_width, header.full_height));
    const width = Math.round(header.full_width * reduction);
    const height = Math.round(header.full_height * reduction);
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    const context = this.canvas.getContext("2d");
    if (!context) return;
    context.imageSmoothingQuality = "high";
    context.clearRect(0, 0, width, height);
    context.drawImage(bitmap, 0, 0, width, height);
    bitmap.close();
    Object.assign(this.canvas.dataset, { picture: header.id, stage: header.stage, final: header.final });
    this.canvas.hidden = false;
    this.fit();
    this.on_drawn();
  }

  /** Makes the canvas as large as its frame allows. */
  private fit(): void {
    const width = Math.min(this.frame.clientWidth, this.frame.clientHeight * this.aspect);
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${width / this.aspect}px`;
    this.place_mark();
  }

  private place_mark(): void {
    this.cross_hair.hidden = this.mark === null || this.canvas.hidden;
    if (!this.mark) return;
    this.cross_hair.style.left = `${this.canvas.offsetLeft + this.mark[0] * this.canvas.offsetWidth}px`;
    this.cross_hair.style.top = `${this.canvas.offsetTop + this.mark[1] * this.canvas.offsetHeight}px`;
  }
}
