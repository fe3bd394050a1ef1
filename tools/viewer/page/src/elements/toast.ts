// A short message that disappears.

import { by_id } from "./dom";

const shown_time = 3500;  // ms
let timer = 0;

export function show_toast(message: string): void {
  const toast = by_id("toast");
  toast.textContent = message;
  toast.hidden = false;
  clearTimeout(timer);
  timer = window.setTimeout(() => (toast.hidden = true), shown_time);
}
