// Makes elements of the page.

type Attributes = Record<string, string | boolean | number>;
type Child = Node | string;

function with_parts<T extends Element>(node: T, attributes: Attributes, children: Child[]): T {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) node.setAttribute(name, "");
    else if (value !== false) node.setAttribute(name, String(value));
  }
  node.append(...children);
  return node;
}

export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  return with_parts(document.createElement(tag), attributes, children);
}

export function svg_element<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): SVGElementTagNameMap[K] {
  return with_parts(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

export function button(text: string, attributes: Attributes, action: () => void): HTMLButtonElement {
  const node = element("button", { type: "button", ...attributes }, text);
  node.addEventListener("click", action);
  return node;
}

/** Calls `move` for arrow keys, with 1 or −1 along x (to the right) or y (down), or with ± `fine` if shift is held. */
export function on_arrow_keys(node: HTMLElement | SVGElement, move: (x: number, y: number) => void, fine = 0.1): void {
  const moves: Record<string, [number, number]> = {
    ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
  };
  (node as HTMLElement).addEventListener("keydown", (event) => {
    const [x, y] = moves[event.key] ?? [0, 0];
    if (x === 0 && y === 0) return;
    event.preventDefault();
    const step = event.shiftKey ? fine : 1;
    move(step * x, step * y);
  });
}

/** Calls `move` while the pointer drags `node`, with its way since the last call, CSS pixels; then `end`. */
export function on_drag(
  node: HTMLElement | SVGElement,
  move: (x: number, y: number, event: PointerEvent) => void,
  end: () => void,
): void {
  const target = node as HTMLElement;
  let last: PointerEvent | null = null;
  target.addEventListener("pointerdown", (event) => {
    target.setPointerCapture(event.pointerId);
    last = event;
  });
  target.addEventListener("pointermove", (event) => {
    if (!last) return;
    const [x, y] = [event.clientX - last.clientX, event.clientY - last.clientY];
    last = event;
    move(x, y, event);
  });
  for (const name of ["pointerup", "pointercancel"] as const)
    target.addEventListener(name, () => {
      if (last) end();
      last = null;
    });
}

/** The element of index.html with this id. */
export function by_id<T extends HTMLElement = HTMLElement>(id: string): T {
  const node = document.getElementById(id);
  if (!node) throw new Error("index.html has no element " + id);
  return node as T;
}

/** The colours of the world's axes. */
export const axis_colors = { x: "#d64545", y: "#3c9a3c", z: "#3d6fe0" };

/** The value of a custom property of view.css, such as --ink. */
export function style_value(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
