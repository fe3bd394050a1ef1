// Makes elements of the page.

type Attributes = Record<string, string | boolean | number>;
type Child = Node | string;

function attach(node: Element, attributes: Attributes, children: Child[]): void {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) node.setAttribute(name, "");
    else if (value !== false) node.setAttribute(name, String(value));
  }
  node.append(...children);
}

export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const node = document.createElement(tag);
  attach(node, attributes, children);
  return node;
}

export function svg_element<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): SVGElementTagNameMap[K] {
  const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
  attach(node, attributes, children);
  return node;
}

export function button(text: string, attributes: Attributes, action: () => void): HTMLButtonElement {
  const node = element("button", { type: "button", ...attributes }, text);
  node.addEventListener("click", action);
  return node;
}

/** The element of index.html with this id. */
export function by_id<T extends HTMLElement = HTMLElement>(id: string): T {
  const node = document.getElementById(id);
  if (!node) throw new Error("index.html has no element " + id);
  return node as T;
}

/** The value of a custom property of view.css, such as --ink. */
export function style_value(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
