// The line below the picture: stage, seconds, progress, notes, warnings, and errors.

import { by_id, element } from "../elements/dom";
import type { PictureHeader, Progress } from "../state/protocol";

export class StatusLine {
  private readonly stage = by_id("status-stage");
  private readonly progress = by_id<HTMLProgressElement>("status-progress");
  private readonly messages = by_id("status-messages");
  private readonly error = by_id("error");

  private is_final = true;

  constructor() {
    this.messages.addEventListener("click", () => {
      this.messages.setAttribute("aria-expanded", String(this.messages.getAttribute("aria-expanded") !== "true"));
    });
  }

  show_picture(header: PictureHeader): void {
    this.is_final = header.final;
    const size = `${header.full_width} × ${header.full_height}`;
    const seconds = `${header.seconds.toPrecision(2)} s`;
    this.stage.textContent = header.final ? `Finished in ${seconds}, ${size}` : `Stage ${header.stage + 1}, ${seconds}, refining…`;
    if (header.final) this.progress.hidden = true;
    const messages = [
      ...(header.warnings ?? []).map((text) => element("span", { class: "warning" }, text)),
      ...(header.notes ?? []).map((text) => element("span", { class: "note" }, text)),
    ];
    this.messages.replaceChildren(...messages);
    this.messages.hidden = messages.length === 0;
    this.show_error(null);
  }

  show_progress(progress: Progress): void {
    this.progress.hidden = !(progress.total > 0 && progress.done < progress.total);
    this.progress.value = progress.total > 0 ? progress.done / progress.total : 0;
    this.progress.title = progress.phase;
    this.progress.setAttribute("aria-label", progress.phase);
  }

  /** Nothing is computed any more, unless a picture is still to be finished. */
  settle(): void {
    if (this.is_final) this.progress.hidden = true;
  }

  show_error(message: string | null): void {
    this.error.hidden = message === null;
    this.error.textContent = message ?? "";
    this.error.title = message ?? "";
    if (message === null) return;
    this.progress.hidden = true;
    if (!this.is_final) this.stage.textContent = "Stopped";
  }
}
