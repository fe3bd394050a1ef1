// Light and dark. Without a choice of the user, the system decides.

const key = "tensorray-theme";
const themes = ["system", "light", "dark"] as const;
const marks = { system: "◐", light: "☀", dark: "☾" };

export class Theme {
  private current: (typeof themes)[number];
  /** Called when the colours are others. */
  on_change: () => void = () => undefined;
  private readonly system = matchMedia("(prefers-color-scheme: dark)");

  constructor(private readonly switch_button: HTMLButtonElement) {
    const stored = localStorage.getItem(key);
    this.current = themes.find((theme) => theme === stored) ?? "system";
    this.show();
    switch_button.addEventListener("click", () => {
      this.current = themes[(themes.indexOf(this.current) + 1) % themes.length]!;
      localStorage.setItem(key, this.current);
      this.show();
    });
    this.system.addEventListener("change", () => this.show());
  }

  private show(): void {
    const system = this.system.matches ? "dark" : "light";
    document.documentElement.dataset["theme"] = this.current === "system" ? system : this.current;
    this.switch_button.textContent = marks[this.current];
    const name = this.current === "system" ? "as the system" : this.current;
    this.switch_button.title = "Theme: " + name;
    this.switch_button.setAttribute("aria-label", "Theme: " + name);
    this.on_change();
  }
}
